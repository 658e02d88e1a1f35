//! The subdivision table: how every point of a level is gathered from the level above.
//!
//! Points are numbered through all levels. A level's points come in the order face, edge, vertex points; edge and vertex
//! rows gather face points of their own level, so each kind is executed after the one before it:
//!
//! ```text
//! face row     a b c d              (a + b + c + d) / 4
//! edge row     a b F G              (a + b + F + G) / 4          sharp: a b a b, the midpoint
//! vertex row   v                    v                            corner
//!              v a b                3/4 v + 1/8 (a + b)          crease
//!              v E0 F0 … En Fn      (n - 2)/n v + Σ(E + F)/n²    smooth, n > 1
//! blend row    points, weights      replaces an edge or vertex point whose sharpness wears off
//! phantom row  a b                  2 a - b                      beyond a boundary or an infinitely sharp side
//! ```

use serde::Serialize;

/// Rows of one level of points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LevelRows {
    /// The level's first point.
    pub first_point: u32,
    /// Face points' corners.
    pub faces: Vec<[u32; 4]>,
    /// Edge points' ends and face points.
    pub edges: Vec<[u32; 4]>,
    /// Where each vertex row starts in `vertex_points`; one more at the end.
    pub vertex_offsets: Vec<u32>,
    /// Points of all vertex rows.
    pub vertex_points: Vec<u32>,
    /// Points that are gathered by explicit weights instead of their row.
    pub blends: Vec<BlendRow>,
    /// Phantom points, numbered after the level's vertex points.
    pub phantoms: Vec<[u32; 2]>,
}

/// A point gathered by explicit weights.
#[derive(Clone, Debug, PartialEq)]
pub struct BlendRow {
    /// Which point.
    pub point: u32,
    /// Points and their weights.
    pub weights: Vec<(u32, f64)>,
}

/// How many points of each kind a level has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PointCounts {
    /// Face points.
    pub face: u32,
    /// Edge points.
    pub edge: u32,
    /// Vertex points.
    pub vertex: u32,
}

impl PointCounts {
    /// All three.
    #[must_use]
    pub const fn total(self) -> u32 {
        self.face + self.edge + self.vertex
    }
}

impl LevelRows {
    /// Points of each kind; phantoms are not among them.
    #[must_use]
    pub fn counts(&self) -> PointCounts {
        PointCounts {
            face: self.faces.len() as u32,
            edge: self.edges.len() as u32,
            vertex: self.vertex_offsets.len().saturating_sub(1) as u32,
        }
    }

    /// The point after the level's last one, phantoms included.
    #[must_use]
    pub fn end_point(&self) -> u32 {
        self.first_point + self.counts().total() + self.phantoms.len() as u32
    }

    /// Bytes of the rows.
    #[must_use]
    pub fn byte_count(&self) -> usize {
        let blends: usize = self
            .blends
            .iter()
            .map(|row| size_of::<BlendRow>() + 16 * row.weights.len())
            .sum();
        16 * (self.faces.len() + self.edges.len())
            + 4 * (self.vertex_offsets.len() + self.vertex_points.len())
            + 8 * self.phantoms.len()
            + blends
    }

    /// Points of a vertex row.
    #[must_use]
    pub fn vertex_row(&self, index: usize) -> &[u32] {
        &self.vertex_points
            [self.vertex_offsets[index] as usize..self.vertex_offsets[index + 1] as usize]
    }
}
