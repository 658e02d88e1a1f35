//! The same places on every patch: positions and derivatives, many places at once.
//!
//! Weights depend on the place and the kind of patch alone, so they are made once; a patch then costs sixteen
//! multiply-adds an axis and place, eight places side by side ([`LaneWeights`]). For drawing on the CPU; the terrain draws by the stage `refine`.

use super::{
    Piece,
    evaluate::{bernstein, bernstein_derivative},
};
use crate::subdiv::{LaneWeights, Real, basis, basis_derivative};

/// Weights in position, and in the derivatives by u and by v.
type Jet<T> = [LaneWeights<T>; 3];

/// Places that are evaluated on every patch.
#[derive(Clone, Debug)]
pub struct PatchPattern<T> {
    spline: Jet<T>,
    cap: Jet<T>,
}

impl<T: Real> PatchPattern<T> {
    /// Of places as (u, v) of a patch.
    #[must_use]
    pub fn new(places: &[[f64; 2]]) -> Self {
        Self {
            spline: jet(places, basis, basis_derivative),
            cap: jet(places, bernstein, bernstein_derivative),
        }
    }

    /// Places on each patch.
    #[must_use]
    pub fn place_count(&self) -> usize {
        self.spline[0].place_count()
    }

    /// Positions at all places of a patch.
    ///
    /// # Panics
    /// When `out` is not one a place.
    pub fn positions_into(&self, piece: &Piece<T>, out: &mut [[T; 3]]) {
        self.jet_of(piece)[0].sum_into(&piece.controls, out);
    }

    /// Positions and the patch's derivatives by its u and by its v at all places.
    ///
    /// # Panics
    /// When a list is not one a place.
    pub fn jets_into(&self, piece: &Piece<T>, out: [&mut [[T; 3]]; 3]) {
        for (weights, out) in self.jet_of(piece).iter().zip(out) {
            weights.sum_into(&piece.controls, out);
        }
    }

    fn jet_of(&self, piece: &Piece<T>) -> &Jet<T> {
        if piece.is_cap {
            &self.cap
        } else {
            &self.spline
        }
    }
}

type Basis = fn(f64) -> [f64; 4];

fn jet<T: Real>(places: &[[f64; 2]], value: Basis, slope: Basis) -> Jet<T> {
    let weights = |along_u: Basis, along_v: Basis| {
        LaneWeights::new(places.len(), 16, |place, control| {
            let [u, v] = places[place];
            along_u(u)[control % 4] * along_v(v)[control / 4]
        })
    };
    [
        weights(value, value),
        weights(slope, value),
        weights(value, slope),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fas::{Blocks, Positions, testing::cage};

    const PLACES: [[f64; 2]; 10] = [
        [0.0, 0.0],
        [1.0, 1.0],
        [0.3, 0.7],
        [0.5, 0.5],
        [0.9, 0.1],
        [0.0, 1.0],
        [0.25, 0.75],
        [0.2, 0.0],
        [0.6, 0.4],
        [1.0, 0.5],
    ];

    /// The greatest distance from `out` to what each patch gives at one place after the other, over the extent.
    fn greatest_distance<T: Real + Into<f64>>() -> Option<f64> {
        let cage = cage("polycube_a")?;
        let mut blocks = Blocks::new(cage.topology()).expect("quads");
        let depths = (0..cage.topology().vertex_count())
            .map(|vertex| (vertex % 4) as u8)
            .collect::<Vec<_>>();
        blocks.set_depths(&depths).expect("one a vertex");
        let exact = Positions::new(&blocks, cage.positions());
        let narrow: Vec<_> = cage.positions().iter().map(|at| at.map(T::of)).collect();
        let points = Positions::new(&blocks, &narrow);
        let pattern = PatchPattern::<T>::new(&PLACES);
        let (mut most, mut wanted) = (0.0_f64, Vec::new());
        for part in 0..blocks.part_count() {
            wanted.clear();
            exact.visit_part(&blocks, part, &mut |piece| {
                wanted.extend(PLACES.map(|uv| piece.evaluate(uv)));
            });
            let mut next = wanted.iter();
            points.visit_part(&blocks, part, &mut |piece| {
                let mut jets = [[[T::default(); 3]; PLACES.len()]; 3];
                let [at, du, dv] = &mut jets;
                pattern.jets_into(piece, [at, du, dv]);
                let mut again = [[T::default(); 3]; PLACES.len()];
                pattern.positions_into(piece, &mut again);
                assert!(
                    (0..PLACES.len()).all(|at| again[at].map(T::into) == jets[0][at].map(T::into))
                );
                for (place, wanted) in (0..PLACES.len()).zip(&mut next) {
                    let parts = [wanted.position, wanted.du, wanted.dv];
                    for (jet, wanted) in jets.iter().zip(parts) {
                        for axis in 0..3 {
                            most = most.max((jet[place][axis].into() - wanted[axis]).abs());
                        }
                    }
                }
            });
        }
        Some(most / cage.extent())
    }

    #[test]
    fn a_pattern_gives_what_single_places_give() {
        // Sums of sixteen products in another order: some roundings of numbers as large as the cage.
        let Some(double) = greatest_distance::<f64>() else {
            return;
        };
        assert!(double < 1e-14, "{double:e}");
        let single = greatest_distance::<f32>().expect("it was there");
        assert!(single < 1e-6, "{single:e}");
    }
}
