//! Cages for the tests of tables and of what executes them.

use std::{fs, path::PathBuf};

use crate::cage::{Cage, CageBudget, Crease, Faces, Tags, read_obj};

/// Cages of the shared reference with exact samples: valences 3 to 12, boundaries, corners, creases semi-sharp and
/// infinite.
pub(super) const CAGES: [&str; 8] = [
    "box_creases",
    "discs_3_5_7_10",
    "sheet_boundary",
    "polycube_a",
    "terrain_a",
    "regression_car",
    "regression_helmet",
    "regression_gregory_test1",
];

/// Closed cages of the shared reference without tags, with the counts of the paper's Table 1.
pub(super) const TABLE1: [&str; 4] = [
    "table1/table1_crocodile",
    "table1/table1_gorilla",
    "table1/table1_hippo",
    "table1/table1_koala",
];

/// A file of the shared reference; says that it was skipped where there is none.
pub(super) fn reference(name: &str) -> Option<PathBuf> {
    let folder =
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference/catmull-clark");
    if folder.is_dir() {
        return Some(folder.join(name));
    }
    assert!(
        std::env::var_os("CI").is_none(),
        "no ../shared/reference in CI"
    );
    println!("skipped: no ../shared/reference");
    None
}

/// A cage of the shared reference.
pub(super) fn cage(name: &str) -> Option<Cage> {
    let path = reference(&format!("{name}.obj"))?;
    Some(read_obj(&fs::read(path).expect("a file"), CageBudget::default()).expect("a cage"))
}

/// Five quads around a vertex, each bent its own way, a crease along one of its edges.
pub(crate) fn fan(sharpness: f64) -> Cage {
    let mut positions = vec![[0.0, 0.0, 0.5]];
    for i in 0..10 {
        let (sin, cos) = (f64::from(i) * std::f64::consts::PI / 5.0).sin_cos();
        let radius = if i % 2 == 0 { 1.0 } else { 1.4 };
        positions.push([radius * cos, radius * sin, 0.1 * f64::from(i * i % 7)]);
    }
    let mut faces = Faces::default();
    for i in 0..5 {
        faces.push(&[0, 1 + 2 * i, 2 + 2 * i, 1 + (2 * i + 2) % 10]);
    }
    let creases = vec![Crease {
        vertices: [0, 1],
        sharpness,
    }];
    let tags = Tags {
        creases,
        ..Tags::default()
    };
    Cage::new(positions, faces, &tags).unwrap()
}
