//! Control cages: free meshes of quads and n-gons with creases, corners and holes, their refinement and limit surface.
//!
//! On the route between authored files and `fas` (tables): checks what it is given once, so that nothing below has to.
//! Knows no table, no tile, no terrain and no file system; OBJ comes and goes as text.
//!
//! What is here: [`Cage`] and its [`Topology`], [`read_obj`] and [`write_obj`], [`refine`] (plain uniform subdivision,
//! the oracle of all tables), [`LimitSurface`] (the exact surface, at any place) and [`CageInfo`] (what a cage holds), [`Placement`]
//! (where it stands in the terrain), [`generate`] (cliffs, arches and roads).

mod build;
mod error;
mod faces;
pub mod generate;
mod info;
mod limit;
mod obj;
mod outline;
mod placement;
mod sharpness;
mod topology;
mod uniform;

pub use error::CageError;
pub use faces::{Corner, Crease, Faces, Tags};

pub use info::CageInfo;
pub use limit::{LimitPattern, LimitSample, LimitSurface, Place};
pub use obj::{CageBudget, read_obj, write_obj};
pub use outline::boundary_loops;
pub use placement::Placement;
pub use topology::{Cage, NONE, Topology};
pub use uniform::{refine, refine_times};

#[cfg(test)]
mod tests;
