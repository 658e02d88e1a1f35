//! The zipper: the ground between the last lattice quads and an authored cage's rim, as triangles and quads.
//!
//! ```text
//! ┌──┬──┬──┬──┐      1. a bridge makes the ring one polygon      3. flips make it Delaunay between its two loops
//! ├──┘ ╱▔╲ └──┤      2. ears are cut off until none is left      4. pairs of triangles that make good quads are joined
//! ├──┐ ╲▁╱ ┌──┤
//! └──┴──┴──┴──┘      No point is added, no side of either loop is crossed; nothing is turned over or without area.
//! ```
//!
//! Knows points in plan and nothing of what they stand for.
//!
//! Based on: G. H. Meisters, *Polygons have ears* (1975); C. L. Lawson, *Software for C¹ surface interpolation* (1977).

use std::collections::HashMap;

use super::plan::{Point, in_circle, touch, turn};

/// Points of both loops together; ears take a time that grows with their square.
pub(super) const ZIPPER_LIMIT: usize = 1 << 15;

/// Corners of a quad of the zipper are no sharper and no blunter than this: cos 30°.
const WORST_COSINE: f64 = 0.866;

/// Fills the ring between two counter-clockwise simple loops, the second inside the first. Points are numbered through:
/// first the outer's, then the inner's. Faces are counter-clockwise.
///
/// # Errors
/// Where no bridge or no ear is found, which for such loops cannot be: in words.
pub(super) fn zip(outer: &[Point], inner: &[Point]) -> Result<Vec<Vec<u32>>, String> {
    let points: Vec<Point> = outer.iter().chain(inner).copied().collect();
    if points.len() > ZIPPER_LIMIT {
        return Err(format!(
            "its rim and the ground around it have {} points; the limit is {ZIPPER_LIMIT}",
            points.len()
        ));
    }
    let around = bridged(outer, inner).ok_or("its rim cannot be seen from the ground around it")?;
    let mut mesh = Mesh::new(cut_ears(&points, around)?);
    mesh.flip(&points);
    Ok(mesh.joined(&points))
}

/// One polygon of both loops: once around the outer, over a bridge, once back around the inner, over the bridge.
fn bridged(outer: &[Point], inner: &[Point]) -> Option<Vec<u32>> {
    // Everything of the inner loop is west of its easternmost point, so whatever is east of that hides behind nothing
    // but the outer loop.
    let to = (0..inner.len()).max_by_key(|&i| (inner[i][0], i))?;
    let far = |&i: &usize| {
        let [dx, dy] = [0, 1].map(|axis| i128::from(outer[i][axis] - inner[to][axis]));
        (dx * dx + dy * dy, i)
    };
    let mut east: Vec<usize> = (0..outer.len())
        .filter(|&i| outer[i][0] > inner[to][0])
        .collect();
    east.sort_by_key(far);
    let from = east.into_iter().find(|&i| is_seen(outer, i, inner[to]))?;
    let at = |i: usize| u32::try_from(i).ok();
    let mut around = Vec::with_capacity(outer.len() + inner.len() + 2);
    for step in 0..=outer.len() {
        around.push(at((from + step) % outer.len())?);
    }
    for step in (0..=inner.len()).rev() {
        around.push(at(outer.len() + (to + step) % inner.len())?);
    }
    Some(around)
}

/// True when the way from a point to the outer loop's `i`-th meets no other side of it.
fn is_seen(outer: &[Point], i: usize, point: Point) -> bool {
    let count = outer.len();
    (0..count)
        .filter(|&side| side != i && (side + 1) % count != i)
        .all(|side| !touch([outer[i], point], [outer[side], outer[(side + 1) % count]]))
}

