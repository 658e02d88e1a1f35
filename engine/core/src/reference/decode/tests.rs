use std::{fs, path::Path};

use super::*;
use crate::{
    geo::TileId,
    reference::shared::{
        border::{EDGE_EAST, EDGE_NORTH, EDGE_SOUTH, EDGE_WEST},
        pool::{pool_slope, pool_stride_error},
        synthetic::{Scene, UNIT, scene},
    },
};

fn upload(controls: &[i32], detail: &[i32]) -> Vec<u32> {
    let mut words = vec![0; UPLOAD_WORDS];
    for (word, &control) in words[UPLOAD_CONTROLS_WORD..].iter_mut().zip(controls) {
        *word = control.cast_unsigned();
    }
    for (word, &code) in words[UPLOAD_DETAIL_WORD..].iter_mut().zip(detail) {
        *word = code.cast_unsigned();
    }
    words
}

fn decoded(controls: &[i32], detail: &[i32], quantum: i32) -> Vec<u32> {
    let step = [2.0, -2.0];
    let header = UploadHeader {
        slot: 0,
        quantum,
        unit: UNIT,
        reserved: 0,
        step,
        reserved_2: [0.0; 2],
    };
    let mut page = vec![0; SLOT_WORDS];
    decode(&mut page, &[header], &upload(controls, detail));
    page
}

fn heights_of(page: &[u32]) -> Vec<i32> {
    page[HEIGHTS_WORD..][..TILE_SAMPLE_COUNT]
        .iter()
        .map(|word| word.cast_signed())
        .collect()
}

/// The child's prediction: a parent's cage refined once, its quarter cut out.
fn child_window(parent: &[i32], quadrant: [usize; 2]) -> Vec<i32> {
    let axis = |at: usize, take: &dyn Fn(usize) -> i64| match at % 2 {
        0 => 4 * (take(at / 2) + take(at / 2 + 1)),
        _ => take(at / 2) + 6 * take(at / 2 + 1) + take(at / 2 + 2),
    };
    let value = |row: usize, column: usize| {
        let across = |i: usize| axis(column, &|j| i64::from(parent[i * CAGE_CONTROLS + j]));
        i32::try_from((axis(row, &across) + 32) >> 6).unwrap()
    };
    (0..CAGE_CONTROL_COUNT)
        .map(|at| {
            value(
                quadrant[0] * 32 + at / CAGE_CONTROLS,
                quadrant[1] * 32 + at % CAGE_CONTROLS,
            )
        })
        .collect()
}

fn numbers<const N: usize>(path: &Path, number: fn([u8; N]) -> i32) -> Vec<i32> {
    let bytes = fs::read(path).unwrap();
    bytes
        .chunks_exact(N)
        .map(|chunk| number(chunk.try_into().unwrap()))
        .collect()
}

#[test]
fn real_tiles_decode_to_the_last_bit() {
    let folder =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference/tile/vectors");
    let Ok(list) = fs::read_to_string(folder.join("vectors.json")) else {
        assert!(
            std::env::var_os("CI").is_none_or(|ci| ci != "true"),
            "no vectors at {}",
            folder.display()
        );
        println!("skipped: no vectors at {}", folder.display());
        return;
    };
    let list: Vec<serde_json::Value> = serde_json::from_str(&list).unwrap();
    assert_eq!(list.len(), 8);
    for line in &list {
        let path = |key: &str| folder.join(line[key].as_str().unwrap());
        let quantum = i32::try_from(line["q"].as_i64().unwrap()).unwrap();
        let quadrant =
            [0, 1].map(|i| usize::try_from(line["quadrant"][i].as_u64().unwrap()).unwrap());
        let parent = numbers(&path("parent_cage"), i32::from_le_bytes);
        let delta = numbers(&path("cage_delta"), |bytes| {
            i32::from(i16::from_le_bytes(bytes))
        });
        let detail = numbers(&path("detail"), |bytes| i32::from(i8::from_le_bytes(bytes)));
        let mut controls = child_window(&parent, quadrant);
        for (control, delta) in controls.iter_mut().zip(delta) {
            *control += quantum * delta;
        }
        let want = numbers(&path("heights"), i32::from_le_bytes);
        assert!(
            heights_of(&decoded(&controls, &detail, quantum)) == want,
            "{}",
            line["name"]
        );
    }
}

