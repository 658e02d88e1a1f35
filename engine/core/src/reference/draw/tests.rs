use super::*;
use crate::{
    geo::TileId,
    reference::{
        balance::balance,
        decode::decode,
        emit,
        shared::{
            DRAW_LIST_WORDS, INDEX_COUNT_WORD,
            ground::place_in,
            synthetic::{Scene, frame, scene},
        },
    },
};

fn hills(east: f32, north: f32) -> f32 {
    60.0 * (east / 170.0).sin()
        + 30.0 * (north / 61.0).cos()
        + 5.0 * ((east + 2.0 * north) / 17.0).sin()
}

/// Three coarse quarters and four fine tiles, 1,024 metres a side.
fn mixed() -> (Scene, Vec<u32>) {
    let quarters = TileId::ROOT.children();
    let mut ids = quarters[..3].to_vec();
    ids.extend(quarters[3].children());
    let scene = scene(&ids, 8.0, &hills);
    let mut page = scene.empty_page();
    decode(&mut page, &scene.headers, &scene.staging);
    (scene, page)
}

#[test]
fn slopes_are_equal_on_both_sides_of_every_border() {
    let (scene, page) = mixed();
    let pages = [page.as_slice(), &[], &[], &[]];
    for i in 0..=128 {
        let along = 512.0 + 4.0 * i as f32;
        // Fine 3 and 4 (north row), 3 and 5 (west column) against coarse 1 and 2, and 3 against 4.
        let pairs = [(3, 1), (4, 1), (3, 2), (5, 2), (3, 4), (5, 6)];
        for (one, other) in pairs {
            let at = match other {
                1 => [along, 512.0],
                2 => [512.0, along],
                _ => [768.0, along],
            };
            let inside = |tile: u32| {
                let place = place_in(&scene.tiles[tile as usize], Vec2::new(at[0], -at[1]));
                place.min_element() >= 0.0 && place.max_element() <= 128.0
            };
            if inside(one) && inside(other) {
                let place = |tile: u32| Place {
                    tile,
                    at: place_in(&scene.tiles[tile as usize], Vec2::new(at[0], -at[1])),
                };
                let difference = ground_slope(&scene.tiles, &pages, place(one))
                    - ground_slope(&scene.tiles, &pages, place(other));
                assert!(
                    difference.length() < 1.0e-6,
                    "tiles {one} and {other} at {at:?}: {difference}"
                );
            }
        }
    }
}

#[test]
fn a_place_is_found_from_its_neighbours() {
    let (scene, _) = mixed();
    for (start, at, tile) in [
        (0, [600.0, 700.0], 3), // across a corner, coarse to fine
        (1, [700.0, 530.0], 3), // fine side, west half
        (1, [900.0, 530.0], 4), // fine side, east half
        (4, [900.0, 500.0], 1), // fine to coarse
        (5, [800.0, 800.0], 6), // same level
        (3, [513.0, 511.9], 3), // within half a sample
    ] {
        let here = locate(&scene.tiles, start, Vec2::new(at[0], -at[1]));
        assert_eq!(here.tile, tile, "from {start} at {at:?}");
    }
}

/// Looks straight down from a height over the middle of the scene.
fn from_above(drawn_count: u32, height: f32) -> Frame {
    let mut view = frame(drawn_count);
    let scale = 2.0;
    // w is the distance below the eye, at (512, -512, height).
    let columns = [
        [scale, 0.0, 0.0, 0.0],
        [0.0, scale, 0.0, 0.0],
        [0.0, 0.0, 0.0, -1.0],
    ];
    let eye = [-512.0 * scale, 512.0 * scale, 0.1, height];
    view.clip_from_view_world = [columns[0], columns[1], columns[2], eye];
    view
}

#[test]
fn ground_of_two_levels_has_no_holes_at_any_depths() {
    let (scene, page) = mixed();
    let pages = [page.as_slice(), &[], &[], &[]];
    let view = from_above(7, 900.0);
    let mut depths = vec![0; 7 * 1_024];
    for (patch, depth) in depths.iter_mut().enumerate() {
        *depth = u32::try_from(patch * 7_919 % 13 % 3).unwrap();
    }
    let (mut raised, mut patches) = (depths.clone(), depths.clone());
    balance(&view, &scene.tiles, &depths, &mut raised, &mut patches);
    let mut head = vec![0; DRAW_LIST_WORDS];
    emit::count(&view, &scene.tiles, &patches, &mut head);
    let mut indices = vec![0; head[5] as usize];
    emit::write(
        &view,
        &scene.tiles,
        &pages,
        &patches,
        &mut head,
        &mut indices,
    );
    // Without skirts, so that nothing hides a hole.
    let is_ground = |t: &&[u32]| t.iter().all(|index| index & 0x7fff < SKIRT_FIRST);
    let ground: Vec<u32> = indices[..head[INDEX_COUNT_WORD] as usize]
        .chunks_exact(3)
        .filter(is_ground)
        .flatten()
        .copied()
        .collect();
    let image = rasterise(&view, &scene.tiles, &pages, &ground, [96, 96]);
    for (pixel, &distance) in image.iter().enumerate() {
        assert!(
            (780.0..1_000.0).contains(&distance),
            "pixel {pixel} sees {distance}"
        );
    }
}

#[test]
fn vertices_stand_on_their_samples_and_skirts_below() {
    let (scene, page) = mixed();
    let pages = [page.as_slice(), &[], &[], &[]];
    let view = frame(7);
    let sample = 3 * 129 + 128;
    let top = vertex_position(&view, &scene.tiles, &pages, 1 << SAMPLE_BITS | sample);
    assert_eq!([top.x, top.y], [1_024.0, -12.0]);
    assert!((top.z - hills(1_024.0, -12.0)).abs() <= view.unit / 2.0);
    // The east side follows the 128 places of the north side.
    let below = vertex_position(
        &view,
        &scene.tiles,
        &pages,
        1 << SAMPLE_BITS | (SKIRT_FIRST + 128 + 3),
    );
    assert_eq!(below, top - Vec3::new(0.0, 0.0, scene.tiles[1].skirt));
}

#[test]
fn low_ground_is_green_high_ground_white_and_shade_darker() {
    let scene = scene(&[TileId::ROOT], 8.0, &|_, _| 50.0);
    let mut page = scene.empty_page();
    decode(&mut page, &scene.headers, &scene.staging);
    let pages = [page.as_slice(), &[], &[], &[]];
    let mut view = frame(1);
    let position = Vec3::new(100.0, -100.0, 50.0);
    let color = |view: &Frame| shade(view, &scene.tiles, &pages, &[], 0, position);
    view.height_range = [0.0, 4_000.0];
    let low = color(&view);
    assert!(low.y > low.x && low.y > low.z, "{low}");
    view.height_range = [-4_000.0, 100.0];
    let high = color(&view);
    assert!(
        high.min_element() > 0.4 && high.max_element() < 1.3,
        "{high}"
    );
    view.sun = [0.0, 0.0, -1.0];
    assert!(color(&view).max_element() < 0.5 * high.max_element());
    view.haze = 1.0;
    assert!((color(&view) - Vec3::from(view.sky)).length() < 1.0e-3);
}
