//! The feature processing unit: a depth for every feature, from the error that would remain and from its size on the
//! screen.
//!
//! With K the viewport's height over 2 tan(fov / 2), in pixels, at distance `dist`:
//!
//! ```text
//! d_size = ⌈log₂(K L_v / (8 px · dist))⌉                   L_v   the longest edge at v
//! d_err  = ⌈ln(K δ_v / (0.5 px · dist)) / ln(1 / λ²)⌉      δ_v   from v to its limit
//! d_v    = clamp(min(d_size, d_err), 0, 6)                 λ     shrinks v's ring from level to level
//! ```
//!
//! The triangles around v come within half a pixel of the limit after d_err levels, as the distance to it shrinks by λ²
//! a level; more than d_size levels make triangles of less than eight pixels. A depth changes only when the view asks
//! for a quarter level more or less than it (hysteresis).
//!
//! Based on: Lin, Wang, Sun (2018), section 3. Their equation 4 takes log₂ of a ratio of areas that cannot be computed
//! as printed; [`DepthRule::AreaRatio`] is the nearest computable reading: half of log₂ of the area on the screen of the
//! faces at v, over the area one patch may take (a level quarters a patch's area).

use serde::Serialize;

use super::{FeatureKind, features};
use crate::{
    cage::{Cage, Topology},
    subdiv::subdominant_eigenvalue,
};

/// Greatest depth the rules give.
pub const MAX_RULE_DEPTH: u8 = 6;
/// Levels a wish must pass a depth by before the depth follows.
const HYSTERESIS: f64 = 0.25;
/// Levels by which [`Feature::hold`] is narrower than the rule: far more than its formulas round.
const MARGIN: f64 = 1e-9;

/// How depths are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum DepthRule {
    /// By the error that remains and the size of triangles (the module's formulas), both in pixels.
    Error {
        /// Distance to the limit that may remain.
        tolerance: f64,
        /// Size of the smallest triangle worth making.
        triangle: f64,
    },
    /// By the area of the faces around, in square pixels, over `area`.
    AreaRatio {
        /// Area on the screen one patch may take.
        area: f64,
    },
}

impl DepthRule {
    /// Half a pixel of error, triangles of eight pixels.
    pub const DEFAULT: Self = Self::Error {
        tolerance: 0.5,
        triangle: 8.0,
    };
}

/// What a depth depends on, of one feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature {
    /// The vertex.
    pub vertex: u32,
    /// Its place.
    pub position: [f64; 3],
    /// Longest edge at it.
    pub longest_edge: f64,
    /// From the vertex to its limit.
    pub distance_to_limit: f64,
    /// Area of the faces around it.
    pub area: f64,
    /// What its ring shrinks by from level to level.
    pub eigenvalue: f64,
    /// Levels until nothing semi-sharp is left; 0 when nothing is.
    pub sharp_levels: f64,
}

/// The features of a cage, ready to be given depths view by view.
#[derive(Clone, Debug, Default)]
pub struct Features {
    /// All features, by vertex.
    pub list: Vec<Feature>,
    vertex_count: usize,
}

impl Features {
    /// Finds and measures a cage's features.
    #[must_use]
    pub fn of(cage: &Cage) -> Self {
        let kinds = features(cage.topology());
        let list = (0..)
            .zip(&kinds)
            .filter(|(_, kind)| **kind != FeatureKind::Regular)
            .map(|(vertex, _)| measure(cage, vertex))
            .collect();
        Self {
            list,
            vertex_count: kinds.len(),
        }
    }

    /// One depth a vertex of the cage for a view from `eye`; 0 for vertices that are no features.
    ///
    /// `pixels_per_radian` is K; `previous`, the depths of the frame before, gives hysteresis where it has one a vertex.
    #[must_use]
    pub fn depths(
        &self,
        eye: [f64; 3],
        pixels_per_radian: f64,
        rule: DepthRule,
        previous: &[u8],
    ) -> Vec<u8> {
        let mut depths = vec![0; self.vertex_count];
        for feature in &self.list {
            let vertex = feature.vertex as usize;
            depths[vertex] = feature
                .look(eye, pixels_per_radian, rule, previous.get(vertex).copied())
                .0;
        }
        depths
    }

    /// One depth a vertex so that what remains everywhere is at most `tolerance`, in the cage's own length.
    #[must_use]
    pub fn equal_error_depths(&self, tolerance: f64) -> Vec<u8> {
        let mut depths = vec![0; self.vertex_count];
        for feature in &self.list {
            let wish = feature
                .error_levels(1.0, tolerance)
                .max(feature.sharp_levels);
            depths[feature.vertex as usize] = settle(wish, None);
        }
        depths
    }
}