#[test]
fn a_tile_of_large_random_numbers_decodes_to_the_last_bit() {
    // The sum was made with 64-bit integers by another program.
    let mut state = 12_345_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 16).cast_signed()
    };
    let controls: Vec<i32> = (0..CAGE_CONTROL_COUNT)
        .map(|_| random() * 64 - 2_000_000)
        .collect();
    let detail: Vec<i32> = (0..TILE_SAMPLE_COUNT).map(|_| random() % 41 - 20).collect();
    let heights = heights_of(&decoded(&controls, &detail, 7));
    let sum = heights
        .iter()
        .flat_map(|height| height.to_le_bytes())
        .fold(0xcbf2_9ce4_8422_2325_u64, |sum, byte| {
            (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
    assert_eq!(
        [heights[0], heights[128], heights[64 * 129 + 65]],
        [-781_847, 569_059, 531_915]
    );
    assert_eq!(sum, 0xd9fe_0441_c9e3_1387);
}

fn waves(east: f32, north: f32) -> f32 {
    200.0 * (east / 170.0).sin()
        + 90.0 * (north / 61.0).cos()
        + 20.0 * ((east + 2.0 * north) / 17.0).sin()
}

fn page_of(scene: &Scene) -> Vec<u32> {
    let mut page = scene.empty_page();
    decode(&mut page, &scene.headers, &scene.staging);
    page
}

#[test]
fn a_plane_has_its_slopes_everywhere_and_no_stride_error() {
    // Heights in whole units: 3 units a sample east, 5 units a sample south.
    let controls: Vec<i32> = (0..1_225)
        .map(|at| (at % 35) * 12 + (at / 35) * 20)
        .collect();
    let page = decoded(&controls, &[0; TILE_SAMPLE_COUNT], 1);
    let pages = [page.as_slice(), &[], &[], &[]];
    for sample in 0..16_641 {
        assert_eq!(
            pool_slope(&pages, 0, sample),
            [3.0 * UNIT / 2.0, 5.0 * UNIT / -2.0]
        );
    }
    assert!((0..1_024).all(|patch| pool_stride_error(&pages, 0, patch, 0) == 0.0));
    assert!((0..1_024).all(|patch| pool_stride_error(&pages, 0, patch, 1) == 0.0));
}

#[test]
fn neighbours_hold_equal_heights_and_slopes_on_their_border() {
    let ids = [
        TileId::new(1, 0, 0),
        TileId::new(1, 0, 1),
        TileId::new(1, 1, 0),
    ];
    let page = page_of(&scene(&ids, 8.0, &waves));
    for at in 0..TILE_SAMPLES {
        for word in [HEIGHTS_WORD, SLOPES_WORD] {
            let east = page[word + at * TILE_SAMPLES + TILE_CELLS];
            assert_eq!(east, page[SLOT_WORDS + word + at * TILE_SAMPLES]);
            let south = page[word + TILE_CELLS * TILE_SAMPLES + at];
            assert_eq!(south, page[2 * SLOT_WORDS + word + at]);
        }
    }
}

/// The height of a patch drawn at a stride with split edges at one of its samples, by its triangles one by one.
fn drawn_height(height: &dyn Fn(i32, i32) -> f64, stride: i32, split: u32, at: [i32; 2]) -> f64 {
    let cell = at.map(|at| (at / stride).min(4 / stride - 1) * stride);
    let corner = |i: i32, j: i32| [cell[0] + i * stride / 2, cell[1] + j * stride / 2];
    let mut ring = vec![];
    for (edge, from, middle) in [
        (EDGE_WEST, [0, 0], [1, 0]),
        (EDGE_SOUTH, [2, 0], [2, 1]),
        (EDGE_EAST, [2, 2], [1, 2]),
        (EDGE_NORTH, [0, 2], [0, 1]),
    ] {
        ring.push(corner(from[0], from[1]));
        if split & edge != 0 {
            ring.push(corner(middle[0], middle[1]));
        }
    }
    let triangles: Vec<[[i32; 2]; 3]> = if split == 0 {
        vec![[ring[0], ring[1], ring[2]], [ring[0], ring[2], ring[3]]]
    } else {
        (0..ring.len())
            .map(|i| [corner(1, 1), ring[i], ring[(i + 1) % ring.len()]])
            .collect()
    };
    let cross = |a: [i32; 2], b: [i32; 2], c: [i32; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    for [a, b, c] in triangles {
        let shares = [cross(at, b, c), cross(a, at, c), cross(a, b, at)];
        if shares.iter().all(|&share| share >= 0) {
            let sum: f64 = [a, b, c]
                .iter()
                .zip(shares)
                .map(|(p, share)| f64::from(share) * height(p[0], p[1]))
                .sum();
            return sum / f64::from(cross(a, b, c));
        }
    }
    unreachable!("triangles cover the cell");
}

#[test]
fn a_stride_error_is_the_largest_distance_of_all_sixteen_templates() {
    let scene = scene(&[TileId::ROOT], 8.0, &waves);
    let page = page_of(&scene);
    let pages = [page.as_slice(), &[], &[], &[]];
    for (patch, row, column) in [(0, 0, 0), (37, 4, 20), (1_023, 124, 124)] {
        let height = |i: i32, j: i32| {
            f64::from(page[((row + i) * 129 + column + j) as usize].cast_signed()) * f64::from(UNIT)
        };
        for (depth, stride) in [(0, 4), (1, 2)] {
            let mut worst = 0.0_f64;
            for split in 0..16 {
                for at in 0..25 {
                    let place = [at / 5, at % 5];
                    let distance =
                        drawn_height(&height, stride, split, place) - height(place[0], place[1]);
                    worst = worst.max(distance.abs());
                }
            }
            assert_eq!(
                f64::from(pool_stride_error(&pages, 0, patch, depth)),
                worst,
                "patch {patch} depth {depth}"
            );
            assert!(worst > 0.0);
        }
    }
}

#[test]
fn void_samples_count_in_no_stride_error() {
    let mut detail = vec![0; TILE_SAMPLE_COUNT];
    detail[129 + 1] = 1_000;
    let mut words = upload(&[0; CAGE_CONTROL_COUNT], &detail);
    words[UPLOAD_VOIDS_WORD + (129 + 1) / 32] = 1 << ((129 + 1) % 32);
    let header = UploadHeader {
        slot: 0,
        quantum: 1,
        unit: 1.0,
        reserved: 0,
        step: [1.0; 2],
        reserved_2: [0.0; 2],
    };
    let mut page = vec![0; SLOT_WORDS];
    decode(&mut page, &[header], &words);
    let pages = [page.as_slice(), &[], &[], &[]];
    assert_eq!(pool_stride_error(&pages, 0, 0, 0), 0.0);
    assert_eq!(heights_of(&page)[129 + 1], 1_000);
}
