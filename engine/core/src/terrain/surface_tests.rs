//! Heights, normals, rays and colliders agree with each other.

use std::sync::Arc;

use crate::{
    geo::TileId,
    pyramid::feature::FeatureGroup,
    stream::{TileSource, mix, synthetic::Synthetic},
    terrain::{Surface, feature_mesh::synthetic},
};

/// 300 × 260 metres, a sample a metre; a void in the second tile of the first row.
fn surface() -> Surface {
    let mut source = Synthetic::new(301, 261, 11);
    source.rough = true;
    source.void = Some(|id, row, column| {
        id.row == 0 && id.column == 1 && row.abs_diff(60) + column.abs_diff(60) < 12
    });
    Surface::new(Arc::new(source))
}

fn random(seed: &mut u64, low: f64, high: f64) -> f64 {
    *seed += 1;
    low + (high - low) * (mix(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)) % 1_000_000) as f64 / 1e6
}

#[test]
fn heights_are_the_samples_and_planes_between_them() {
    let surface = surface();
    let at = |x: f64, y: f64| surface.height_at([x, y]).unwrap();
    let finest = TileId::new(2, 0, 0);
    let samples = surface.tile(finest).unwrap().heights().samples.clone();
    for (row, column) in [(0, 0), (1, 1), (37, 81), (127, 126)] {
        let [x, y] = [-150.0 + column as f64, 130.0 - row as f64];
        assert_eq!(
            at(x, y),
            Some(f64::from(samples[row * 129 + column]) / 16.0)
        );
        let corner = |down: usize, right: usize| {
            f64::from(samples[(row + down) * 129 + column + right]) / 16.0
        };
        let lower = 0.25 * corner(0, 0) + 0.5 * corner(1, 0) + 0.25 * corner(1, 1);
        assert!((at(x + 0.25, y - 0.75).unwrap() - lower).abs() < 1e-9);
        let upper = 0.25 * corner(0, 0) + 0.5 * corner(0, 1) + 0.25 * corner(1, 1);
        assert!((at(x + 0.75, y - 0.25).unwrap() - upper).abs() < 1e-9);
    }
}

#[test]
fn there_is_nothing_outside_and_in_voids() {
    let surface = surface();
    for place in [
        [-150.1, 0.0],
        [150.1, 0.0],
        [0.0, 130.1],
        [0.0, -130.1],
        [f64::NAN, 0.0],
        [38.0, 70.0],
    ] {
        assert_eq!(surface.height_at(place).unwrap(), None);
        assert_eq!(surface.normal_at(place).unwrap(), None);
    }
    for place in [[-150.0, 130.0], [150.0, -130.0], [0.0, 0.0]] {
        assert!(surface.height_at(place).unwrap().is_some());
    }
}

