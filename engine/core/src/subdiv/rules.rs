//! Face, edge and vertex points, and what becomes of sharpness.
//!
//! A face point is the mean of its face's corners. The other two masks weigh face points, so they hold for faces of
//! any number of corners:
//!
//! ```text
//!   edge point    end · (V0 + V1) + face · (F0 + F1)
//!   vertex point  vertex · V + edge · ΣE + face · ΣF + crease · (Ea + Eb)
//! ```
//!
//! with E the far ends of the vertex's edges, F the face points around it and a, b the two edges of its crease.

/// A sharpness of this or more is infinite.
pub const INFINITE_SHARPNESS: f64 = 10.0;

/// Sharpness as cages keep it: infinite from [`INFINITE_SHARPNESS`] on, so that it never wears off.
#[must_use]
pub fn stored_sharpness(sharpness: f64) -> f64 {
    if sharpness >= INFINITE_SHARPNESS {
        f64::INFINITY
    } else {
        sharpness
    }
}

/// Sharpness an edge or vertex passes on to its children: one less, not below zero.
#[must_use]
pub fn child_sharpness(sharpness: f64) -> f64 {
    (sharpness - 1.0).max(0.0)
}

/// Weights of an edge point: `end` of each of its two vertices, `face` of each of its two face points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeMask {
    /// Weight of each end.
    pub end: f64,
    /// Weight of each of the two face points; 0 on boundaries.
    pub face: f64,
}

/// The mask of an edge: the midpoint from sharpness 1 on, a blend with the smooth rule below.
#[must_use]
pub fn edge_mask(sharpness: f64) -> EdgeMask {
    let sharp = sharpness.min(1.0);
    EdgeMask {
        end: 0.25 + 0.25 * sharp,
        face: 0.25 - 0.25 * sharp,
    }
}

/// Which rule a vertex follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexRule {
    /// Moves to a mean of its whole ring.
    Smooth,
    /// Moves along the curve of its two sharp edges.
    Crease,
    /// Stays.
    Corner,
}

/// The rule of a vertex by its own sharpness and the number of its edges with any sharpness. A dart (one sharp edge)
/// is smooth.
#[must_use]
pub fn vertex_rule(sharpness: f64, sharp_edge_count: usize) -> VertexRule {
    match sharp_edge_count {
        _ if sharpness > 0.0 => VertexRule::Corner,
        0 | 1 => VertexRule::Smooth,
        2 => VertexRule::Crease,
        _ => VertexRule::Corner,
    }
}

/// Weights of a vertex point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexMask {
    /// Weight of the vertex itself.
    pub vertex: f64,
    /// Weight of the far end of each edge.
    pub edge: f64,
    /// Weight of each face point.
    pub face: f64,
    /// Weight added to the far ends of the two edges of `crease_edges`.
    pub crease: f64,
    /// Places of the crease's two edges in the ring; meaningless where `crease` is 0.
    pub crease_edges: [usize; 2],
}

impl VertexMask {
    /// The vertex stays.
    pub const CORNER: Self = Self {
        vertex: 1.0,
        edge: 0.0,
        face: 0.0,
        crease: 0.0,
        crease_edges: [0; 2],
    };

    /// The vertex follows the cubic B-spline curve of two edges.
    #[must_use]
    pub const fn crease(edges: [usize; 2]) -> Self {
        Self {
            vertex: 0.75,
            edge: 0.0,
            face: 0.0,
            crease: 0.125,
            crease_edges: edges,
        }
    }

    /// The vertex is smooth, `valence` edges and as many faces around it.
    #[must_use]
    pub fn smooth(valence: usize) -> Self {
        let n = valence as f64;
        let each = 1.0 / (n * n);
        Self {
            vertex: (n - 2.0) / n,
            edge: each,
            face: each,
            crease: 0.0,
            crease_edges: [0; 2],
        }
    }

    fn of_rule(rule: VertexRule, valence: usize, crease_edges: [usize; 2]) -> Self {
        match rule {
            VertexRule::Smooth => Self::smooth(valence),
            VertexRule::Crease => Self::crease(crease_edges),
            VertexRule::Corner => Self::CORNER,
        }
    }

    /// `weight` of `self` and the rest of `other`.
    fn blend(self, weight: f64, other: Self) -> Self {
        let mix = |a: f64, b: f64| weight * a + (1.0 - weight) * b;
        Self {
            vertex: mix(self.vertex, other.vertex),
            edge: mix(self.edge, other.edge),
            face: mix(self.face, other.face),
            crease: mix(self.crease, other.crease),
            crease_edges: if self.crease == 0.0 {
                other.crease_edges
            } else {
                self.crease_edges
            },
        }
    }
}

