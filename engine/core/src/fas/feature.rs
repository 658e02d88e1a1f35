//! Features: vertices around which the surface is not one bicubic patch a face.
//!
//! An extraordinary vertex, the end or bend of an infinitely sharp crease, and every vertex on what is semi-sharp. A
//! semi-sharp line is one feature: its vertices share the greatest depth among them.

use super::mesh::narrow;
use crate::cage::Topology;

/// True when the faces around a vertex are not regular patches, boundaries and infinitely sharp edges being patch
/// borders. `sharpness` is that of its edges in ring order; a closed ring has as many faces as edges, an open one one
/// less.
pub(super) fn is_feature(own: f32, sharpness: &[f32], closed: bool) -> bool {
    let semi = |sharpness: f32| sharpness > 0.0 && sharpness.is_finite();
    if semi(own) || sharpness.iter().any(|&edge| semi(edge)) {
        return true;
    }
    let edges = sharpness.len();
    let faces = if closed { edges } else { edges - 1 };
    let mut sharp = (0..edges).filter(|&edge| sharpness[edge] > 0.0);
    let (first, second) = (sharp.next(), sharp.next());
    let sharp_count = first.iter().len() + second.iter().len() + sharp.count();
    match (own > 0.0, sharp_count) {
        (false, 0) => edges != 4,
        (false, 1) => true,
        (false, 2) if closed => edges != 4 || second != first.map(|first| first + 2),
        (false, 2) => faces != 2,
        // A corner: every sector between sharp edges is one face.
        _ => sharp_count != if closed { faces } else { faces + 1 },
    }
}

/// What a vertex of a cage is to refinement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeatureKind {
    /// Regular patches all around.
    Regular,
    /// Semi-sharp: regular once its sharpness has worn off.
    SemiSharp,
    /// Extraordinary for ever: by valence, boundary, crease end or bend.
    Extraordinary,
}

/// What each vertex of a cage is; vertices of no face are regular.
#[must_use]
pub fn features(topology: &Topology) -> Vec<FeatureKind> {
    let mut sharpness = Vec::new();
    (0..topology.vertex_count())
        .map(|vertex| {
            sharpness.clear();
            let edges = topology.vertex_edges(vertex);
            sharpness.extend(
                edges
                    .iter()
                    .map(|&edge| narrow(topology.edge_sharpness(edge))),
            );
            let own = narrow(topology.vertex_sharpness(vertex));
            let closed = !topology.is_boundary_vertex(vertex);
            if edges.is_empty() || !is_feature(own, &sharpness, closed) {
                return FeatureKind::Regular;
            }
            sharpness
                .iter_mut()
                .for_each(|sharpness| *sharpness = infinite_part(*sharpness));
            if is_feature(infinite_part(own), &sharpness, closed) {
                FeatureKind::Extraordinary
            } else {
                FeatureKind::SemiSharp
            }
        })
        .collect()
}

/// A sharpness once all that wears off has worn off.
fn infinite_part(sharpness: f32) -> f32 {
    if sharpness.is_finite() {
        0.0
    } else {
        sharpness
    }
}

/// The semi-sharp lines of a cage, one list of vertices each: all that semi-sharp edges join, and vertices that are
/// semi-sharp alone.
#[derive(Clone, Debug, Default)]
pub(super) struct SemiSharpLines {
    lines: Vec<Vec<u32>>,
}

impl SemiSharpLines {
    /// Finds them.
    pub(super) fn of(topology: &Topology) -> Self {
        let semi = |sharpness: f64| sharpness > 0.0 && sharpness.is_finite();
        let is_semi_edge = |edge: u32| semi(topology.edge_sharpness(edge));
        let mut seen = vec![false; topology.vertex_count() as usize];
        let mut lines = Vec::new();
        for vertex in 0..topology.vertex_count() {
            let mut edges = topology.vertex_edges(vertex).iter();
            let is_on_one =
                semi(topology.vertex_sharpness(vertex)) || edges.any(|&edge| is_semi_edge(edge));
            if !is_on_one || seen[vertex as usize] {
                continue;
            }
            seen[vertex as usize] = true;
            let (mut line, mut next) = (vec![vertex], 0);
            while let Some(&at) = line.get(next) {
                next += 1;
                for &edge in topology
                    .vertex_edges(at)
                    .iter()
                    .filter(|&&edge| is_semi_edge(edge))
                {
                    let end = topology.edge_end(edge, at);
                    if !std::mem::replace(&mut seen[end as usize], true) {
                        line.push(end);
                    }
                }
            }
            lines.push(line);
        }
        Self { lines }
    }

    /// True where there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// All vertices of all lines.
    pub(super) fn vertices(&self) -> impl Iterator<Item = u32> + '_ {
        self.lines.iter().flatten().copied()
    }

    /// All vertices of all lines, each with the greatest depth on its line.
    pub(super) fn depths<'a>(&'a self, depths: &'a [u8]) -> impl Iterator<Item = (u32, u8)> + 'a {
        self.lines.iter().flat_map(|line| {
            let depth = line.iter().map(|&vertex| depths[vertex as usize]).max();
            line.iter().map(move |&vertex| (vertex, depth.unwrap_or(0)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHARP: f32 = f32::INFINITY;

    #[test]
    fn a_vertex_is_a_feature_unless_its_patches_are_regular() {
        assert!(!is_feature(0.0, &[0.0; 4], true));
        assert!(is_feature(0.0, &[0.0; 3], true) && is_feature(0.0, &[0.0; 5], true));
        assert!(
            !is_feature(0.0, &[SHARP, 0.0, SHARP], false),
            "a boundary with two faces"
        );
        assert!(
            is_feature(0.0, &[SHARP, 0.0, 0.0, SHARP], false),
            "a boundary with three faces"
        );
        assert!(
            !is_feature(SHARP, &[SHARP, SHARP], false),
            "a corner of one face"
        );
        assert!(
            !is_feature(0.0, &[SHARP, 0.0, SHARP, 0.0], true),
            "a straight crease"
        );
        assert!(
            is_feature(0.0, &[SHARP, SHARP, 0.0, 0.0], true),
            "a bent crease"
        );
        assert!(is_feature(0.0, &[SHARP, 0.0, 0.0, 0.0], true), "a dart");
        assert!(
            !is_feature(0.0, &[SHARP; 3], true),
            "the corner of a sharp cube"
        );
        assert!(
            is_feature(0.0, &[0.5, 0.0, 0.5, 0.0], true),
            "a semi-sharp crease"
        );
    }
}
