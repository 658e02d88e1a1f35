//! Depths that follow a moving eye: a step looks only at the features whose depth can have changed.
//!
//! A feature keeps its depth while its distance to the eye stays within a range ([`Feature::hold`]), and a distance
//! changes by no more than the eye moves. So every feature has a length of the eye's path before which its depth is
//! certain; a heap hands out those whose length is behind. A feature that is looked at and keeps its depth goes back
//! with what is left of its range.
//!
//! The depths are those of [`Features::depths`] with the depths of the step before, whatever the path. Beside
//! [`Blocks::change_depths`](super::Blocks::change_depths), which moves the blocks of the features that are named here;
//! knows no tables.

use std::{
    cmp::{Ordering, Reverse},
    collections::BinaryHeap,
};

use super::{DepthRule, Features};

/// One in so many features due: all are looked at, which costs less than taking them from the heap.
const ONE_IN: usize = 8;

/// The features of a cage, and their depths for an eye that moves.
///
/// ```
/// use drumlin_core::{cage::{Cage, Faces, Tags}, fas::{Blocks, DepthRule, DepthWatch, Features, Positions}};
///
/// let corners = [0, 1].map(|z| [[0.0, 0.0, z as f64], [1.0, 0.0, z as f64], [1.0, 1.0, z as f64], [0.0, 1.0, z as f64]]);
/// let sides = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
/// let cube = Cage::new(corners.concat(), Faces::quads(&sides), &Tags::default())?;
/// let mut watch = DepthWatch::new(Features::of(&cube), [9.0, 0.0, 0.0], 1000.0, DepthRule::DEFAULT);
/// let mut blocks = Blocks::new(cube.topology())?;
/// blocks.set_depths(watch.depths())?;
/// let mut points = Positions::new(&blocks, cube.positions());
///
/// let changed = watch.step([3.0, 0.0, 0.0]);
/// assert!(!changed.is_empty());
/// let changes = blocks.change_depths(watch.depths(), &changed)?;
/// points.update(&blocks, &changes);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct DepthWatch {
    features: Features,
    pixels_per_radian: f64,
    rule: DepthRule,
    eye: [f64; 3],
    /// Length of the eye's path so far, rounded up.
    travelled: f64,
    depths: Vec<u8>,
    /// All features, by the length of the path at which their depth may change.
    due: BinaryHeap<Reverse<Due>>,
    looked_at: usize,
}

impl DepthWatch {
    /// Looks at all features from `eye`, with `pixels_per_radian` as in [`Features::depths`].
    #[must_use]
    pub fn new(features: Features, eye: [f64; 3], pixels_per_radian: f64, rule: DepthRule) -> Self {
        let depths = features.depths(eye, pixels_per_radian, rule, &[]);
        let mut watch = Self {
            features,
            pixels_per_radian,
            rule,
            eye,
            travelled: 0.0,
            depths,
            due: BinaryHeap::new(),
            looked_at: 0,
        };
        watch.look_at_all(&mut Vec::new());
        watch
    }

    /// One depth a vertex of the cage; 0 for vertices that are no features.
    #[must_use]
    pub fn depths(&self) -> &[u8] {
        &self.depths
    }

    /// Features that the last step looked at.
    #[must_use]
    pub fn looked_at(&self) -> usize {
        self.looked_at
    }

    /// Moves the eye; gives the vertices whose depth changed, each once.
    ///
    /// Costs what is looked at, not what there is.
    pub fn step(&mut self, eye: [f64; 3]) -> Vec<u32> {
        let [x, y, z] = [0, 1, 2].map(|axis| eye[axis] - self.eye[axis]);
        let length = (x * x + y * y + z * z).sqrt();
        self.eye = eye;
        // Four roundings of the length and one of the sum: never less than the true path.
        self.travelled = (self.travelled + length * (1.0 + 4.0 * f64::EPSILON)).next_up();
        self.looked_at = 0;
        let mut changed = Vec::new();
        let few = self.features.list.len() / ONE_IN;
        let mut again = Vec::new();
        while let Some(Reverse(due)) = self.due.peek()
            && due.is_reached(self.travelled)
        {
            if self.looked_at >= few {
                // Those that were looked at already keep what they were given: looking twice changes nothing.
                self.look_at_all(&mut changed);
                return changed;
            }
            let index = due.index;
            self.due.pop();
            again.push(Reverse(self.look(index, &mut changed)));
        }
        self.due.extend(again);
        changed
    }

    /// Looks at every feature and makes the heap anew, with the path beginning here.
    fn look_at_all(&mut self, changed: &mut Vec<u32>) {
        self.travelled = 0.0;
        let mut due = std::mem::take(&mut self.due).into_vec();
        due.clear();
        for index in 0..self.features.list.len() {
            due.push(Reverse(self.look(index as u32, changed)));
        }
        self.due = due.into();
    }

    /// Looks at one feature: notes its depth, and tells when it may change next.
    fn look(&mut self, index: u32, changed: &mut Vec<u32>) -> Due {
        self.looked_at += 1;
        let feature = &self.features.list[index as usize];
        let depth = &mut self.depths[feature.vertex as usize];
        let (found, distance) =
            feature.look(self.eye, self.pixels_per_radian, self.rule, Some(*depth));
        if found != *depth {
            *depth = found;
            changed.push(feature.vertex);
        }
        let [near, far] = feature.hold(found, self.pixels_per_radian, self.rule);
        // Within the margin of a change it is looked at again with the next step.
        let slack = (distance - near).min(far - distance).max(0.0);
        Due {
            travelled: (self.travelled + slack).next_down(),
            index,
        }
    }
}

