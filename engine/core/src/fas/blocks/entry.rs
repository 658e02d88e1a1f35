//! One patch of the tables: which points it is made of, and with positions, its sixteen controls.

use super::super::{
    Cap, Patch, Place, Sample,
    evaluate::{bernstein, bernstein_derivative, tensor},
    execute::Real,
};
use super::turn::Turn;
use crate::{
    cage::NONE,
    subdiv::{basis, basis_derivative},
};

/// A patch as the points it is made of.
#[derive(Clone, Debug)]
pub enum Entry<'a> {
    /// A bicubic B-spline patch. Unlike those of [`Tables`](super::super::Tables) its controls beyond sharp sides are
    /// [`NONE`]: twice the point on the side less the one within, columns first, then rows.
    Patch(Patch),
    /// A cap around a feature that is not refined further.
    Cap(CapEntry<'a>),
}

/// A cap, with points as its feature numbers them.
#[derive(Clone, Debug)]
pub struct CapEntry<'a> {
    pub(super) place: Place,
    pub(super) finer: u8,
    /// In the axes of its sector.
    pub(super) cap: &'a Cap,
    pub(super) turn: Turn,
    pub(super) points: Numbers<'a>,
}

/// From a cap's own numbers of points to those of the table.
#[derive(Clone, Copy, Debug)]
pub(super) enum Numbers<'a> {
    From(u32),
    Listed(&'a [u32]),
}

/// A patch with its controls: all that evaluating and drawing it needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece<T> {
    /// Its place on the cage.
    pub place: Place,
    /// Sides that face finer patches, bit `s` for side `s`.
    pub finer: u8,
    /// Sides on a boundary or an infinitely sharp edge.
    pub sharp: u8,
    /// True for a cap, whose controls are those of a Bézier patch; those of others are of a B-spline patch.
    pub is_cap: bool,
    /// The controls, row by row.
    pub controls: [[T; 3]; 16],
}

impl Entry<'_> {
    /// Its place on the cage.
    #[must_use]
    pub fn place(&self) -> Place {
        match self {
            Self::Patch(patch) => patch.place,
            Self::Cap(cap) => cap.place,
        }
    }

    /// Sides that face finer patches, bit `s` for side `s`.
    #[must_use]
    pub fn finer(&self) -> u8 {
        match self {
            Self::Patch(patch) => patch.finer,
            Self::Cap(cap) => cap.finer,
        }
    }

    /// Sides on a boundary or an infinitely sharp edge.
    #[must_use]
    pub fn sharp(&self) -> u8 {
        match self {
            Self::Patch(patch) => patch.sharp,
            Self::Cap(cap) => cap.turn.sides(cap.cap.sharp),
        }
    }

    /// The patch with its controls.
    pub(super) fn piece<T: Real>(&self, points: &[[T; 3]]) -> Piece<T> {
        Piece {
            place: self.place(),
            finer: self.finer(),
            sharp: self.sharp(),
            is_cap: matches!(self, Self::Cap(_)),
            controls: match self {
                Self::Patch(patch) => gather(patch, points),
                Self::Cap(cap) => cap.controls(points),
            },
        }
    }
}

impl CapEntry<'_> {
    /// Its sixteen Bézier controls in the axes of the cage's face, rows of v.
    #[must_use]
    pub fn controls<T: Real>(&self, points: &[[T; 3]]) -> [[T; 3]; 16] {
        let controls = match self.points {
            Numbers::From(first) => self.cap.controls(&points[first as usize..]),
            Numbers::Listed(list) => self
                .cap
                .controls_of(&|point| points[list[point as usize] as usize]),
        };
        self.turn.grid(controls)
    }
}

impl<T: Real> Piece<T> {
    /// The surface at (u, v) of the patch.
    #[must_use]
    pub fn evaluate(&self, uv: [f64; 2]) -> Sample<T> {
        if self.is_cap {
            tensor(
                &self.controls,
                uv.map(bernstein),
                uv.map(bernstein_derivative),
            )
        } else {
            tensor(&self.controls, uv.map(basis), uv.map(basis_derivative))
        }
    }
}

/// A patch's controls, those beyond sharp sides made of those within.
fn gather<T: Real>(patch: &Patch, points: &[[T; 3]]) -> [[T; 3]; 16] {
    let mut grid = patch.controls.map(|point| {
        if point == NONE {
            [T::default(); 3]
        } else {
            points[point as usize]
        }
    });
    let mut fill = |side: u8, border: usize, inward: isize, along: usize| {
        if patch.sharp >> side & 1 == 0 {
            return;
        }
        for step in 0..4 {
            let beyond = border + step * along;
            let [on, within] = [1, 2].map(|depth| grid[beyond.wrapping_add_signed(depth * inward)]);
            grid[beyond] = [0, 1, 2].map(|axis| on[axis] + on[axis] - within[axis]);
        }
    };
    fill(3, 0, 1, 4);
    fill(1, 3, -1, 4);
    fill(0, 0, 4, 1);
    fill(2, 12, -4, 1);
    grid
}
