//! A laid cage made by hand, for tests: a rock arch, as the builder would lay it into the ground.

use super::CutPlace;
use crate::cage::{Cage, Crease, Faces, Tags};

/// Patches of the cut: rows, columns.
pub const ARCH_PATCHES: [u32; 2] = [8, 12];
/// Columns and row of the patches that the arch stands on.
const FEET: [u32; 2] = [3, 8];
const FOOT_ROW: u32 = 3;
/// Rings of the tube between them.
const RINGS: u32 = 7;

/// Vertices and faces under way.
struct Laid {
    positions: Vec<[f64; 3]>,
    faces: Faces,
    holes: Vec<u32>,
}

/// A lattice over the cut and its ghost ring, heights from `control` (row, column in lattice points), and an arch of
/// `height` units on two of its patches; one side of a foot is a crease.
///
/// # Panics
///
/// Where `control` gives what is no number.
#[must_use]
pub fn arch_cage(height: f64, control: impl Fn(i32, i32) -> f64) -> Cage {
    let [rows, columns] = ARCH_PATCHES;
    let mut laid = Laid {
        positions: Vec::new(),
        faces: Faces::default(),
        holes: Vec::new(),
    };
    for row in -1..=rows.cast_signed() + 1 {
        for column in -1..=columns.cast_signed() + 1 {
            let z = control(row, column);
            laid.positions
                .push([4.0 * f64::from(column), 4.0 * f64::from(row), z]);
        }
    }
    for row in 0..rows + 2 {
        for column in 0..columns + 2 {
            let foot = row == FOOT_ROW + 1 && FEET.iter().any(|&foot| column == foot + 1);
            if foot {
                continue;
            }
            let is_ghost = row == 0 || column == 0 || row == rows + 1 || column == columns + 1;
            if is_ghost {
                laid.holes.push(laid.faces.count());
            }
            laid.faces.push(&quad(row, column));
        }
    }
    tube(&mut laid, height);
    let creases = vec![Crease {
        vertices: {
            let [a, b, ..] = quad(FOOT_ROW + 1, FEET[0] + 1);
            [a, b]
        },
        sharpness: f64::INFINITY,
    }];
    let tags = Tags {
        creases,
        holes: laid.holes,
        ..Tags::default()
    };
    Cage::new(laid.positions, laid.faces, &tags).expect("a cage")
}

/// A lattice quad, counter-clockwise seen from above: south-west, south-east, north-east, north-west.
fn quad(row: u32, column: u32) -> [u32; 4] {
    let point = |row: u32, column: u32| row * (ARCH_PATCHES[1] + 3) + column;
    [
        point(row + 1, column),
        point(row + 1, column + 1),
        point(row, column + 1),
        point(row, column),
    ]
}

/// From one foot up, over and down to the other.
fn tube(laid: &mut Laid, height: f64) {
    let [from, to] = FEET.map(|column| quad(FOOT_ROW + 1, column + 1));
    // Half a turn brings the west side of one foot to the east side of the other.
    let to = [to[1], to[0], to[3], to[2]];
    let mut ring = from;
    for at in 1..=RINGS {
        let share = f64::from(at) / f64::from(RINGS + 1);
        let angle = std::f64::consts::PI * share;
        let next: [u32; 4] = std::array::from_fn(|corner| {
            let [a, b] = [from[corner], to[corner]].map(|at| laid.positions[at as usize]);
            let middle = 0.5 * (a[0] + b[0]);
            let radius = 0.5 * (b[0] - a[0]).abs();
            let z = a[2] + (b[2] - a[2]) * share + height * radius / 14.0 * angle.sin();
            laid.positions.push([
                middle - radius * angle.cos() * (b[0] - a[0]).signum(),
                a[1],
                z,
            ]);
            u32::try_from(laid.positions.len() - 1).expect("few")
        });
        stitch(laid, ring, next);
        ring = next;
    }
    stitch(laid, ring, to);
}

fn stitch(laid: &mut Laid, low: [u32; 4], high: [u32; 4]) {
    for side in 0..4 {
        let next = (side + 1) % 4;
        laid.faces
            .push(&[low[side], low[next], high[next], high[side]]);
    }
}

/// Where the arch's cut lies: across a tile border.
#[must_use]
pub fn arch_place(step: f64, unit: f64) -> CutPlace {
    let (row, column) = (5, 26);
    CutPlace {
        cut: [row, column, row + ARCH_PATCHES[0], column + ARCH_PATCHES[1]],
        corner: [f64::from(column) * 4.0 * step, -f64::from(row) * 4.0 * step],
        step: [step, -step],
        unit,
    }
}

/// Controls of the ground around the arch, in units, by lattice point of the cut.
#[must_use]
pub fn ground_control(row: i32, column: i32) -> f64 {
    f64::from(800 + (row * 37 + column * 53) % 23 + 2 * row)
}
