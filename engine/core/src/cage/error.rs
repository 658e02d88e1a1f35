//! What can be wrong with a cage.

use thiserror::Error;

/// Why a cage was refused. Faces and vertices are counted from 0.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CageError {
    /// There is nothing to subdivide.
    #[error("the cage has no faces")]
    Empty,
    /// A face of fewer than three corners.
    #[error("face {face} has {corners} corners; a face needs at least 3")]
    DegenerateFace {
        /// The face.
        face: u32,
        /// Its corners.
        corners: u32,
    },
    /// A face names a vertex that is not there.
    #[error("face {face} names vertex {vertex}, but there are only {vertex_count} vertices")]
    MissingVertex {
        /// The face.
        face: u32,
        /// What it names.
        vertex: u64,
        /// Vertices there are.
        vertex_count: u32,
    },
    /// A face meets one vertex twice.
    #[error("face {face} has vertex {vertex} at two of its corners")]
    RepeatedCorner {
        /// The face.
        face: u32,
        /// The vertex.
        vertex: u32,
    },
    /// Two faces with the same corners in the same order.
    #[error("face {face} repeats face {first}")]
    RepeatedFace {
        /// The later face.
        face: u32,
        /// The earlier one.
        first: u32,
    },
    /// An edge of more than two faces.
    #[error("the edge of vertices {} and {} has {face_count} faces, face {face} among them; two is the most", .vertices[0], .vertices[1])]
    NonManifoldEdge {
        /// Its ends.
        vertices: [u32; 2],
        /// Faces that meet there.
        face_count: u32,
        /// One of them.
        face: u32,
    },
    /// A vertex whose faces do not form one fan.
    #[error(
        "the faces around vertex {vertex}, face {face} among them, are not one fan; a vertex may join one fan only"
    )]
    NonManifoldVertex {
        /// The vertex.
        vertex: u32,
        /// A face of a second fan.
        face: u32,
    },
    /// Two neighbours are turned opposite ways.
    #[error("faces {} and {} both run from vertex {} to vertex {}; neighbours must be turned the same way", .faces[0], .faces[1], .vertices[0], .vertices[1])]
    Orientation {
        /// The two faces.
        faces: [u32; 2],
        /// The edge both walk in one direction.
        vertices: [u32; 2],
    },
    /// A coordinate is not a finite number.
    #[error(
        "vertex {vertex} is at {position:?}; coordinates must be finite and at most 1e150 in size"
    )]
    NotFinite {
        /// The vertex.
        vertex: u32,
        /// Its coordinates.
        position: [f64; 3],
    },
    /// A sharpness that means nothing.
    #[error(
        "sharpness {sharpness} of {what}; sharpness is a number from 0 to 10, 10 and more being infinite"
    )]
    Sharpness {
        /// What has it.
        what: String,
        /// Its value.
        sharpness: f64,
    },
    /// A crease on two vertices that share no edge.
    #[error("a crease is tagged from vertex {} to vertex {}, but no face has that edge", .vertices[0], .vertices[1])]
    MissingEdge {
        /// The two vertices.
        vertices: [u64; 2],
    },
    /// A tag on a vertex or face that is not there.
    #[error("a tag names {what} {index}, but there are only {count}")]
    MissingTagged {
        /// Vertex or face.
        what: &'static str,
        /// What it names.
        index: u64,
        /// How many there are.
        count: u32,
    },
    /// More than the caller allows.
    #[error("the cage has more than {limit} {what}, which is the budget")]
    Budget {
        /// What there is too much of.
        what: &'static str,
        /// The most that is allowed.
        limit: u64,
    },
    /// A line that is not what its first word promises.
    #[error("{message}: {text:?}")]
    Syntax {
        /// What is expected.
        message: &'static str,
        /// The offending word.
        text: String,
    },
    /// An error and the line it comes from, counted from 1.
    #[error("line {line}: {error}")]
    Line {
        /// The line.
        line: usize,
        /// The error.
        error: Box<CageError>,
    },
    /// An OBJ text that does not say where it stands.
    #[error(
        "the cage does not say where it stands: add the line \"# drumlin position X Y Z\" before its first vertex \
         (X and Y in the terrain's coordinates; Z in metres, or \"ground\")"
    )]
    NoPosition,
    /// A landform that cannot be made: what of it, and why.
    #[error("{0}")]
    Shape(String),
    /// A place on the surface that is not there.
    #[error("no place ({u}, {v}) on face {face}: {reason}")]
    Place {
        /// The face asked for.
        face: u32,
        /// The first parameter.
        u: f64,
        /// The second parameter.
        v: f64,
        /// Why not.
        reason: &'static str,
    },
}

impl CageError {
    /// This error with the line it comes from; an error that has one keeps it.
    #[must_use]
    pub fn at_line(self, line: usize) -> Self {
        match self {
            Self::Line { .. } => self,
            error => Self::Line {
                line,
                error: Box::new(error),
            },
        }
    }

    /// The face to blame, where there is one.
    #[must_use]
    pub(super) fn face(&self) -> Option<u32> {
        match *self {
            Self::DegenerateFace { face, .. }
            | Self::MissingVertex { face, .. }
            | Self::RepeatedCorner { face, .. }
            | Self::RepeatedFace { face, .. }
            | Self::NonManifoldEdge { face, .. }
            | Self::NonManifoldVertex { face, .. } => Some(face),
            Self::Orientation { faces, .. } => Some(faces[1]),
            _ => None,
        }
    }
}
