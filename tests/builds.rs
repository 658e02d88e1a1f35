//! Builds as a team runs them: from lists of many files.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use crate::support::{drumlin_fails, drumlin_ok, files, folder};

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain name")
}

/// All files of a folder by their names in it.
fn bytes(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = Vec::new();
    files(folder, &mut found);
    found
        .into_iter()
        .map(|path| {
            let name = path.strip_prefix(folder).expect("it lies there").to_owned();
            (name, fs::read(&path).expect("it can be read"))
        })
        .collect()
}

/// Makes part of the terrain of a seed.
fn synth(file: &Path, window: &str) {
    drumlin_ok(["synth", "--seed", "5", "--window", window, "-o", text(file)]);
}

#[test]
fn a_list_of_files_is_as_good_as_their_names() {
    let out = folder("input-list");
    let mut list = String::from("# tiles of one terrain\n\n");
    let mut named = Vec::new();
    for (row, column) in (0..4).flat_map(|row| (0..5).map(move |column| (row, column))) {
        let name = format!("{row} {column}.tif");
        synth(
            &out.join(&name),
            &format!("{},{},30,40", 30 * row, 40 * column),
        );
        list += &format!("{name}\r\n");
        named.push(out.join(name));
    }
    let path = out.join("list.txt");
    fs::write(&path, list).expect("a list can be written");
    let [by_list, by_name] = ["list.zarr", "name.zarr"].map(|name| out.join(name));
    drumlin_ok(["build", "--input-list", text(&path), "-o", text(&by_list)]);
    let names = named.iter().map(|path| text(path));
    drumlin_ok(["build", "-o", text(&by_name)].into_iter().chain(names));
    assert!(bytes(&by_list) == bytes(&by_name));

    fs::write(&path, "none.tif\n").expect("a list can be written");
    let other = out.join("other.zarr");
    let arguments = ["build", "--input-list", text(&path), "-o", text(&other)];
    let line = drumlin_fails(3, arguments);
    assert!(line.contains("none.tif"), "{line}");
    fs::write(&path, "# nothing\n").expect("a list can be written");
    let line = drumlin_fails(2, arguments);
    assert!(line.contains("names no input"), "{line}");
    fs::remove_file(&path).expect("a list can be removed");
    drumlin_fails(3, arguments);
    assert!(!other.exists());
}
