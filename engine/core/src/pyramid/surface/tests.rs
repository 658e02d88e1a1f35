//! The tile rule against vectors of real terrain and against plain 64-bit sums.

use std::{fs, path::PathBuf};

use serde_json::Value;

use super::*;

/// A tile of `tests/vectors/tile`.
struct Vector {
    name: String,
    step: i32,
    quadrant: u32,
    parent: Vec<i32>,
    codes: Vec<i32>,
    detail: Vec<i32>,
    heights: Vec<i32>,
    source: Vec<i32>,
}

fn numbers(bytes: &[u8], width: usize) -> Vec<i32> {
    let number = |chunk: &[u8]| match *chunk {
        [a] => i32::from(a.cast_signed()),
        [a, b] => i32::from(i16::from_le_bytes([a, b])),
        _ => i32::from_le_bytes(chunk.try_into().unwrap()),
    };
    bytes.chunks_exact(width).map(number).collect()
}

fn vectors() -> Vec<Vector> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/vectors/tile");
    let list: Vec<Value> =
        serde_json::from_slice(&fs::read(folder.join("vectors.json")).unwrap()).unwrap();
    let read = |line: &Value, key: &str, width| {
        numbers(
            &fs::read(folder.join(line[key].as_str().unwrap())).unwrap(),
            width,
        )
    };
    let whole = |value: &Value| i32::try_from(value.as_i64().unwrap()).unwrap();
    list.iter()
        .map(|line| Vector {
            name: line["name"].as_str().unwrap().into(),
            step: whole(&line["q"]),
            quadrant: (2 * whole(&line["quadrant"][0]) + whole(&line["quadrant"][1]))
                .cast_unsigned(),
            parent: read(line, "parent_cage", 4),
            codes: read(line, "cage_delta", 2),
            detail: read(line, "detail", 1),
            heights: read(line, "heights", 4),
            source: read(line, "source", 4),
        })
        .collect()
}

/// The same numbers on any machine: an xorshift generator.
fn random_controls(seed: u64, limit: i32) -> Vec<i32> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        i32::try_from((state >> 16) % (2 * u64::from(limit.unsigned_abs()) - 1)).unwrap()
            - (limit - 1)
    };
    (0..CAGE_CONTROL_COUNT).map(|_| next()).collect()
}

fn base_by_plain_sums(controls: &[i32], row: usize, column: usize) -> i32 {
    let mut sum = 0_i64;
    for a in 0..4 {
        for b in 0..4 {
            let weight =
                i64::from(LIMIT_WEIGHTS[row % 4][a]) * i64::from(LIMIT_WEIGHTS[column % 4][b]);
            if weight != 0 {
                sum += weight * i64::from(controls[(row / 4 + a) * CAGE_CONTROLS + column / 4 + b]);
            }
        }
    }
    i32::try_from((sum + 73_728).div_euclid(147_456)).unwrap()
}

#[test]
fn real_tiles_decode_to_the_last_bit() {
    let vectors = vectors();
    assert_eq!(vectors.len(), 8);
    for vector in vectors {
        let controls = decode_controls(&vector.parent, vector.quadrant, &vector.codes, vector.step);
        assert_eq!(
            decode_heights(&controls, &vector.detail, vector.step),
            vector.heights,
            "{}",
            vector.name
        );
        assert_eq!(
            encode_controls(&controls, &vector.parent, vector.quadrant, vector.step),
            vector.codes
        );
    }
}

#[test]
fn encoded_heights_come_within_half_a_step_of_the_source() {
    for vector in vectors() {
        let controls = decode_controls(&vector.parent, vector.quadrant, &vector.codes, vector.step);
        let wanted: Vec<i32> = vector
            .source
            .iter()
            .zip(&vector.heights)
            .map(|(&source, &height)| if source == i32::MIN { height } else { source })
            .collect();
        for step in [1, 2, 3, vector.step] {
            let codes = encode_detail(&wanted, &controls, step);
            let heights = decode_heights(&controls, &codes, step);
            let worst = heights
                .iter()
                .zip(&wanted)
                .map(|(a, b)| (a - b).abs())
                .max();
            assert!(
                worst <= Some(step / 2),
                "{} at step {step}: {worst:?}",
                vector.name
            );
        }
    }
}

#[test]
fn the_limit_surface_is_the_floor_of_plain_sums_in_doubles_and_in_32_bits() {
    for (seed, limit) in (1..40).zip([2, 100, 70_000, CONTROL_LIMIT].into_iter().cycle()) {
        let controls = random_controls(seed, limit);
        let heights = base_heights(&controls);
        for (at, &height) in heights.iter().enumerate() {
            let (row, column) = (at / TILE_SAMPLES, at % TILE_SAMPLES);
            assert_eq!(
                height,
                base_by_plain_sums(&controls, row, column),
                "seed {seed}, sample {row}, {column}"
            );
            assert_eq!(
                height,
                base_height_32(&controls, row, column),
                "seed {seed}, sample {row}, {column}"
            );
        }
    }
}

#[test]
fn a_flat_cage_is_flat_ground_at_the_greatest_height_too() {
    for height in [0, 1, -1, CONTROL_LIMIT - 1, 1 - CONTROL_LIMIT] {
        let flat = vec![height; CAGE_CONTROL_COUNT];
        assert!(base_heights(&flat).iter().all(|&h| h == height));
        assert!(child_window(&flat, 3).iter().all(|&h| h == height));
        assert_eq!(base_height_32(&flat, 128, 128), height);
    }
}

#[test]
fn child_windows_are_the_quarters_of_the_subdivision_and_overlap_by_the_ring() {
    let controls = random_controls(7, CONTROL_LIMIT);
    let fine = subdivide(&controls, CAGE_CONTROLS);
    let side = 2 * CAGE_CONTROLS - 3;
    for quadrant in 0..4_u32 {
        let [row, column] = [quadrant / 2, quadrant % 2].map(|half| half as usize * TILE_QUADS);
        for (at, &control) in child_window(&controls, quadrant).iter().enumerate() {
            let (i, j) = (at / CAGE_CONTROLS + row, at % CAGE_CONTROLS + column);
            assert_eq!(control, fine[i * side + j]);
        }
    }
}

#[test]
fn absurd_codes_wrap_and_do_not_panic() {
    let controls = vec![i32::MAX; CAGE_CONTROL_COUNT];
    let detail = vec![i32::MIN; TILE_SAMPLE_COUNT];
    assert_eq!(
        decode_heights(&controls, &detail, i32::MAX).len(),
        TILE_SAMPLE_COUNT
    );
    assert_eq!(
        decode_controls(&controls, 0, &controls, i32::MAX).len(),
        CAGE_CONTROL_COUNT
    );
}

#[test]
fn a_key_tile_needs_no_parent() {
    let controls: Vec<i32> = (0..1225_i32)
        .map(|at| 17 * ((at * 7919) % 4001 - 2000 + 300 * (at / 35)))
        .collect();
    let codes = encode_key_controls(&controls, 17);
    assert_eq!(decode_key_controls(&codes, 17), controls);
    let plane: Vec<i32> = (0..1225_i32)
        .map(|at| 5 * (1000 + 3 * (at / 35) - 2 * (at % 35)))
        .collect();
    let codes = encode_key_controls(&plane, 5);
    assert_eq!(codes.iter().filter(|code| code.abs() > 3).count(), 1);
    let wrapped = decode_key_controls(&[i32::MAX; 1225], i32::MAX);
    assert_eq!(wrapped.len(), 1225);
}
