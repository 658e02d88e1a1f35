//! Features laid into a ground from a formula.

#![expect(
    clippy::cast_possible_truncation,
    reason = "places and counts of small cuts"
)]

use super::testing::{VOID, Waves, at, sheet, with_site};
use super::*;
use crate::cage::generate::{Arch, Cliff, Path, arch, cliff, flat};
use crate::cage::{Corner, Crease, Faces, Tags, boundary_loops};

fn laid(input: &FeatureInput) -> Result<LaidFeature, PyramidError> {
    with_site(|site| lay(input, site))
}

fn refused(input: &FeatureInput) -> String {
    laid(input).unwrap_err().to_string()
}

/// Twice the area of a face in plan, counter-clockwise seen from above positive.
fn plan_area(cage: &Cage, face: u32) -> f64 {
    let corners = cage.topology().face_vertices(face);
    let place = |i: usize| cage.positions()[corners[i % corners.len()] as usize];
    (0..corners.len())
        .map(|i| (place(i), place(i + 1)))
        .map(|(a, b)| -(a[0] * b[1] - a[1] * b[0]))
        .sum()
}

/// Lattice point of a vertex, where it is on one.
fn lattice_point(cage: &Cage, vertex: u32) -> Option<[i64; 2]> {
    let [x, y, _] = cage.positions()[vertex as usize];
    let on = x.rem_euclid(4.0) == 0.0 && y.rem_euclid(4.0) == 0.0;
    on.then_some([(y / 4.0) as i64, (x / 4.0) as i64])
}

/// Checks what is true of every laid feature: `authored` vertices are the last.
fn check(feature: &LaidFeature, authored: u32) {
    let (cage, cut) = (&feature.cage, feature.cut);
    let topology = cage.topology();
    let size = [0, 1].map(|axis| i64::from(cut[axis + 2] - cut[axis]));
    let loops = boundary_loops(topology);
    assert_eq!(loops.len(), 1, "only the ghost ring is open");
    let ghost = |[row, column]: [i64; 2]| {
        row == -1 || column == -1 || row == size[0] + 1 || column == size[1] + 1
    };
    assert_eq!(loops[0].len() as i64, 2 * (size[0] + size[1] + 4));
    assert!(
        loops[0]
            .iter()
            .all(|&v| ghost(lattice_point(cage, v).unwrap()))
    );
    assert!(cut.iter().all(|edge| edge % 32 != 0), "{cut:?}");
    let first = topology.vertex_count() - authored;
    for vertex in 0..first {
        let [row, column] = lattice_point(cage, vertex).unwrap();
        let z = Waves.control(i64::from(cut[0]) + row, i64::from(cut[1]) + column);
        assert_eq!(cage.positions()[vertex as usize][2], f64::from(z));
    }
    // Both rings are lattice quads, and every patch of them is there once.
    let mut rings = std::collections::BTreeSet::new();
    for face in 0..topology.face_count() {
        let corners = topology.face_vertices(face);
        if corners.iter().any(|&corner| corner >= first) {
            continue;
        }
        assert!(plan_area(cage, face) > 0.0, "face {face} is turned over");
        // The patch a face's middle is in.
        let [row, column] = [1, 0].map(|axis| {
            let along = corners
                .iter()
                .map(|&corner| cage.positions()[corner as usize][axis]);
            (along.sum::<f64>() / corners.len() as f64 / 4.0).floor() as i64
        });
        let inside = (0..size[0]).contains(&row) && (0..size[1]).contains(&column);
        assert_eq!(topology.is_hole(face), !inside);
        let depth = row
            .min(column)
            .min(size[0] - 1 - row)
            .min(size[1] - 1 - column);
        if inside && depth < 2 {
            assert_eq!((corners.len(), plan_area(cage, face)), (4, 32.0));
            rings.insert([row, column]);
        }
    }
    let inner = (size[0] - 4) * (size[1] - 4);
    assert_eq!(rings.len() as i64, size[0] * size[1] - inner);
}

#[test]
fn a_sheet_lies_in_a_cut_with_two_rings_of_the_lattice() {
    let input = at(sheet(100.0, 5), 70.0, 75.0);
    let feature = laid(&input).unwrap();
    check(&feature, 36);
    // 5 samples each way of row 70, column 75: patches 16 to 18 and, its east rim being on a line, 17 to 20; and three
    // around.
    assert_eq!(feature.cut, [13, 14, 22, 24]);
    assert!(
        feature.error >= 29.0 && feature.error < 60.0,
        "{}",
        feature.error
    );
    // Everything in plan is face up, for this sheet is; together they fill the cut and its ghost ring.
    let faces = 0..feature.cage.topology().face_count();
    let areas: Vec<f64> = faces.map(|face| plan_area(&feature.cage, face)).collect();
    assert!(areas.iter().all(|&area| area > 0.0));
    assert_eq!(areas.iter().sum::<f64>(), 2.0 * 44.0 * 48.0);
}

