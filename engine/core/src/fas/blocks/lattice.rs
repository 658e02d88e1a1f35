//! Numbers of the points around a feature that stands alone: a closed form, the same at every level.
//!
//! From level 1 on nothing but regular vertices lies within reach of a feature, so what surrounds it is one grid a
//! sector. Sector `t` lies between spokes `t` (its x axis) and `t + 1` (its y axis); both are shared with the sectors
//! beside it. Numbers go inside out, so that the points a level gathers from (within 2 of the feature) come first in the
//! level above:
//!
//! ```text
//!   y 3   O  O  O  O        1            the feature
//!     2   I  I  I  O        2 a spoke    within 2
//!     1   I  I  I  O        4 a sector   within 2: 6 N + 1 so far
//!     0   v  I  I  O        1 a spoke    at 3
//!         0  1  2  3 x      5 a sector   at 3: 12 N + 1 in all
//! ```
//!
//! with N faces around. A feature on a boundary has a spoke more than sectors.

/// The grids around a feature with so many spokes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Lattice {
    /// Edges at the feature.
    pub(super) spokes: u32,
    /// False on a boundary.
    pub(super) is_closed: bool,
}

impl Lattice {
    /// Faces at the feature.
    pub(super) const fn sectors(self) -> u32 {
        if self.is_closed {
            self.spokes
        } else {
            self.spokes - 1
        }
    }

    /// Points within 2 of the feature.
    pub(super) const fn inner_points(self) -> u32 {
        1 + 2 * self.spokes + 4 * self.sectors()
    }

    /// All points of a level.
    pub(super) const fn points(self) -> u32 {
        self.inner_points() + self.spokes + 5 * self.sectors()
    }

    /// The point `distance` (0 to 3) along a spoke.
    pub(super) const fn spoke(self, spoke: u32, distance: u32) -> u32 {
        match distance {
            0 => 0,
            3 => self.inner_points() + spoke,
            _ => 2 * spoke + distance,
        }
    }

    /// The point at (x, y) of a sector, each up to 3; from -1 on, which reaches into the sectors beside it. Must not
    /// reach beyond a boundary.
    pub(super) fn at(self, sector: u32, x: i32, y: i32) -> u32 {
        if y < 0 {
            return self.at(self.before(sector), -y, x);
        }
        if x < 0 {
            return self.at(self.after(sector), y, -x);
        }
        let (x, y) = (x.unsigned_abs(), y.unsigned_abs());
        if y == 0 {
            return self.spoke(sector, x);
        }
        if x == 0 {
            return self.spoke(self.after(sector), y);
        }
        if x < 3 && y < 3 {
            return 1 + 2 * self.spokes + 4 * sector + (x - 1) + 2 * (y - 1);
        }
        // Along the outer rim: up its right side, then leftwards along its top.
        let along = if x == 3 { y - 1 } else { 5 - x };
        self.inner_points() + self.spokes + 5 * sector + along
    }

    /// The spoke, and sector, after one.
    pub(super) const fn after(self, index: u32) -> u32 {
        if self.is_closed && index + 1 == self.spokes {
            0
        } else {
            index + 1
        }
    }

    /// The spoke, and sector, before one.
    pub(super) const fn before(self, index: u32) -> u32 {
        if index == 0 {
            self.spokes - 1
        } else {
            index - 1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_has_a_number_of_its_own_and_inner_ones_come_first() {
        for (spokes, is_closed) in [
            (1, true),
            (3, true),
            (4, true),
            (12, true),
            (2, false),
            (5, false),
        ] {
            let lattice = Lattice { spokes, is_closed };
            let mut seen = vec![false; lattice.points() as usize];
            let mut number = |point: u32, is_inner: bool| {
                assert_eq!(point < lattice.inner_points(), is_inner);
                assert!(
                    !std::mem::replace(&mut seen[point as usize], true),
                    "{point} twice"
                );
            };
            number(0, true);
            for spoke in 0..spokes {
                (1..4).for_each(|distance| number(lattice.spoke(spoke, distance), distance < 3));
            }
            for sector in 0..lattice.sectors() {
                for (x, y) in (1..4).flat_map(|x| (1..4).map(move |y| (x, y))) {
                    number(lattice.at(sector, x, y), x < 3 && y < 3);
                }
            }
            assert!(seen.iter().all(|&seen| seen));
        }
    }

    #[test]
    fn a_level_around_a_whole_ring_has_twelve_n_and_one_points() {
        for spokes in 1..20 {
            let lattice = Lattice {
                spokes,
                is_closed: true,
            };
            assert_eq!(lattice.points(), 12 * spokes + 1);
            assert_eq!(lattice.inner_points(), 6 * spokes + 1);
        }
    }

    #[test]
    fn sectors_share_their_spokes() {
        let lattice = Lattice {
            spokes: 5,
            is_closed: true,
        };
        for sector in 0..5 {
            for distance in 0..4 {
                let next = lattice.at(lattice.after(sector), distance, 0);
                assert_eq!(lattice.at(sector, 0, distance), next);
                let previous = lattice.at(lattice.before(sector), 1, distance);
                assert_eq!(lattice.at(sector, distance, -1), previous);
            }
        }
    }
}