#[test]
fn normals_are_those_of_the_slopes() {
    let (surface, mut seed) = (surface(), 1);
    for _ in 0..200 {
        let [x, y] = [(); 2].map(|()| random(&mut seed, -125.0, 0.0).floor());
        let place = [x + 0.2, y + 0.3];
        let [Some(here), Some(east), Some(north)] =
            [[0.0, 0.0], [1e-3, 0.0], [0.0, 1e-3]].map(|step| {
                surface
                    .height_at([place[0] + step[0], place[1] + step[1]])
                    .unwrap()
            })
        else {
            panic!("no void here");
        };
        let normal = surface.normal_at(place).unwrap().unwrap();
        assert!((normal.iter().map(|part| part * part).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((-normal[0] / normal[2] - (east - here) / 1e-3).abs() < 1e-6);
        assert!((-normal[1] / normal[2] - (north - here) / 1e-3).abs() < 1e-6);
    }
}

#[test]
fn a_ray_stops_where_it_first_meets_the_surface() {
    let (surface, mut seed) = (surface(), 7);
    let mut hits = 0;
    for index in 0..150 {
        let origin = [
            random(&mut seed, -170.0, 170.0),
            random(&mut seed, -150.0, 150.0),
            random(&mut seed, 40.0, 90.0),
        ];
        let mut direction = [0; 3].map(|_| random(&mut seed, -1.0, 1.0));
        match index % 5 {
            0 => direction = [0.0, 0.0, if index % 2 == 0 { 1.0 } else { -1.0 }],
            1 => direction[2] *= 0.02,
            2 => direction = [1.0, 0.0, -0.1],
            _ => direction[2] = 2.0 * (50.0 - origin[2]) / 40.0,
        }
        let max = 200.0;
        let hit = surface.raycast(origin, direction, max).unwrap();
        let length = direction.iter().map(|part| part * part).sum::<f64>().sqrt();
        let place = |t: f64| [0, 1, 2].map(|axis| origin[axis] + t * direction[axis] / length);
        let above = |t: f64| {
            let [x, y, z] = place(t);
            surface.height_at([x, y]).unwrap().map(|height| z - height)
        };
        let end = hit.map_or(max, |hit| hit.distance);
        let mut sign = None;
        for step in 0..2000 {
            let now = above((end - 1e-6) * f64::from(step) / 2000.0);
            let Some(now) = now.filter(|above| above.abs() > 1e-6) else {
                sign = None;
                continue;
            };
            assert_eq!(
                *sign.get_or_insert(now > 0.0),
                now > 0.0,
                "ray {index} passed through the surface"
            );
        }
        if let Some(hit) = hit {
            hits += 1;
            assert!(above(hit.distance).unwrap().abs() < 1e-6);
            assert!(
                hit.position
                    .iter()
                    .zip(place(hit.distance))
                    .all(|(a, b)| (a - b).abs() < 1e-9)
            );
        }
    }
    assert!(hits > 40);
}

#[test]
fn a_ray_goes_through_a_void_and_ends_at_max() {
    let surface = surface();
    assert!(
        surface
            .raycast([38.0, 70.0, 90.0], [0.0, 0.0, -1.0], 1e6)
            .unwrap()
            .is_none()
    );
    assert!(
        surface
            .raycast([0.0, 0.0, 90.0], [0.0, 0.0, -2.0], 10.0)
            .unwrap()
            .is_none()
    );
    assert!(
        surface
            .raycast([0.0, 0.0, 90.0], [0.0, 0.0, -2.0], 60.0)
            .unwrap()
            .is_some()
    );
    assert!(
        surface
            .raycast([0.0, 0.0, 90.0], [0.0; 3], 60.0)
            .unwrap()
            .is_none()
    );
    assert!(
        surface
            .raycast([f64::NAN; 3], [1.0, 0.0, 0.0], 60.0)
            .unwrap()
            .is_none()
    );
}

#[test]
fn colliders_are_the_surface_where_there_is_one() {
    let surface = surface();
    let whole = surface.collider(TileId::new(2, 0, 0), 1).unwrap();
    assert_eq!(
        (whole.positions.len(), whole.indices.len()),
        (129 * 129, 128 * 128 * 6)
    );
    for triangle in whole.indices.chunks(3).step_by(97) {
        let [a, b, c] =
            [0, 1, 2].map(|corner| whole.positions[triangle[corner] as usize].map(f64::from));
        let up = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        assert!(up > 0.0);
        let middle = [0, 1, 2].map(|axis| whole.origin[axis] + (a[axis] + b[axis] + c[axis]) / 3.0);
        let height = surface.height_at([middle[0], middle[1]]).unwrap().unwrap();
        assert!((height - middle[2]).abs() < 1e-4);
    }
    let hole = surface.collider(TileId::new(2, 0, 1), 1).unwrap();
    assert!(hole.indices.len() < whole.indices.len());
    let border = surface.collider(TileId::new(2, 2, 2), 4).unwrap();
    assert_eq!(border.indices.len(), 11 * 6);
    assert!(
        surface.collider(TileId::ROOT, 3).is_err()
            && surface.collider(TileId::new(9, 0, 0), 1).is_err()
    );
}

#[test]
fn the_cache_stays_small() {
    let source = Synthetic::new(2000, 2000, 1);
    let count = source.metadata().grid.tiles(source.metadata().finest());
    let surface = Surface::new(Arc::new(source));
    for column in 0..count[1] {
        for row in 0..count[0] {
            surface
                .tile(TileId::new(surface.finest(), row, column))
                .unwrap();
        }
    }
    assert!(surface.kept() <= 128);
}

/// Rough ground with an arch of 200 units across the border of two tiles, samples a metre apart.
fn with_arch() -> Surface {
    with_arch_in(1.0)
}

/// The same with samples so many metres apart.
fn with_arch_in(step: f64) -> Surface {
    let mut source = Synthetic::new(513, 513, 7).with_step(step);
    let finest = source.metadata().finest();
    let place = synthetic::arch_place(1.0, 1.0 / 16.0);
    let tiles = vec![TileId::new(finest, 0, 0), TileId::new(finest, 0, 1)];
    source.features.push(FeatureGroup {
        id: 4,
        home: tiles[0],
        tiles,
        cut: place.cut,
        cage: Some(synthetic::arch_cage(200.0, |_, _| 800.0)),
    });
    source.rough = true;
    Surface::new(Arc::new(source))
}

/// World x and y of a finest sample.
fn sample(surface: &Surface, row: f64, column: f64) -> [f64; 2] {
    let frame = surface.tile_frame(TileId::new(surface.finest(), 0, 0));
    [
        frame.corner[0] + column * frame.step[0],
        frame.corner[1] + row * frame.step[1],
    ]
}

#[test]
fn inside_a_cut_the_feature_is_the_surface() {
    let surface = with_arch();
    // Under the crown: columns 104 + 24, rows 20 + 14.
    let crown = sample(&surface, 34.0, 128.0);
    let height = surface.height_at(crown).unwrap().unwrap();
    assert!(height > 55.0, "{height}: 50 m of ground and the arch");
    assert!(surface.normal_at(crown).unwrap().unwrap()[2] > 0.9);
    let down = |from: f64| {
        let hit = surface.raycast([crown[0], crown[1], from], [0.0, 0.0, -1.0], 200.0);
        hit.unwrap().unwrap().position[2]
    };
    assert!((down(150.0) - height).abs() < 1e-4);
    assert!(
        (down(height - 6.0) - 50.0).abs() < 1.0,
        "the ground under it"
    );
    // Through under the arch, and against its foot.
    let along = |column: f64| {
        let [x, y] = sample(&surface, 60.0, column);
        surface
            .raycast([x, y, 53.0], [0.0, 1.0, 0.0], 60.0)
            .unwrap()
    };
    assert!(along(128.0).is_none());
    let foot = along(104.0 + 14.0).unwrap();
    assert!((20.0..30.0).contains(&foot.distance), "{}", foot.distance);
    assert!(foot.normal[1] < -0.5, "it faces south");
}

#[test]
fn heights_meet_on_a_cuts_border_and_nowhere_is_a_hole() {
    let surface = with_arch();
    for at in 0..400 {
        let row = 16.0 + f64::from(at / 20) * 2.03;
        let column = 98.0 + f64::from(at % 20) * 3.17;
        assert!(
            surface
                .height_at(sample(&surface, row, column))
                .unwrap()
                .is_some()
        );
    }
    let mut worst = 0.0_f64;
    for column in 0..48 {
        let column = 104.0 + f64::from(column) + 0.5;
        let at = |row: f64| {
            surface
                .height_at(sample(&surface, row, column))
                .unwrap()
                .unwrap()
        };
        worst = worst.max((at(20.0 - 1e-5) - at(20.0 + 1e-5)).abs());
    }
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn a_cut_has_heights_to_its_last_sliver_and_the_ground_is_there_without_its_feature() {
    // None is a float: rounded to floats, corners of the mesh would lie up to two millimetres inside the cut.
    for step in [1001.3, 900.1, 900.7] {
        let surface = with_arch_in(step);
        for at in (0..8).map(f64::from) {
            let sliver = 1.2e-6;
            for [row, column] in [
                [20.0 + 32.0 - sliver, 104.0 + 6.0 * at],
                [20.0 + 4.0 * at, 104.0 + 48.0 - sliver],
            ] {
                let place = sample(&surface, row, column);
                let [height, ground] = [surface.height_at(place), surface.ground_at(place)]
                    .map(|height| height.unwrap().unwrap());
                // Both are less than a hundred units over a millionth of a cell off the border's height, which is 1e-5 m,
                // and the mesh's heights are floats of a hundred metres.
                assert!((height - ground).abs() < 1e-4, "{row} {column}");
            }
        }
        let crown = sample(&surface, 34.0, 128.0);
        let [height, ground] = [surface.height_at(crown), surface.ground_at(crown)]
            .map(|height| height.unwrap().unwrap());
        assert!(height > 55.0 && (ground - 50.0).abs() < 1.0);
    }
}

#[test]
fn colliders_hold_the_feature_between_them() {
    let surface = with_arch();
    let finest = surface.finest();
    let mut top = 0.0_f64;
    for column in 0..2 {
        let collider = surface.collider(TileId::new(finest, 0, column), 1).unwrap();
        let ground = 2 * (128 * 128 - 8 * 6 * 16);
        assert!(collider.indices.len() / 3 > ground + 2 * 8 * 6 * 16 / 2);
        let highest = collider.positions.iter().map(|position| position[2]);
        top = top.max(f64::from(highest.fold(0.0, f32::max)) + collider.origin[2]);
        let coarse = surface.collider(TileId::new(finest, 0, column), 2).unwrap();
        assert_eq!(coarse.indices.len() / 3, 2 * 64 * 64);
    }
    assert!(top > 55.0, "{top}");
}
