//! The limit surface against the reference samples.

use std::path::{Path, PathBuf};

use super::super::{Cage, CageBudget, LimitSample, LimitSurface, Place, read_obj};

pub(super) fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

pub(super) fn read(path: &Path) -> Cage {
    read_obj(&std::fs::read(path).unwrap(), CageBudget::default()).unwrap()
}

pub(super) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

pub(super) fn length(a: [f64; 3]) -> f64 {
    distance(a, [0.0; 3])
}

/// A row of a reference file; vectors are absent where the surface has none.
struct Row {
    line: String,
    place: Place,
    position: [f64; 3],
    derivatives: Option<[[f64; 3]; 2]>,
    normal: Option<[f64; 3]>,
}

fn rows(path: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().skip(1).map(row).collect()
}

fn row(line: &str) -> Row {
    let words: Vec<&str> = line.split(',').collect();
    let vector = |from: usize| -> Option<[f64; 3]> {
        let values: Vec<f64> = words[from..from + 3]
            .iter()
            .filter_map(|word| word.parse().ok())
            .collect();
        values.try_into().ok()
    };
    Row {
        line: line.to_owned(),
        place: Place {
            face: words[1].parse().unwrap(),
            u: words[2].parse().unwrap(),
            v: words[3].parse().unwrap(),
        },
        position: vector(6).unwrap(),
        derivatives: vector(9).zip(vector(12)).map(|(du, dv)| [du, dv]),
        normal: vector(15),
    }
}

/// Compares every row; returns the number of rows.
fn check(folder: &Path, name: &str) -> usize {
    let cage = read(&folder.join(format!("{name}.obj")));
    let surface = LimitSurface::new(&cage).unwrap();
    let rows = rows(&folder.join(format!("{name}.csv")));
    let places: Vec<Place> = rows.iter().map(|row| row.place).collect();
    for (row, sample) in rows.iter().zip(surface.evaluate_many(&places).unwrap()) {
        check_row(row, &sample, cage.extent(), name);
    }
    rows.len()
}

fn check_row(row: &Row, sample: &LimitSample, extent: f64, name: &str) {
    let line = &row.line;
    let off = distance(sample.position, row.position);
    assert!(
        off <= 1e-13 * extent,
        "{name}: position off by {off:e}\n{line}\n{sample:?}"
    );
    if let Some([du, dv]) = row.derivatives {
        // The reference was compared to 2e-11 of the derivatives.
        let scale = length(du).max(length(dv));
        let off = distance(sample.du, du).max(distance(sample.dv, dv));
        assert!(
            off <= 1e-10 * scale,
            "{name}: derivatives off by {off:e}\n{line}\n{sample:?}"
        );
    }
    if let Some(normal) = row.normal {
        let off = distance(sample.normal, normal);
        assert!(
            off <= 1e-9,
            "{name}: normal off by {off:e}\n{line}\n{sample:?}"
        );
    }
}

#[test]
fn committed_samples_are_met() {
    let folder = repository().join("tests/vectors/catmull-clark");
    assert_eq!(check(&folder, "discs_3_5_7_10"), 30);
    assert_eq!(check(&folder, "box_creases"), 30);
}

#[test]
fn every_reference_sample_is_met() {
    let folder = repository().join("../shared/reference/catmull-clark");
    if !folder.is_dir() {
        assert_ne!(
            std::env::var("CI").as_deref(),
            Ok("true"),
            "no ../shared/reference/catmull-clark in CI"
        );
        println!("skipped: no ../shared/reference/catmull-clark");
        return;
    }
    let names = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut count = 0;
    for path in names.filter(|path| path.extension().is_some_and(|ext| ext == "csv")) {
        let name = path.file_stem().unwrap().to_str().unwrap();
        if name != "counts" {
            count += check(&folder, name);
        }
    }
    assert!(count > 1500, "{count}");
}
