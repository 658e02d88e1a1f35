//! Blocks against the general tables, on the shared cages.

use std::collections::HashMap;

use super::{
    super::{
        Patch, Place,
        testing::{CAGES, TABLE1, cage},
    },
    *,
};
use crate::cage::{Cage, Topology};

/// Depths from `least` to `most` that look random.
fn scattered(count: usize, seed: u32, [least, most]: [u8; 2]) -> Vec<u8> {
    let hash =
        |index: u32| (index ^ seed.wrapping_mul(0x9E37_79B9)).wrapping_mul(0x85EB_CA6B) >> 13;
    let span = u32::from(most - least) + 1;
    (0..count as u32)
        .map(|index| least + (hash(index) % span) as u8)
        .collect()
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
    render
        .patches
        .iter()
        .map(patch)
        .chain(render.caps.iter().map(cap))
        .collect()
}

/// Asserts that two lists hold the same patches: kind, sides and controls.
fn assert_same(cage: &Cage, found: &[Piece<f64>], wanted: &[Piece<f64>], what: &str) {
    // Both round every point of every level once or twice; eight levels and the ends of sums make this many.
    let tolerance = 64.0 * f64::EPSILON * cage.extent().max(largest(cage));
    let by_place: HashMap<Place, &Piece<f64>> =
        found.iter().map(|piece| (piece.place, piece)).collect();
    assert_eq!(by_place.len(), found.len(), "{what}: no place twice");
    assert_eq!(found.len(), wanted.len(), "{what}: patches");
    for wanted in wanted {
        let found = by_place
            .get(&wanted.place)
            .unwrap_or_else(|| panic!("{what}: no {:?}", wanted.place));
        let tags = |piece: &Piece<f64>| (piece.is_cap, piece.finer, piece.sharp);
        assert_eq!(tags(found), tags(wanted), "{what}: {:?}", wanted.place);
        for (found, wanted_at) in found.controls.iter().zip(&wanted.controls) {
            let distance = (0..3)
                .map(|axis| (found[axis] - wanted_at[axis]).abs())
                .fold(0.0, f64::max);
            assert!(
                distance <= tolerance,
                "{what}: {:?} off by {distance}",
                wanted.place
            );
        }
    }
}

fn largest(cage: &Cage) -> f64 {
    cage.bounds()
        .iter()
        .flatten()
        .fold(0.0, |most, part| part.abs().max(most))
}

#[test]
fn patches_are_those_of_the_general_tables_at_one_depth() {
    for name in CAGES.into_iter().chain(TABLE1) {
        let Some(cage) = cage(name) else { return };
        for depth in 0..=6 {
            let depths = vec![depth; cage.topology().vertex_count() as usize];
            let (_, found) = laid(&cage, &depths);
            assert_same(
                &cage,
                &found,
                &table_pieces(&cage, &depths),
                &format!("{name}, depth {depth}"),
            );
        }
    }
}

#[test]
fn patches_are_those_of_the_general_tables_at_any_depths() {
    for name in CAGES.into_iter().chain(TABLE1) {
        let Some(cage) = cage(name) else { return };
        for seed in 0..4 {
            let depths = depths_of(cage.topology(), seed, [0, 5]);
            let (_, found) = laid(&cage, &depths);
            assert_same(
                &cage,
                &found,
                &table_pieces(&cage, &depths),
                &format!("{name}, seed {seed}"),
            );
        }
    }
}

#[test]
fn patches_follow_the_papers_formula() {
    for name in TABLE1 {
        let Some(cage) = cage(name) else { return };
        let topology = cage.topology();
        let depths = depths_of(topology, 7, [1, 6]);
        let (blocks, _) = laid(&cage, &depths);
        let valence = |vertex: u32| topology.valence(vertex) as u32;
        let is_irregular = |&face: &u32| {
            topology
                .face_vertices(face)
                .iter()
                .any(|&at| valence(at) != 4)
        };
        let irregular = (0..topology.face_count()).filter(is_irregular).count() as u32;
        let sum: u32 = blocks.features().map(valence).sum();
        let around: u32 = blocks
            .features()
            .map(|at| valence(at) * (3 * (u32::from(depths[at as usize]) - 1) + 1))
            .sum();
        let wanted = topology.face_count() - irregular + 4 * irregular - sum + around;
        assert_eq!(blocks.patch_count(), wanted, "{name}");
    }
}

