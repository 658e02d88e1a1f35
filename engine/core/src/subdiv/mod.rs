//! The rules of Catmull-Clark subdivision: masks that know no mesh.
//!
//! The bottom of the route. Callers hand over counts and sharpnesses and get weights; how points are found and stored
//! is theirs to know. The surface is the one of edge-and-corner boundaries and uniform semi-sharp creases.
//!
//! Based on: E. Catmull, J. Clark, *Recursively generated B-spline surfaces on arbitrary topological meshes* (1978);
//! T. DeRose, M. Kass, T. Truong, *Subdivision surfaces in character animation* (1998).

mod bspline;
mod lanes;
mod lattice;
mod limit;
mod real;
mod rules;

pub use bspline::{basis, basis_derivative};
pub use lanes::LaneWeights;
pub use lattice::{subdivide_lattice, subdivide_line};
pub use limit::{
    CREASE_LIMIT, CreaseTangent, SmoothLimit, crease_tangent, smooth_limit, smooth_tangent,
    subdominant_eigenvalue,
};
pub use real::Real;
pub use rules::{
    EdgeMask, INFINITE_SHARPNESS, VertexMask, VertexRule, child_sharpness, edge_mask,
    stored_sharpness, vertex_mask, vertex_rule,
};
