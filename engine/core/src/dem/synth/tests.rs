use super::*;

fn read(seed: u64, row: u32, column: u32, rows: u32, columns: u32) -> Vec<f64> {
    let window = Window {
        row,
        column,
        rows,
        columns,
    };
    let synth = Synth::new(seed, window).unwrap();
    let mut out = vec![0.0; (rows * columns) as usize];
    synth
        .read(Window::whole(&synth.header().grid), &mut out)
        .unwrap();
    out
}

#[test]
fn heights_have_the_same_bits_everywhere() {
    let bytes: Vec<u8> = [[0, 0], [70_001, 12], [1 << 25, (1 << 26) - 20]]
        .into_iter()
        .flat_map(|[row, column]| read(42, row, column, 20, 20))
        .flat_map(f64::to_le_bytes)
        .collect();
    let hash = blake3::hash(&bytes).to_hex();
    assert_eq!(&hash[..16], "b028d8268b6ece9c");
}

#[test]
fn windows_agree_where_they_overlap_and_say_where_they_lie() {
    let whole = read(3, 100, 200, 40, 50);
    let part = read(3, 110, 220, 5, 7);
    for (row, part) in part.chunks_exact(7).enumerate() {
        assert_eq!(part, &whole[(row + 10) * 50 + 20..][..7]);
    }
    let window = Window {
        row: 110,
        column: 220,
        rows: 5,
        columns: 7,
    };
    let synth = Synth::new(3, window).unwrap();
    assert_eq!(synth.header().grid.origin, [2200.0, -1100.0]);
}

#[test]
fn seeds_differ_also_in_their_upper_half() {
    let one = read(1, 0, 0, 8, 8);
    assert_ne!(one, read(2, 0, 0, 8, 8));
    assert_ne!(one, read(1 | 1 << 32, 0, 0, 8, 8));
}

#[test]
fn slopes_and_heights_are_those_of_mountains() {
    let side = 96;
    let stride = 97;
    let mut steep = 0;
    for row in 0..side {
        for column in 0..side {
            let [row, column] = [row * stride, column * stride];
            let here = height(9, row, column);
            assert!((-3000.0..8000.0).contains(&here), "{here}");
            let slope = (height(9, row, column + 1) - here).abs() / SPACING;
            // The steepest walls of real models of this spacing.
            assert!(slope < 6.0, "{slope} at row {row}, column {column}");
            steep += u32::from(slope > 0.2);
        }
    }
    let share = f64::from(steep) / f64::from(side * side);
    assert!((0.2..0.8).contains(&share), "{share} steeper than 1 in 5");
}

#[test]
fn roughness_falls_with_size_as_in_real_mountains() {
    // Second differences at distance d grow like d^H, with H from 0.5 to 1 in real mountains, and more up
    // close, where models are smoothed.
    let bend = |distance: u32| {
        let sum: f64 = (0..4000)
            .map(|i| {
                let [row, column] = [5000 + i * 7, 5000 + i * 13];
                let at = |column| height(5, row, column);
                let bend = at(column - distance) - 2.0 * at(column) + at(column + distance);
                bend * bend
            })
            .sum();
        sum.sqrt()
    };
    for distance in [1, 4, 16, 64, 256] {
        let exponent = (bend(2 * distance) / bend(distance)).log2();
        assert!((0.4..1.5).contains(&exponent), "{exponent} at {distance}");
    }
}

#[test]
fn windows_that_are_none_are_refused() {
    for (row, rows, columns) in [(0, 0, 5), (0, 5, 0), (1 << 26, 1, 1), (u32::MAX, 9, 9)] {
        let window = Window {
            row,
            column: 0,
            rows,
            columns,
        };
        let error = Synth::new(1, window).unwrap_err().to_string();
        assert!(error.contains("seed 1"), "{error}");
    }
}