/// Cuts a polygon into triangles.
fn cut_ears(points: &[Point], mut around: Vec<u32>) -> Result<Vec<[u32; 3]>, String> {
    let mut triangles = Vec::with_capacity(around.len());
    let (mut at, mut misses) = (0, 0);
    while around.len() > 3 {
        let count = around.len();
        let ear = [(at + count - 1) % count, at, (at + 1) % count].map(|i| around[i]);
        if is_ear(points, &around, ear) {
            triangles.push(ear);
            around.remove(at);
            // On to the next but one, so that ears do not fan around one point.
            at = (at + 1) % around.len();
            misses = 0;
        } else {
            at = (at + 1) % count;
            misses += 1;
            if misses > count {
                return Err("the ground around its rim cannot be cut into triangles".into());
            }
        }
    }
    triangles.push([around[0], around[1], around[2]]);
    Ok(triangles)
}

/// True for three neighbours of a polygon that turn left and have no other point of it among them.
fn is_ear(points: &[Point], around: &[u32], ear: [u32; 3]) -> bool {
    let corners = ear.map(|index| points[index as usize]);
    let [a, b, c] = corners;
    turn(a, b, c) > 0
        && around.iter().all(|&index| {
            let p = points[index as usize];
            corners.contains(&p) || turn(a, b, p) < 0 || turn(b, c, p) < 0 || turn(c, a, p) < 0
        })
}

/// Triangles, and which of them lies left of every directed edge.
struct Mesh {
    triangles: Vec<[u32; 3]>,
    left: HashMap<[u32; 2], usize>,
}

impl Mesh {
    fn new(triangles: Vec<[u32; 3]>) -> Self {
        let mut mesh = Self {
            left: HashMap::with_capacity(3 * triangles.len()),
            triangles,
        };
        (0..mesh.triangles.len()).for_each(|index| mesh.link(index));
        mesh
    }

    fn link(&mut self, index: usize) {
        let [a, b, c] = self.triangles[index];
        for edge in [[a, b], [b, c], [c, a]] {
            self.left.insert(edge, index);
        }
    }

    /// The corners around an edge between two triangles, counter-clockwise: its start, the far corner on the right, its
    /// end, the far corner on the left.
    fn around(&self, [a, b]: [u32; 2]) -> Option<[u32; 4]> {
        let apex = |index: usize| {
            self.triangles[index]
                .into_iter()
                .find(|corner| *corner != a && *corner != b)
        };
        let left = apex(*self.left.get(&[a, b])?)?;
        let right = apex(*self.left.get(&[b, a])?)?;
        Some([a, right, b, left])
    }

    /// Flips edges until every circle through a triangle's corners is empty of what it can see.
    fn flip(&mut self, points: &[Point]) {
        let mut edges: Vec<[u32; 2]> = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .collect();
        while let Some([a, b]) = edges.pop() {
            let Some([_, right, _, left]) = self.around([a, b]) else {
                continue;
            };
            let place = |index: u32| points[index as usize];
            if !in_circle([a, b, left].map(place), place(right)) {
                continue;
            }
            let (Some(first), Some(second)) =
                (self.left.remove(&[a, b]), self.left.remove(&[b, a]))
            else {
                continue;
            };
            self.triangles[first] = [a, right, left];
            self.triangles[second] = [right, b, left];
            self.link(first);
            self.link(second);
            edges.extend([[a, right], [right, b], [b, left], [left, a]]);
        }
    }

    /// Joins pairs of triangles to quads, the best quads first.
    fn joined(&self, points: &[Point]) -> Vec<Vec<u32>> {
        let mut pairs: Vec<(f64, [u32; 2])> = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .filter(|[a, b]| a < b)
            .filter_map(|edge| {
                let corners = self.around(edge)?.map(|index| points[index as usize]);
                Some((worst_cosine(corners)?, edge))
            })
            .collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut taken = vec![false; self.triangles.len()];
        let mut faces = Vec::new();
        for (_, edge) in pairs {
            let both = [self.left[&edge], self.left[&[edge[1], edge[0]]]];
            if both.iter().any(|&index| taken[index]) {
                continue;
            }
            both.iter().for_each(|&index| taken[index] = true);
            faces.extend(self.around(edge).map(Vec::from));
        }
        let rest = self.triangles.iter().zip(&taken);
        faces.extend(rest.filter(|(_, taken)| !**taken).map(|(t, _)| t.to_vec()));
        faces
    }
}

