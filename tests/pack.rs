//! A pyramid as one file: every verb reads it, and it comes back to the byte.

use std::fs;

use crate::support::{
    drumlin_fails, drumlin_json, drumlin_ok, files, folder, has_gpu, rainier_pyramid,
};

#[test]
fn every_verb_reads_an_archive_as_it_reads_the_folder() {
    let out = folder("pack");
    let zip = out.join("rainier.zip");
    let zip = zip.to_str().expect("a plain name");
    let pyramid = rainier_pyramid().to_str().expect("a plain name");
    let told = drumlin_json(["pack", pyramid, zip, "--json"]);
    assert_eq!(
        told["bytes"].as_u64(),
        fs::metadata(zip).ok().map(|about| about.len())
    );
    drumlin_ok(["validate", zip, "--deep"]);
    for arguments in [
        &["info", "--json"][..],
        &["height", "--json", "--at", "-121.76,46.85", "-121.5,46.9"],
        &["validate", "--json"],
    ] {
        let [folder, archive] = [pyramid, zip].map(|path| {
            let all = [&arguments[..1], &[path], &arguments[1..]].concat();
            drumlin_json(all)
        });
        assert_eq!(folder, archive, "{arguments:?}");
    }
    if has_gpu() {
        let frame = out.join("frames");
        drumlin_ok([
            "fly",
            zip,
            "--size",
            "64x48",
            "--fps",
            "0.1",
            "--wait-for-tiles",
            "--frames",
            frame.to_str().expect("a plain name"),
        ]);
        assert!(fs::read_dir(frame).expect("pictures").count() > 0);
    }
}

#[test]
fn an_archive_comes_back_to_the_byte() {
    let out = folder("unpack");
    let [zip, back] = ["a.zip", "a.zarr"].map(|name| out.join(name));
    let [zip_name, back_name] = [&zip, &back].map(|path| path.to_str().expect("a plain name"));
    let pyramid = rainier_pyramid();
    drumlin_ok(["pack", pyramid.to_str().expect("a plain name"), zip_name]);
    drumlin_ok(["unpack", zip_name, back_name]);
    let mut all = Vec::new();
    files(pyramid, &mut all);
    for file in &all {
        let copy = back.join(file.strip_prefix(pyramid).expect("it lies inside"));
        assert!(
            fs::read(file).ok() == fs::read(copy).ok(),
            "{}",
            file.display()
        );
    }
    let mut copies = Vec::new();
    files(&back, &mut copies);
    assert_eq!(all.len(), copies.len());
    drumlin_fails(2, ["pack", back_name, zip_name]);
    drumlin_fails(2, ["unpack", zip_name, back_name]);
    drumlin_ok(["pack", back_name, zip_name, "--overwrite"]);
    drumlin_ok(["unpack", zip_name, back_name, "--overwrite"]);
}

#[test]
fn damaged_archives_are_told_in_one_line() {
    let out = folder("pack-damaged");
    let zip = out.join("a.zip");
    let name = zip.to_str().expect("a plain name");
    drumlin_ok([
        "pack",
        rainier_pyramid().to_str().expect("a plain name"),
        name,
    ]);
    let good = fs::read(&zip).expect("the archive can be read");
    for length in [0, 1, 100, good.len() / 2, good.len() - 1] {
        fs::write(&zip, &good[..length]).expect("a file can be written");
        let line = drumlin_fails(1, ["info", name]);
        assert!(line.contains("a.zip"), "{line}");
    }
    let mut bad = good.clone();
    let middle = good.len() / 2;
    bad[middle] ^= 1;
    fs::write(&zip, &bad).expect("a file can be written");
    let line = drumlin_fails(
        1,
        ["unpack", name, out.join("b.zarr").to_str().expect("plain")],
    );
    assert!(line.contains("a.zip/tile/"), "{line}");
    assert_eq!(
        fs::read_dir(&out).expect("the folder can be read").count(),
        1
    );
}