impl Feature {
    /// The depth seen from `eye` after `previous`, and the distance to the eye.
    pub(super) fn look(
        &self,
        eye: [f64; 3],
        pixels_per_radian: f64,
        rule: DepthRule,
        previous: Option<u8>,
    ) -> (u8, f64) {
        let distance = length(subtract(self.position, eye)).max(1e-9);
        let wish = self.wish(pixels_per_radian / distance, rule);
        (settle(wish, previous), distance)
    }

    /// The distances between which a depth stays as it is: nearer than the first and farther than the second the rule
    /// may answer otherwise. Narrower by [`MARGIN`], so that roundings do not matter.
    pub(super) fn hold(&self, depth: u8, pixels_per_radian: f64, rule: DepthRule) -> [f64; 2] {
        let wish = f64::from(depth);
        let reach = |levels: f64| self.reach(levels, pixels_per_radian, rule);
        let near = if depth < MAX_RULE_DEPTH {
            reach(wish + HYSTERESIS - MARGIN)
        } else {
            0.0
        };
        let far = if depth > 0 {
            reach(wish - 1.0 - HYSTERESIS + MARGIN)
        } else {
            f64::INFINITY
        };
        [near, far]
    }

    /// The distance up to which a wish is at least `levels`: [`Feature::wish`] falls with distance, this inverts it.
    fn reach(&self, levels: f64, pixels_per_radian: f64, rule: DepthRule) -> f64 {
        match rule {
            DepthRule::Error {
                tolerance,
                triangle,
            } => {
                let size = self.longest_edge / triangle * (-levels).exp2();
                let shrink = self.eigenvalue.powf(2.0 * levels);
                let error = self.distance_to_limit / tolerance * shrink;
                let is_sharp = self.sharp_levels >= levels;
                pixels_per_radian * if is_sharp { size } else { size.min(error) }
            }
            DepthRule::AreaRatio { area } => {
                pixels_per_radian * (self.area / area).sqrt() * (-levels).exp2()
            }
        }
    }

    /// The depth a rule asks for, with its fraction, where one unit of length is `pixels` on the screen.
    fn wish(&self, pixels: f64, rule: DepthRule) -> f64 {
        match rule {
            DepthRule::Error {
                tolerance,
                triangle,
            } => {
                let size = (pixels * self.longest_edge / triangle).log2();
                size.min(self.error_levels(pixels, tolerance).max(self.sharp_levels))
            }
            DepthRule::AreaRatio { area } => 0.5 * (pixels * pixels * self.area / area).log2(),
        }
    }

    fn error_levels(&self, pixels: f64, tolerance: f64) -> f64 {
        (pixels * self.distance_to_limit / tolerance).ln() / -(2.0 * self.eigenvalue.ln())
    }
}

/// The whole number of levels for a wish; the previous one while the wish is within a quarter level of its range.
fn settle(wish: f64, previous: Option<u8>) -> u8 {
    if let Some(previous) = previous {
        let depth = f64::from(previous);
        if wish > depth - 1.0 - HYSTERESIS && wish < depth + HYSTERESIS {
            return previous.min(MAX_RULE_DEPTH);
        }
    }
    let most = f64::from(MAX_RULE_DEPTH);
    // NaN and −∞ (nothing remains) give 0.
    wish.ceil().clamp(0.0, most).max(0.0) as u8
}

fn measure(cage: &Cage, vertex: u32) -> Feature {
    let (topology, positions) = (cage.topology(), cage.positions());
    let position = positions[vertex as usize];
    let edges = topology.vertex_edges(vertex);
    let end = |edge: u32| positions[topology.edge_end(edge, vertex) as usize];
    let longest_edge = edges
        .iter()
        .map(|&edge| length(subtract(end(edge), position)))
        .fold(0.0, f64::max);
    let area = topology
        .vertex_faces(vertex)
        .map(|face| {
            let corners: Vec<_> = topology
                .face_vertices(face)
                .iter()
                .map(|&at| positions[at as usize])
                .collect();
            face_area(&corners)
        })
        .sum();
    let boundary = topology.is_boundary_vertex(vertex);
    Feature {
        vertex,
        position,
        longest_edge,
        distance_to_limit: distance_to_limit(cage, vertex),
        area,
        eigenvalue: if boundary {
            0.5
        } else {
            subdominant_eigenvalue(edges.len())
        },
        sharp_levels: sharp_levels(topology, vertex),
    }
}

