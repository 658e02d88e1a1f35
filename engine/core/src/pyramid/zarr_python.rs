//! The arrays open in zarr-python, from the folder and from an archive, and the lines of Python in `FORMAT.md` give our heights.
//!
//! Skipped with a message where there is no zarr-python; with `CI=true` that is a failure.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use super::{Pyramid, pack, sample, surface, write_whole_with};

/// What is done after the lines of `FORMAT.md`: every tile is compared with the file of heights, and with the shared
/// executable rule where that is at hand.
const COMPARE: &str = r#"
import pathlib, sys
folder, rule = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
root = zarr.open_group(folder / "out.zarr", mode="r")
if (rule / "tile_rule.py").exists():
    sys.path.insert(0, str(rule))
    import tile_rule
else:
    tile_rule = None
want, at = np.fromfile(folder / "heights", "<i4").reshape(-1, 129, 129), 0
for level in range(len(root.attrs["levels"])):
    array = root[f"tile/{level}"]
    assert array.dtype == "u1" and list(array.shape[:2]) == root.attrs["levels"][level]["tiles"], array
    for row in range(array.shape[0]):
        for column in range(array.shape[1]):
            cage, heights = tile(root, level, row, column)
            assert np.array_equal(heights, want[at]), (level, row, column)
            if tile_rule:
                it, width = root.attrs["levels"][level], root.attrs["levels"][level]["detail_bytes"]
                planes = array[row, column][-16641 * width:].view("i1").reshape(width, 129, 129)
                detail = sum(plane.astype(np.int64) << 8 * d for d, plane in enumerate(planes))
                assert np.array_equal(tile_rule.decode(cage, detail, it["step"]), heights)
                if not it["key"]:
                    parent = tile(root, level - 1, row // 2, column // 2)[0]
                    delta = cage - tile_rule.child_window(parent, row % 2, column % 2)
                    assert not (delta % it["step"]).any()
            at += 1
assert at == len(want)
color = root["color/0"]
assert color.shape == (1, 1, 256, 256, 4) and (color[0, 0] == 9).all()
assert root.attrs["proj:code"] == "EPSG:32610" and root.attrs["height_unit_metres"] == 1 / 16
packed = zarr.open_group(zarr.storage.ZipStore(folder / "out.zip", mode="r"), mode="r")
for level in range(len(root.attrs["levels"])):
    assert np.array_equal(packed[f"tile/{level}"][:], root[f"tile/{level}"][:]), level
assert packed.attrs.asdict() == root.attrs.asdict()
print("equal")
"#;

fn format_lines() -> String {
    let text = include_str!("../../FORMAT.md");
    let (_, rest) = text.split_once("```python\n").unwrap();
    rest.split_once("```").unwrap().0.to_owned()
}

/// The Python that `cargo verify` sets up, else the one on the path.
fn python() -> std::ffi::OsString {
    env::var_os("DRUMLIN_PYTHON").unwrap_or_else(|| "python3".into())
}

fn has_zarr() -> bool {
    let import = Command::new(python())
        .args(["-c", "import zarr; assert zarr.__version__ >= '3'"])
        .output();
    import.is_ok_and(|output| output.status.success())
}

/// The heights of all tiles, in the order the script reads them.
fn write_heights(pyramid: &Path, to: &Path) {
    let pyramid = Pyramid::open(pyramid).unwrap();
    let mut bytes = Vec::new();
    for id in sample::tiles(pyramid.metadata()) {
        let tile = pyramid.read_tile_chain(id).unwrap();
        let heights = surface::decode_heights(&tile.controls, &tile.detail, tile.step);
        bytes.extend(heights.iter().flat_map(|height| height.to_le_bytes()));
    }
    fs::write(to, bytes).unwrap();
}

/// What `FORMAT.md` says of imagery as JPEG, where its codec is at hand.
const COMPARE_JPEG: &str = r#"
import pathlib, sys
import numpy as np, zarr
try:
    import imagecodecs.zarr
except ImportError:
    print("no imagecodecs-zarr")
    sys.exit()
folder = pathlib.Path(sys.argv[1])
root = zarr.open_group(folder / "out.zarr", mode="r")
want = np.fromfile(folder / "texels", "u1").reshape(256, 256, 4)
color, alpha = root["color/0"], root["alpha/0"]
assert color.shape == (1, 1, 256, 256, 3) and alpha.shape == (1, 1, 256, 256)
assert np.array_equal(alpha[0, 0], want[..., 3])
seen = want[..., 3] > 0
away = np.abs(color[0, 0].astype(int) - want[..., :3])[seen]
# Decoders round differently; on the border we show what the border's own segment says.
assert np.median(away) <= 1 and away.mean() < 3, away.mean()
print("equal")
"#;

#[test]
fn zarr_python_reads_imagery_of_jpeg() {
    if !has_zarr() {
        println!("skipped: no zarr-python 3 here");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let pyramid = folder.path().join("out.zarr");
    let texels: Vec<u8> = (0..256 * 256_u32)
        .flat_map(|at| {
            let [row, column] = [at / 256, at % 256].map(|place| place.to_le_bytes()[0]);
            [row, column, 90, if row > 200 { 0 } else { 255 }]
        })
        .collect();
    sample::write_with_jpeg(&pyramid, &texels);
    let read = Pyramid::open(&pyramid)
        .unwrap()
        .read_color(crate::geo::TileId::ROOT);
    fs::write(folder.path().join("texels"), read.unwrap().unwrap()).unwrap();
    let script = folder.path().join("compare.py");
    fs::write(&script, COMPARE_JPEG).unwrap();
    let output = Command::new(python())
        .arg(&script)
        .arg(folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    let printed = String::from_utf8_lossy(&output.stdout);
    println!("{printed}");
    let fine = ["equal\n", "no imagecodecs-zarr\n"].contains(&&*printed);
    assert!(output.status.success() && fine, "{said}");
}

#[test]
fn zarr_python_reads_the_heights_we_read() {
    if !has_zarr() {
        assert!(
            env::var("CI").as_deref() != Ok("true"),
            "CI needs zarr-python 3 (pip install zarr)"
        );
        println!("skipped: no zarr-python 3 here");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let pyramid = folder.path().join("out.zarr");
    sample::write(&pyramid, 700, 300);
    let zip = folder.path().join("out.zip");
    write_whole_with(&zip, |file| {
        pack(&Pyramid::open(&pyramid)?, file, &zip, &mut |_, _| {})
    })
    .unwrap();
    write_heights(&pyramid, &folder.path().join("heights"));
    let script = folder.path().join("compare.py");
    fs::write(&script, format_lines() + COMPARE).unwrap();
    let rule = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference/tile");
    let output = Command::new(python())
        .arg(&script)
        .arg(folder.path())
        .arg(rule)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && output.stdout == b"equal\n",
        "{said}"
    );
}
