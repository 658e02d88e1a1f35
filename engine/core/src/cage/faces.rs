//! What a cage is made from: faces, and tags on them.

#![expect(
    clippy::cast_possible_truncation,
    reason = "linking refuses lists of 2^32 - 1 corners or more before any offset is used"
)]

/// Faces of a mesh: for each its vertices, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faces {
    offsets: Vec<u32>,
    vertices: Vec<u32>,
}

impl Faces {
    /// Of sizes known beforehand: face `f` has `vertices[offsets[f]..offsets[f + 1]]`. `None` unless offsets start at
    /// 0, never fall, and end at the number of vertices.
    #[must_use]
    pub fn new(offsets: Vec<u32>, vertices: Vec<u32>) -> Option<Self> {
        let fits = offsets.first() == Some(&0)
            && offsets.is_sorted()
            && offsets.last().map(|&last| last as usize) == Some(vertices.len());
        fits.then_some(Self { offsets, vertices })
    }

    /// Quads only.
    #[must_use]
    pub fn quads(quads: &[[u32; 4]]) -> Self {
        quads.iter().collect()
    }

    /// Adds a face.
    pub fn push(&mut self, face: &[u32]) {
        if self.offsets.is_empty() {
            self.offsets.push(0);
        }
        self.vertices.extend_from_slice(face);
        self.offsets.push(self.vertices.len() as u32);
    }

    /// Number of faces.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.offsets.len().saturating_sub(1) as u32
    }

    /// Where a face's vertices are in [`Faces::list`].
    #[must_use]
    #[inline]
    pub fn corners(&self, face: u32) -> std::ops::Range<usize> {
        self.offsets[face as usize] as usize..self.offsets[face as usize + 1] as usize
    }

    /// A face's vertices.
    #[must_use]
    #[inline]
    pub fn vertices(&self, face: u32) -> &[u32] {
        &self.vertices[self.corners(face)]
    }

    /// All faces' vertices, one face after the other.
    #[must_use]
    pub fn list(&self) -> &[u32] {
        &self.vertices
    }

    /// Bytes of both lists.
    #[must_use]
    pub fn byte_count(&self) -> usize {
        4 * (self.offsets.len() + self.vertices.len())
    }

    /// All faces in order.
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        self.offsets
            .windows(2)
            .map(|ends| &self.vertices[ends[0] as usize..ends[1] as usize])
    }
}

impl<T: AsRef<[u32]>> FromIterator<T> for Faces {
    fn from_iter<I: IntoIterator<Item = T>>(faces: I) -> Self {
        let mut all = Self::default();
        for face in faces {
            all.push(face.as_ref());
        }
        all
    }
}

/// A sharp edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crease {
    /// Its ends.
    pub vertices: [u32; 2],
    /// 0 smooth, 10 and more infinite.
    pub sharpness: f64,
}

/// A sharp vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// The vertex.
    pub vertex: u32,
    /// 0 smooth, 10 and more infinite.
    pub sharpness: f64,
}

/// What is special about a cage. Of two tags on one thing the later holds; boundaries are infinitely sharp anyhow.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tags {
    /// Sharp edges.
    pub creases: Vec<Crease>,
    /// Sharp vertices.
    pub corners: Vec<Corner>,
    /// Faces that are subdivided but not part of the surface.
    pub holes: Vec<u32>,
}
