//! Blocks against the general tables, on the shared cages.

use std::collections::HashMap;

use super::{super::{Patch, Place, testing::cage}, *};
use crate::cage::{Cage, Topology};

const CAGES: [&str; 12] = [
    "box_creases",
    "discs_3_5_7_10",
    "sheet_boundary",
    "polycube_a",
    "terrain_a",
    "regression_car",
    "regression_helmet",
    "regression_gregory_test1",
    "table1/table1_crocodile",
    "table1/table1_gorilla",
    "table1/table1_hippo",
    "table1/table1_koala",
];

/// Depths from `least` to `most` that look random.
fn scattered(count: usize, seed: u32, [least, most]: [u8; 2]) -> Vec<u8> {
    let hash = |index: u32| (index ^ seed.wrapping_mul(0x9E37_79B9)).wrapping_mul(0x85EB_CA6B) >> 13;
    let span = u32::from(most - least) + 1;
    (0..count as u32).map(|index| least + (hash(index) % span) as u8).collect()
}

fn depths_of(topology: &Topology, seed: u32, range: [u8; 2]) -> Vec<u8> {
    scattered(topology.vertex_count() as usize, seed, range)
}

fn pieces(blocks: &Blocks, positions: &Positions<f64>) -> Vec<Piece<f64>> {
    let mut pieces = Vec::new();
    for part in 0..blocks.part_count() {
        positions.visit_part(blocks, part, &mut |piece| pieces.push(piece.clone()));
    }
    pieces
}

/// Blocks with depths, and all their pieces.
fn laid(cage: &Cage, depths: &[u8]) -> (Blocks, Vec<Piece<f64>>) {
    let mut blocks = Blocks::new(cage.topology()).expect("quads");
    blocks.set_depths(depths).expect("one depth a vertex");
    let positions = Positions::new(&blocks, cage.positions());
    let pieces = pieces(&blocks, &positions);
    (blocks, pieces)
}

/// The pieces of general tables.
fn table_pieces(cage: &Cage, depths: &[u8]) -> Vec<Piece<f64>> {
    let tables = Tables::adaptive(cage.topology(), depths).expect("quads");
    let points = tables.execute(cage.positions());
    let patch = |patch: &Patch| Piece {
        place: patch.place,
        finer: patch.finer,
        sharp: patch.sharp,
        is_cap: false,
        controls: patch.controls.map(|point| points[point as usize]),
    };
    let cap = |cap: &crate::fas::Cap| Piece {
        place: cap.place,
        finer: cap.finer,
        sharp: cap.sharp,
        is_cap: true,
        controls: cap.controls(&points),
    };
    let render = &tables.render;
    render.patches.iter().map(patch).chain(render.caps.iter().map(cap)).collect()
}

/// Asserts that two lists hold the same patches: kind, sides and controls.
fn assert_same(cage: &Cage, found: &[Piece<f64>], wanted: &[Piece<f64>], what: &str) {
    // Both round every point of every level once or twice; eight levels and the ends of sums make this many.
    let tolerance = 64.0 * f64::EPSILON * cage.extent().max(largest(cage));
    let by_place: HashMap<Place, &Piece<f64>> = found.iter().map(|piece| (piece.place, piece)).collect();
    assert_eq!(by_place.len(), found.len(), "{what}: no place twice");
    assert_eq!(found.len(), wanted.len(), "{what}: patches");
    for wanted in wanted {
        let found = by_place.get(&wanted.place).unwrap_or_else(|| panic!("{what}: no {:?}", wanted.place));
        let tags = |piece: &Piece<f64>| (piece.is_cap, piece.finer, piece.sharp);
        assert_eq!(tags(found), tags(wanted), "{what}: {:?}", wanted.place);
        for (found, wanted_at) in found.controls.iter().zip(&wanted.controls) {
            let distance = (0..3).map(|axis| (found[axis] - wanted_at[axis]).abs()).fold(0.0, f64::max);
            assert!(distance <= tolerance, "{what}: {:?} off by {distance}", wanted.place);
        }
    }
}

fn largest(cage: &Cage) -> f64 {
    cage.bounds().iter().flatten().fold(0.0, |most, part| part.abs().max(most))
}

#[test]
fn patches_are_those_of_the_general_tables_at_one_depth() {
    for name in CAGES {
        let Some(cage) = cage(name) else { return };
        for depth in 0..=6 {
            let depths = vec![depth; cage.topology().vertex_count() as usize];
            let (_, found) = laid(&cage, &depths);
            assert_same(&cage, &found, &table_pieces(&cage, &depths), &format!("{name}, depth {depth}"));
        }
    }
}

#[test]
fn patches_are_those_of_the_general_tables_at_any_depths() {
    for name in CAGES {
        let Some(cage) = cage(name) else { return };
        for seed in 0..4 {
            let depths = depths_of(cage.topology(), seed, [1, 5]);
            let (_, found) = laid(&cage, &depths);
            assert_same(&cage, &found, &table_pieces(&cage, &depths), &format!("{name}, seed {seed}"));
        }
    }
}