/// A feature, and the length of the path before which its depth is certain.
#[derive(Clone, Copy, Debug)]
struct Due {
    travelled: f64,
    index: u32,
}

impl Due {
    /// Also when the length is no number, after an eye that was none.
    fn is_reached(&self, travelled: f64) -> bool {
        self.travelled <= travelled || travelled.is_nan()
    }
}

impl Ord for Due {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_length = self.travelled.total_cmp(&other.travelled);
        by_length.then(self.index.cmp(&other.index))
    }
}

impl PartialOrd for Due {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Due {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Due {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fas::{
        Blocks, Piece, Positions,
        testing::{CAGES, cage},
    };

    const PIXELS: f64 = 1000.0;
    const RULES: [DepthRule; 2] = [DepthRule::DEFAULT, DepthRule::AreaRatio { area: 64.0 }];

    /// An eye that walks around a cage: small steps and jumps, near and far.
    struct Walk {
        state: u64,
        eye: [f64; 3],
        extent: f64,
    }

    impl Walk {
        fn around(extent: f64, seed: u64) -> Self {
            Self {
                state: seed,
                eye: [extent, 0.0, 0.0],
                extent,
            }
        }

        /// From -1 to 1.
        fn random(&mut self) -> f64 {
            self.state = self
                .state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.state >> 40) as f64 / f64::from(1 << 23) - 1.0
        }

        fn next(&mut self, step: usize) -> [f64; 3] {
            // A step of a thousandth of the cage to one of thrice the cage, every eleventh.
            let length = self.extent
                * if step % 11 == 10 {
                    3.0
                } else {
                    [1e-3, 1e-2, 0.1][step % 3]
                };
            for axis in 0..3 {
                self.eye[axis] += length * self.random();
            }
            if self.eye.iter().any(|at| at.abs() > 8.0 * self.extent) {
                self.eye = [0.0; 3];
            }
            self.eye
        }
    }

    #[test]
    fn after_any_journey_depths_are_those_of_the_rule_everywhere() {
        for name in CAGES.into_iter().chain(["table1/table1_koala"]) {
            let Some(cage) = cage(name) else { return };
            for (seed, rule) in (1..).zip(RULES) {
                let features = Features::of(&cage);
                let mut walk = Walk::around(cage.extent(), seed);
                let mut watch = DepthWatch::new(features.clone(), walk.eye, PIXELS, rule);
                let mut wanted = features.depths(walk.eye, PIXELS, rule, &[]);
                let mut looked_at = 0;
                for step in 0..400 {
                    let eye = walk.next(step);
                    let before = wanted.clone();
                    wanted = features.depths(eye, PIXELS, rule, &before);
                    let mut changed = watch.step(eye);
                    looked_at += watch.looked_at();
                    changed.sort_unstable();
                    let differs = (0..wanted.len()).filter(|&at| before[at] != wanted[at]);
                    let differs: Vec<_> = differs.map(|at| at as u32).collect();
                    assert_eq!(watch.depths(), wanted, "{name}, step {step}");
                    assert_eq!(changed, differs, "{name}, step {step}");
                }
                assert!(
                    looked_at < 400 * features.list.len() / 2,
                    "{name}: {looked_at}"
                );
            }
        }
    }

    #[test]
    fn blocks_that_follow_are_those_of_a_rebuild() {
        for name in ["box_creases", "polycube_a", "table1/table1_koala"] {
            let Some(cage) = cage(name) else { return };
            let rule = DepthRule::DEFAULT;
            let mut walk = Walk::around(cage.extent(), 5);
            let mut watch = DepthWatch::new(Features::of(&cage), walk.eye, PIXELS, rule);
            let mut blocks = Blocks::new(cage.topology()).expect("quads");
            blocks.set_depths(watch.depths()).expect("one a vertex");
            let mut points = Positions::new(&blocks, cage.positions());
            for step in 0..60 {
                let changed = watch.step(walk.next(step));
                let changes = blocks
                    .change_depths(watch.depths(), &changed)
                    .expect("one a vertex");
                points.update(&blocks, &changes);
                let mut whole = Blocks::new(cage.topology()).expect("quads");
                whole.set_depths(watch.depths()).expect("one a vertex");
                let whole_points = Positions::new(&whole, cage.positions());
                assert!(
                    pieces(&blocks, &points) == pieces(&whole, &whole_points),
                    "{name}, step {step}"
                );
                assert_eq!(blocks.refined_point_count(), whole.refined_point_count());
            }
        }
    }

    fn pieces(blocks: &Blocks, points: &Positions<f64>) -> Vec<Piece<f64>> {
        let mut pieces = Vec::new();
        for part in 0..blocks.part_count() {
            points.visit_part(blocks, part, &mut |piece| pieces.push(piece.clone()));
        }
        pieces
    }

    #[test]
    fn an_eye_that_is_no_place_does_not_spoil_the_steps_after_it() {
        let Some(cage) = cage("polycube_a") else {
            return;
        };
        let features = Features::of(&cage);
        let mut watch = DepthWatch::new(features.clone(), [9.0; 3], PIXELS, DepthRule::DEFAULT);
        let mut wanted = watch.depths().to_vec();
        for eye in [[f64::NAN; 3], [f64::INFINITY; 3], [5.0; 3], [5.1; 3]] {
            watch.step(eye);
            wanted = features.depths(eye, PIXELS, DepthRule::DEFAULT, &wanted);
            assert_eq!(watch.depths(), wanted, "{eye:?}");
        }
    }
}