#[test]
fn depths_changed_one_after_the_other_give_what_they_give_at_once() {
    for name in [
        "box_creases",
        "sheet_boundary",
        "polycube_a",
        "table1/table1_koala",
    ] {
        let Some(cage) = cage(name) else { return };
        let mut depths = depths_of(cage.topology(), 0, [0, 4]);
        let (mut blocks, _) = laid(&cage, &depths);
        let mut positions = Positions::new(&blocks, cage.positions());
        for seed in 1..24_usize {
            // Few vertices now and then, else a third of all; up, down, to 0 and from 0.
            let every = if seed % 2 == 0 { 3 } else { 61 };
            let fresh = depths_of(cage.topology(), seed as u32, [0, 4]);
            for index in (seed % every..depths.len()).step_by(every) {
                depths[index] = fresh[index];
            }
            let changes = blocks.set_depths(&depths).expect("one depth a vertex");
            positions.update(&blocks, &changes);
            let (whole, wanted) = laid(&cage, &depths);
            assert_eq!(pieces(&blocks, &positions), wanted, "{name}, step {seed}");
            assert_eq!(blocks.refined_point_count(), whole.refined_point_count());
            assert!(blocks.set_depths(&depths).expect("the same").is_empty());
        }
    }
}

#[test]
fn points_given_back_are_used_again() {
    let Some(cage) = cage("table1/table1_hippo") else {
        return;
    };
    let depths = [1, 2].map(|seed| depths_of(cage.topology(), seed, [0, 5]));
    let (mut blocks, _) = laid(&cage, &depths[0]);
    let mut most = 0;
    for step in 0..20 {
        blocks
            .set_depths(&depths[step % 2])
            .expect("one depth a vertex");
        if step == 3 {
            most = blocks.point_count();
        }
    }
    assert_eq!(blocks.point_count(), most);
    // Where most points are given back, the rest is laid anew without gaps.
    let none = vec![0; cage.positions().len()];
    blocks.set_depths(&none).expect("one depth a vertex");
    assert_eq!(
        blocks.point_count(),
        Blocks::new(cage.topology()).expect("quads").point_count()
    );
}

#[test]
fn the_same_bits_come_out_for_any_number_of_threads() {
    let Some(cage) = cage("table1/table1_crocodile") else {
        return;
    };
    let depths = depths_of(cage.topology(), 3, [0, 5]);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| laid(&cage, &depths).1)
    };
    assert!(on(1) == on(3));
}

#[test]
fn copies_of_a_point_beside_two_features_are_equal_to_the_bit() {
    let Some(cage) = cage("polycube_a") else {
        return;
    };
    let depths = depths_of(cage.topology(), 5, [2, 4]);
    let (_, pieces) = laid(&cage, &depths);
    // Corner points of level-2 patches, by where they lie on the cage's edges, seen from both of an edge's faces.
    let mut seen: HashMap<(u32, u16), [f64; 3]> = HashMap::new();
    let mut met_again = 0;
    for piece in pieces
        .iter()
        .filter(|piece| !piece.is_cap && piece.place.level == 2 && piece.sharp == 0)
    {
        let Place { face, u, v, .. } = piece.place;
        for (corner, [du, dv]) in [(5, [0, 0]), (6, [1, 0]), (10, [1, 1]), (9, [0, 1])] {
            let Some(at) = on_edge(cage.topology(), face, [u + du, v + dv]) else {
                continue;
            };
            let point = piece.controls[corner];
            met_again += usize::from(seen.contains_key(&at));
            assert_eq!(*seen.entry(at).or_insert(point), point, "{:?}", piece.place);
        }
    }
    assert!(met_again > 100, "{met_again}");
}

/// Edge of the cage and quarters along it from its first end, of a place in quarters of a face.
fn on_edge(topology: &Topology, face: u32, [u, v]: [u16; 2]) -> Option<(u32, u16)> {
    let (side, along) = match [u, v] {
        [_, 0] => (0, u),
        [4, _] => (1, v),
        [_, 4] => (2, 4 - u),
        [0, _] => (3, 4 - v),
        _ => return None,
    };
    let edge = topology.face_edges(face)[side];
    let is_forward = topology.edge_vertices(edge)[0] == topology.face_vertices(face)[side];
    (along != 0 && along != 4).then_some((edge, if is_forward { along } else { 4 - along }))
}

#[test]
fn caps_at_depth_zero_end_in_the_limit_also_beside_refined_faces() {
    let Some(cage) = cage("polycube_a") else {
        return;
    };
    let limit = crate::cage::LimitSurface::new(&cage).expect("quads");
    let depths = depths_of(cage.topology(), 11, [0, 1]);
    let (_, pieces) = laid(&cage, &depths);
    let mut mixed = 0;
    for piece in pieces.iter().filter(|piece| piece.is_cap) {
        let Place { face, u, v, level } = piece.place;
        let side = f64::from(level).exp2();
        mixed += usize::from(level == 1);
        for [du, dv] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
            let [u, v] = [u + du, v + dv].map(|at| f64::from(at) / side);
            let wanted = limit.evaluate(face, u, v).expect("on the face").position;
            let found = piece.evaluate([du, dv].map(f64::from)).position;
            for axis in 0..3 {
                assert!(
                    (found[axis] - wanted[axis]).abs() <= 1e-12 * cage.extent(),
                    "{:?}",
                    piece.place
                );
            }
        }
    }
    assert!(mixed > 100, "{mixed}");
}