#[test]
fn the_rim_is_on_the_ground_and_the_rest_where_it_was_drawn() {
    let mut input = at(sheet(100.0, 5), 70.0, 75.0);
    input.placement.height = Some(500.0);
    let feature = laid(&input).unwrap();
    let first = feature.cage.topology().vertex_count() - 36;
    let rim = boundary_loops(input.cage.topology()).remove(0);
    with_site(|site| {
        for vertex in 0..36_u32 {
            let [x, y, z] = feature.cage.positions()[(first + vertex) as usize];
            let ground = site.height(4.0 * 13.0 + y, 4.0 * 14.0 + x);
            let want = if rim.contains(&vertex) {
                ground
            } else {
                2.0 * 530.0
            };
            assert!((z - want).abs() < 1e-6, "vertex {vertex}: {z}, {want}");
        }
    });
}

#[test]
fn a_cut_never_ends_on_a_tile_border_and_may_span_tiles() {
    for (row, column) in [
        (128.0, 128.0),
        (100.0, 256.0),
        (112.0, 116.0),
        (144.0, 140.0),
    ] {
        let feature = laid(&at(sheet(120.0, 3), row, column)).unwrap();
        check(&feature, 16);
        assert!(!tiles_of(2, feature.cut).is_empty());
    }
    let feature = laid(&at(sheet(120.0, 3), 128.0, 128.0)).unwrap();
    let tiles = tiles_of(2, feature.cut);
    assert_eq!(
        tiles,
        [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[r, c]| TileId::new(2, r, c))
    );
}

#[test]
fn tags_are_kept() {
    let plain = sheet(100.0, 5);
    let tags = Tags {
        creases: vec![Crease {
            vertices: [14, 15],
            sharpness: 2.5,
        }],
        corners: vec![Corner {
            vertex: 21,
            sharpness: 10.0,
        }],
        holes: vec![12],
    };
    let cage = Cage::new(
        plain.positions().to_vec(),
        plain.topology().faces().clone(),
        &tags,
    )
    .unwrap();
    let laid = laid(&at(cage, 70.0, 75.0)).unwrap();
    let topology = laid.cage.topology();
    let [vertices, faces] = [topology.vertex_count() - 36, topology.face_count() - 25];
    let edge = topology.edge_between(vertices + 14, vertices + 15).unwrap();
    assert_eq!(topology.edge_sharpness(edge), 2.5);
    assert_eq!(topology.vertex_sharpness(vertices + 21), f64::INFINITY);
    assert!(topology.is_hole(faces + 12) && !topology.is_hole(faces + 11));
}

#[test]
fn overhangs_and_arches_are_laid_as_they_are() {
    let path = Path::new(vec![[-150.0, -40.0], [150.0, 60.0]]).unwrap();
    let lengths = Cliff {
        height: 60.0,
        overhang: 20.0,
        width: 90.0,
    };
    let leaning = cliff(&path, &lengths, &flat).unwrap();
    let count = leaning.topology().vertex_count();
    let feature = laid(&at(leaning, 130.0, 200.0)).unwrap();
    check(&feature, count);
    let faces = 0..feature.cage.topology().face_count();
    assert!(
        faces
            .into_iter()
            .any(|face| plan_area(&feature.cage, face) < -1.0)
    );
    let stones = arch(
        &path,
        &Arch {
            height: 120.0,
            width: 40.0,
        },
        &flat,
    )
    .unwrap();
    let count = stones.topology().vertex_count();
    check(&laid(&at(stones, 200.0, 300.0)).unwrap(), count);
}

#[test]
fn a_slanted_strip_leaves_the_lattice_where_it_is_far() {
    let path = Path::new(vec![[-600.0, -600.0], [600.0, 600.0]]).unwrap();
    let lengths = Cliff {
        height: 60.0,
        overhang: 10.0,
        width: 60.0,
    };
    let feature = laid(&at(cliff(&path, &lengths, &flat).unwrap(), 200.0, 300.0)).unwrap();
    let faces = feature.cage.topology().face_count();
    assert!(faces > 1000, "{faces}");
}

