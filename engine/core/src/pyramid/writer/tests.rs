//! What is refused, what survives a kill, what is equal for any number of threads.

use super::{place::is_pyramid, *};
use crate::pyramid::sample;

fn bytes_of(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap().map(Result::unwrap) {
            if entry.file_type().unwrap().is_dir() {
                folders.push(entry.path());
            } else {
                let name = entry.path().strip_prefix(folder).unwrap().to_path_buf();
                files.push((name, fs::read(entry.path()).unwrap()));
            }
        }
    }
    files.sort();
    files
}

#[test]
fn any_number_of_threads_writes_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let written = [1, 3].map(|threads| {
        let path = folder.path().join(format!("{threads}.zarr"));
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| sample::write(&path, 300, 200));
        bytes_of(&path)
    });
    assert!(written[0] == written[1]);
    let names: Vec<_> = written[0]
        .iter()
        .map(|(name, _)| name.to_str().unwrap())
        .collect();
    assert!(names.contains(&"zarr.json") && names.contains(&MANIFEST));
    assert!(!names.contains(&MARKER) && !names.contains(&JOURNAL));
}

#[test]
fn nothing_is_called_by_the_name_until_all_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    let writer = PyramidWriter::create(&path, false).unwrap();
    let shards = sample::write_with(&writer, 300, 200);
    assert!(!path.exists() && !folder.path().join("out.zarr.building/zarr.json").exists());
    writer
        .publish(&sample::metadata(300, 200), &shards)
        .unwrap();
    let names: Vec<_> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(names, ["out.zarr"]);
}

#[test]
fn what_is_no_pyramid_is_refused_and_left_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    let other = folder.path().join("other");
    fs::write(&file, "mine").unwrap();
    fs::create_dir(&other).unwrap();
    fs::write(
        other.join("zarr.json"),
        r#"{"zarr_format":3,"node_type":"group","attributes":{}}"#,
    )
    .unwrap();
    let before = bytes_of(folder.path());
    for path in [&file, &other] {
        for overwrite in [false, true] {
            assert!(matches!(
                PyramidWriter::create(path, overwrite),
                Err(PyramidError::Refused(_))
            ));
        }
    }
    assert!(bytes_of(folder.path()) == before);
}

#[test]
fn a_folder_in_the_way_of_the_build_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let way = folder.path().join("out.zarr.building");
    fs::create_dir(&way).unwrap();
    fs::write(way.join("thesis.txt"), "mine").unwrap();
    let refused = PyramidWriter::create(&folder.path().join("out.zarr"), true);
    assert!(matches!(refused, Err(PyramidError::Refused(_))));
    assert_eq!(fs::read_dir(way).unwrap().count(), 1);
}

#[test]
fn a_pyramid_is_replaced_only_when_asked_and_only_at_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    sample::write(&path, 100, 100);
    let old = bytes_of(&path);
    assert!(matches!(
        PyramidWriter::create(&path, false),
        Err(PyramidError::Refused(_))
    ));
    let writer = PyramidWriter::create(&path, true).unwrap();
    let shards = sample::write_with(&writer, 300, 200);
    assert!(bytes_of(&path) == old);
    writer
        .publish(&sample::metadata(300, 200), &shards)
        .unwrap();
    assert!(bytes_of(&path) != old);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn two_cannot_build_one_pyramid() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    let first = PyramidWriter::create(&path, false).unwrap();
    assert!(matches!(
        PyramidWriter::create(&path, false),
        Err(PyramidError::Refused(_))
    ));
    drop(first);
    PyramidWriter::create(&path, false)
        .unwrap()
        .discard()
        .unwrap();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_resumed_build_keeps_whole_shards_and_writes_broken_ones_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    let layout = RecordLayout::new(&sample::metadata(100, 100).levels[0]);
    let record = |_| Ok(Some(vec![1; layout.byte_count()]));
    let other = |_| Ok(Some(vec![2; layout.byte_count()]));
    let write = |fingerprint: &str, record: Contents<'_>| {
        let writer = PyramidWriter::resume(&path, false, fingerprint).unwrap();
        writer
            .write_shard(0, &layout, [1, 1], [0, 0], record)
            .unwrap()
    };
    let first = write("a", &record);
    assert_eq!(write("a", &other), first);
    let shard = folder.path().join("out.zarr.building").join(&first.key);
    let mut bytes = fs::read(&shard).unwrap();
    bytes[30] ^= 1;
    fs::write(&shard, bytes).unwrap();
    assert_eq!(write("a", &record), first);
    assert_ne!(write("b", &other), first);
    assert_eq!(write("", &record), first);
}

#[test]
fn an_old_pyramid_that_stepped_aside_gets_its_name_back() {
    let folder = tempfile::tempdir().unwrap();
    let [path, aside] = ["out.zarr", "out.zarr.replaced"].map(|name| folder.path().join(name));
    sample::write(&path, 100, 100);
    fs::rename(&path, &aside).unwrap();
    assert!(matches!(
        PyramidWriter::create(&path, false),
        Err(PyramidError::Refused(_))
    ));
    assert!(is_pyramid(&path).unwrap() && !aside.exists());
}

#[test]
fn publishing_without_all_shards_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    let writer = PyramidWriter::create(&path, false).unwrap();
    let mut shards = sample::write_with(&writer, 300, 200);
    shards.remove(0);
    assert!(matches!(
        writer.publish(&sample::metadata(300, 200), &shards),
        Err(PyramidError::Invalid { .. })
    ));
    assert!(!path.exists());
}