/// How far a quad's corners are from right angles; none for a quad that is not convex or too pointed.
fn worst_cosine(corners: [Point; 4]) -> Option<f64> {
    let mut worst = 0.0_f64;
    for i in 0..4 {
        let [before, at, after] = [corners[(i + 3) % 4], corners[i], corners[(i + 1) % 4]];
        if turn(before, at, after) <= 0 {
            return None;
        }
        let way = |to: Point| [0, 1].map(|axis| (to[axis] - at[axis]) as f64);
        let ([ax, ay], [bx, by]) = (way(before), way(after));
        let cosine = (ax * bx + ay * by) / (ax.hypot(ay) * bx.hypot(by));
        worst = worst.max(cosine.abs());
    }
    (worst <= WORST_COSINE).then_some(worst)
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small numbers")]
mod tests {
    use super::super::plan::area;
    use super::*;

    fn square(side: i64, step: i64) -> Vec<Point> {
        let along = |count: i64| (0..count).map(move |i| i * step);
        let n = side / step;
        along(n)
            .map(|x| [x, 0])
            .chain(along(n).map(|y| [side, y]))
            .chain(along(n).map(|x| [side - x, side]))
            .chain(along(n).map(|y| [0, side - y]))
            .collect()
    }

    /// Checks that faces are counter-clockwise, fill the ring exactly, and keep both loops as their outline.
    fn check(outer: &[Point], inner: &[Point]) {
        let faces = zip(outer, inner).unwrap();
        let points: Vec<Point> = outer.iter().chain(inner).copied().collect();
        let mut sum = 0;
        let mut edges = HashMap::new();
        for face in &faces {
            let corners: Vec<Point> = face.iter().map(|&i| points[i as usize]).collect();
            let count = corners.len();
            for i in 0..count {
                assert!(
                    turn(
                        corners[i],
                        corners[(i + 1) % count],
                        corners[(i + 2) % count]
                    ) > 0
                );
                assert!(edges.insert([face[i], face[(i + 1) % count]], ()).is_none());
            }
            sum += area(&corners);
        }
        assert_eq!(sum, area(outer) - area(inner));
        let open = edges
            .keys()
            .filter(|&&[a, b]| !edges.contains_key(&[b, a]))
            .count();
        assert_eq!(open, outer.len() + inner.len());
    }

    #[test]
    fn a_ring_is_filled_without_a_gap_and_nothing_is_turned_over() {
        check(
            &square(8000, 1000),
            &[[3000, 3000], [5000, 3000], [5000, 5000], [3000, 5000]],
        );
        check(
            &square(8000, 4000),
            &square(100, 4).map_by(|[x, y]| [x + 4000, y + 1000]),
        );
    }

    #[test]
    fn a_rim_may_be_a_horseshoe_or_a_star() {
        let horseshoe = [
            [2000, 2000],
            [6000, 2000],
            [6000, 3000],
            [3000, 3000],
            [3000, 5000],
            [6000, 5000],
            [6000, 6000],
            [2000, 6000],
        ];
        check(&square(8000, 500), &horseshoe);
        let star: Vec<Point> = (0..40)
            .map(|i| {
                let angle = f64::from(i) * std::f64::consts::TAU / 40.0;
                let radius = if i % 2 == 0 { 3500.0 } else { 900.0 };
                [angle.cos(), angle.sin()].map(|x| 4000 + (radius * x).round() as i64)
            })
            .collect();
        check(&square(8000, 500), &star);
    }

    #[test]
    fn most_of_a_regular_ring_becomes_quads() {
        let inner = square(4000, 1000).map_by(|[x, y]| [x + 2000, y + 2000]);
        let faces = zip(&square(8000, 1000), &inner).unwrap();
        let quads = faces.iter().filter(|face| face.len() == 4).count();
        assert!(3 * quads > 2 * faces.len(), "{quads} of {}", faces.len());
    }

    trait MapBy {
        fn map_by(self, change: impl Fn(Point) -> Point) -> Vec<Point>;
    }

    impl MapBy for Vec<Point> {
        fn map_by(self, change: impl Fn(Point) -> Point) -> Vec<Point> {
            self.into_iter().map(change).collect()
        }
    }
}