#[test]
fn what_cannot_be_laid_is_refused_with_its_reason() {
    let outside = refused(&at(sheet(100.0, 5), -5.0, 75.0));
    assert!(outside.contains("outside the terrain"), "{outside}");
    let near_the_edge = refused(&at(sheet(100.0, 5), 10.0, 75.0));
    assert!(
        near_the_edge.contains("past the data, which have rows 0 to 399"),
        "{near_the_edge}"
    );
    let huge = refused(&at(sheet(1e9, 5), 70.0, 75.0));
    assert!(huge.contains("past the data"), "{huge}");
    let void = refused(&at(sheet(100.0, 5), 351.0, 505.5));
    assert!(
        void.contains("no ground under 1 of the 20 vertices of its rim, first at coordinates"),
        "{void}"
    );
    // The void may be under what is authored, and in the lattice of its cut.
    for column in [500.0, 512.0] {
        let over = laid(&at(sheet(100.0, 5), 350.0, column)).unwrap();
        assert!((4 * over.cut[1]..4 * over.cut[3]).contains(&VOID[1]));
    }
    let mut high = at(sheet(100.0, 5), 70.0, 75.0);
    high.placement.height = Some(f64::from(1 << 24));
    let high = refused(&high);
    assert!(
        high.contains("heights are smaller than 16777216 m"),
        "{high}"
    );
    let closed: Faces = [[0, 1, 2], [0, 2, 1]].into_iter().collect();
    let closed = Cage::new(
        vec![[0.0; 3], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]],
        closed,
        &Tags::default(),
    )
    .unwrap();
    let closed = refused(&at(closed, 70.0, 75.0));
    assert!(
        closed.contains("must have an open rim that meets the ground"),
        "{closed}"
    );
    let plain = sheet(100.0, 3);
    let open: Faces = plain
        .topology()
        .faces()
        .iter()
        .enumerate()
        .filter(|(i, _)| *i != 4)
        .map(|(_, f)| f)
        .collect();
    let open = Cage::new(plain.positions().to_vec(), open, &Tags::default()).unwrap();
    let open = refused(&at(open, 70.0, 75.0));
    assert!(open.contains("2 open rims"), "{open}");
    let turned: Faces = plain
        .topology()
        .faces()
        .iter()
        .map(|f| f.iter().rev().copied().collect::<Vec<_>>())
        .collect();
    let turned = Cage::new(plain.positions().to_vec(), turned, &Tags::default()).unwrap();
    let turned = refused(&at(turned, 70.0, 75.0));
    assert!(turned.contains("turned downward"), "{turned}");
    let mut crossing = plain.positions().to_vec();
    crossing.swap(1, 2);
    let crossing = Cage::new(crossing, plain.topology().faces().clone(), &Tags::default()).unwrap();
    let crossing = refused(&at(crossing, 70.0, 75.0));
    assert!(crossing.contains("crosses or touches itself"), "{crossing}");
}

#[test]
fn two_features_on_one_spot_are_refused() {
    let inputs = [
        at(sheet(100.0, 5), 70.0, 75.0),
        at(sheet(100.0, 5), 100.0, 75.0),
    ];
    let error = with_site(|site| lay_all(&inputs, site))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("cage at 70, 75 and cage at 100, 75") && error.contains("overlap or touch"),
        "{error}"
    );
    let apart = [
        at(sheet(100.0, 5), 70.0, 75.0),
        at(sheet(100.0, 5), 120.0, 75.0),
    ];
    assert_eq!(with_site(|site| lay_all(&apart, site)).unwrap().len(), 2);
}

fn groups() -> Vec<FeatureGroup> {
    let feature = laid(&at(sheet(120.0, 3), 128.0, 128.0)).unwrap();
    let tiles = tiles_of(2, feature.cut);
    vec![FeatureGroup {
        id: 0,
        home: tiles[0],
        tiles,
        cut: feature.cut,
        cage: Some(feature.cage),
    }]
}

#[test]
fn records_read_back_what_was_written() {
    let groups = groups();
    let mut bytes = encode(groups[0].home, &groups);
    bytes.extend([0; 7]);
    let read = decode(&bytes, groups[0].home).unwrap();
    let (a, b) = (
        groups[0].cage.as_ref().unwrap(),
        read[0].cage.as_ref().unwrap(),
    );
    assert_eq!((a.positions(), a.topology()), (b.positions(), b.topology()));
    assert_eq!(
        (read[0].cut, &read[0].tiles),
        (groups[0].cut, &groups[0].tiles)
    );
    let other = groups[0].tiles[3];
    let read = decode(&encode(other, &groups), other).unwrap();
    assert!(read[0].cage.is_none() && read[0].home == groups[0].home);
}

#[test]
fn every_record_cut_short_is_an_error_and_no_announced_count_takes_memory() {
    let groups = groups();
    let bytes = encode(groups[0].home, &groups);
    for length in (0..bytes.len()).step_by(7) {
        assert!(
            decode(&bytes[..length], groups[0].home).is_err(),
            "{length}"
        );
    }
    for place in (0..80).step_by(4) {
        let mut bytes = bytes.clone();
        bytes[place..place + 4].copy_from_slice(&[0xff; 4]);
        let _ = decode(&bytes, groups[0].home);
    }
    assert!(decode(&bytes, TileId::new(2, 9, 9)).is_err());
}