/// The mask of a vertex with `sharpness` of its own and edges of the given sharpnesses, in ring order.
///
/// Where the children's sharpness asks for another rule than the parent's, the two are blended by the mean of the
/// sharpnesses that wear off in this step (DeRose et al. 1998, section 3 and appendix B).
pub fn vertex_mask<I>(sharpness: f64, edges: I) -> VertexMask
where
    I: IntoIterator<Item = f64>,
{
    let (mut parent, mut child, mut fading) = (Sharp::default(), Sharp::default(), Mean::default());
    fading.add_if_fading(sharpness);
    let mut valence = 0;
    for edge in edges {
        parent.add(edge, valence);
        child.add(child_sharpness(edge), valence);
        fading.add_if_fading(edge);
        valence += 1;
    }
    let parent_rule = vertex_rule(sharpness, parent.count);
    let child_rule = vertex_rule(child_sharpness(sharpness), child.count);
    let mask = VertexMask::of_rule(parent_rule, valence, parent.edges);
    if parent_rule == child_rule {
        return mask;
    }
    mask.blend(
        fading.value().min(1.0),
        VertexMask::of_rule(child_rule, valence, child.edges),
    )
}

/// Sharp edges met so far: how many, and where the first two are.
#[derive(Default)]
struct Sharp {
    count: usize,
    edges: [usize; 2],
}

impl Sharp {
    fn add(&mut self, sharpness: f64, place: usize) {
        if sharpness > 0.0 {
            if let Some(edge) = self.edges.get_mut(self.count) {
                *edge = place;
            }
            self.count += 1;
        }
    }
}

/// Mean of the sharpnesses that are positive now and zero in the children.
#[derive(Default)]
struct Mean {
    sum: f64,
    count: f64,
}

impl Mean {
    fn add_if_fading(&mut self, sharpness: f64) {
        if sharpness > 0.0 && child_sharpness(sharpness) == 0.0 {
            self.sum += sharpness;
            self.count += 1.0;
        }
    }

    fn value(&self) -> f64 {
        if self.count == 0.0 {
            0.0
        } else {
            self.sum / self.count
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(mask: &VertexMask, valence: usize) -> f64 {
        mask.vertex + valence as f64 * (mask.edge + mask.face) + 2.0 * mask.crease
    }

    #[test]
    fn vertex_masks_sum_to_one_for_every_mix_of_sharpness() {
        let values = [0.0, 0.25, 0.75, 1.0, 1.5, 2.5, f64::INFINITY];
        for valence in 2..8 {
            for (i, &own) in values.iter().enumerate() {
                let edges = (0..valence).map(|k| values[(3 * k + i * valence) % values.len()]);
                assert!((sum(&vertex_mask(own, edges), valence) - 1.0).abs() < 1e-15);
            }
        }
        assert!((sum(&VertexMask::smooth(360), 360) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn edge_masks_sum_to_one() {
        for sharpness in [0.0, 0.3, 1.0, 4.0, f64::INFINITY] {
            let mask = edge_mask(sharpness);
            assert!((2.0 * (mask.end + mask.face) - 1.0).abs() < 1e-15);
        }
        assert_eq!(
            edge_mask(1.0),
            EdgeMask {
                end: 0.5,
                face: 0.0
            }
        );
    }

    #[test]
    fn a_smooth_vertex_among_quads_has_the_textbook_weights() {
        for valence in 2..12 {
            let (mask, n) = (VertexMask::smooth(valence), valence as f64);
            // A quad's face point is a quarter of the vertex, of its two neighbours and of the diagonal.
            let alpha = mask.vertex + 0.25 * n * mask.face;
            assert!((alpha - (1.0 - 7.0 / (4.0 * n))).abs() < 1e-15);
            assert!((mask.edge + 0.5 * mask.face - 1.5 / (n * n)).abs() < 1e-15);
        }
    }

    #[test]
    fn a_fading_crease_blends_towards_the_smooth_rule() {
        let mask = vertex_mask(0.0, [0.5, 0.0, 0.25, 0.0]);
        let (crease, smooth) = (VertexMask::crease([0, 2]), VertexMask::smooth(4));
        assert_eq!(mask, crease.blend(0.375, smooth));
        assert_eq!(vertex_mask(0.0, [1.5, 0.0, 1.5, 0.0]), crease);
        assert_eq!(vertex_mask(0.0, [f64::INFINITY, 0.0, 0.0, 0.0]), smooth);
    }

    #[test]
    fn a_fading_corner_becomes_the_crease_of_the_edges_that_stay() {
        let mask = vertex_mask(0.0, [0.5, 3.0, 0.0, 3.0]);
        assert_eq!(mask.crease_edges, [1, 3]);
        assert_eq!(
            mask,
            VertexMask::CORNER.blend(0.5, VertexMask::crease([1, 3]))
        );
    }

    #[test]
    fn infinite_sharpness_stays() {
        assert_eq!(child_sharpness(stored_sharpness(10.0)), f64::INFINITY);
        assert_eq!(child_sharpness(0.3), 0.0);
        assert_eq!(stored_sharpness(9.5), 9.5);
    }
}