/// δ_v = |4 Σe + Σf − 5 n v| / (n (n + 5)); along sharp edges |Σe − 2 v| / 6, at corners 0.
fn distance_to_limit(cage: &Cage, vertex: u32) -> f64 {
    let (topology, positions) = (cage.topology(), cage.positions());
    let position = positions[vertex as usize];
    let edges = topology.vertex_edges(vertex);
    let sharp: Vec<_> = edges
        .iter()
        .filter(|&&edge| topology.edge_sharpness(edge) == f64::INFINITY)
        .collect();
    let mut sum = [0.0; 3];
    let mut add = |at: u32, weight: f64| {
        for axis in 0..3 {
            sum[axis] += weight * (positions[at as usize][axis] - position[axis]);
        }
    };
    if topology.vertex_sharpness(vertex) == f64::INFINITY || sharp.len() > 2 {
        return 0.0;
    }
    if sharp.len() == 2 {
        sharp
            .iter()
            .for_each(|&&edge| add(topology.edge_end(edge, vertex), 1.0 / 6.0));
        return length(sum);
    }
    let n = edges.len() as f64;
    let unit = 1.0 / (n * (n + 5.0));
    edges
        .iter()
        .for_each(|&edge| add(topology.edge_end(edge, vertex), 4.0 * unit));
    for &corner in topology.vertex_corners(vertex) {
        let vertices = topology.face_vertices(topology.corner_face(corner));
        add(
            vertices[(topology.corner_place(corner) + 2) % vertices.len()],
            unit,
        );
    }
    length(sum)
}

/// Levels until the sharpest semi-sharp thing at a vertex has worn off.
fn sharp_levels(topology: &Topology, vertex: u32) -> f64 {
    let edges = topology
        .vertex_edges(vertex)
        .iter()
        .map(|&edge| topology.edge_sharpness(edge));
    edges
        .chain([topology.vertex_sharpness(vertex)])
        .filter(|sharpness| sharpness.is_finite())
        .fold(0.0, f64::max)
}

fn face_area(corners: &[[f64; 3]]) -> f64 {
    let fan = corners.windows(2).skip(1).map(|pair| {
        let [a, b] = [subtract(pair[0], corners[0]), subtract(pair[1], corners[0])];
        let cross = [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ];
        0.5 * length(cross)
    });
    fan.sum()
}

fn subtract(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn length(a: [f64; 3]) -> f64 {
    a.iter().map(|part| part * part).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fas::{Tables, testing::cage};

    #[test]
    fn patches_follow_the_papers_formula_for_any_depths() {
        for name in ["table1/table1_hippo", "table1/table1_koala"] {
            let Some(cage) = cage(name) else { return };
            let topology = cage.topology();
            let features = Features::of(&cage);
            let mut depths = vec![0_u8; topology.vertex_count() as usize];
            for (index, feature) in features.list.iter().enumerate() {
                depths[feature.vertex as usize] = [1, 3, 2, 5][index % 4];
            }
            let valence = |feature: &Feature| topology.valence(feature.vertex) as u32;
            let is_irregular = |face: u32| {
                topology
                    .face_vertices(face)
                    .iter()
                    .any(|&at| topology.valence(at) != 4)
            };
            let irregular = (0..topology.face_count())
                .filter(|&face| is_irregular(face))
                .count() as u32;
            let sum: u32 = features.list.iter().map(valence).sum();
            let around = features.list.iter().map(|feature| {
                valence(feature) * (3 * (u32::from(depths[feature.vertex as usize]) - 1) + 1)
            });
            let wanted =
                topology.face_count() - irregular + 4 * irregular - sum + around.sum::<u32>();
            let render = Tables::adaptive(topology, &depths).expect("quads").render;
            assert_eq!(
                (render.patches.len() + render.caps.len()) as u32,
                wanted,
                "{name}"
            );
        }
    }

    #[test]
    fn adaptive_patches_are_those_of_classic_where_depths_agree() {
        let Some(cage) = cage("polycube_a") else {
            return;
        };
        let depths = vec![3; cage.topology().vertex_count() as usize];
        assert_eq!(
            Tables::adaptive(cage.topology(), &depths),
            Tables::classic(cage.topology(), 3)
        );
    }

    #[test]
    fn depth_falls_with_distance_and_holds_within_a_quarter_level() {
        let Some(cage) = cage("table1/table1_hippo") else {
            return;
        };
        let features = Features::of(&cage);
        let at = |distance: f64, previous: &[u8]| {
            features.depths([distance, 0.0, 0.0], 1000.0, DepthRule::DEFAULT, previous)
        };
        let (near, far) = (at(12.0, &[]), at(400.0, &[]));
        assert!(near.iter().zip(&far).all(|(near, far)| near >= far) && near != far);
        let held = at(12.3, &near);
        let fresh = at(12.3, &[]);
        let changes = |depths: &[u8]| depths.iter().zip(&near).filter(|(a, b)| a != b).count();
        assert!(changes(&held) < changes(&fresh));
    }

    #[test]
    fn settling_has_a_quarter_level_of_hysteresis() {
        assert_eq!(settle(2.3, None), 3);
        assert_eq!(settle(3.2, Some(3)), 3);
        assert_eq!(settle(3.3, Some(3)), 4);
        assert_eq!(settle(1.8, Some(3)), 3);
        assert_eq!(settle(1.7, Some(3)), 2);
        assert_eq!(settle(f64::NEG_INFINITY, Some(3)), 0);
        assert_eq!(settle(40.0, None), MAX_RULE_DEPTH);
    }
}
