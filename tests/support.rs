//! What the end-to-end tests share: the commands, the sample data, pyramids built once, pictures.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::OnceLock,
};

use serde_json::Value;

/// The workspace's folder.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("tests lie in the workspace")
        .to_owned()
}

/// A file of the shared data, which a user's clone does not have: `None` says that it was skipped.
///
/// # Panics
/// On CI, where the shared data must be there.
pub(crate) fn shared(path: &str) -> Option<PathBuf> {
    let found = root().join("../shared").join(path);
    if found.exists() {
        return Some(found);
    }
    assert!(
        env::var_os("CI").is_none(),
        "{} is missing",
        found.display()
    );
    println!("skipped: ../shared/{path} is not here");
    None
}

/// The sample DEM: Mt Rainier, 1201 × 1201 samples of 3 arc seconds.
pub(crate) fn rainier() -> PathBuf {
    root().join("assets/mt_rainier_90m.tif")
}

/// A binary of the workspace, built beside this test.
///
/// # Panics
/// When it is not there: `cargo verify` builds it first.
pub(crate) fn binary(name: &str) -> PathBuf {
    let test = env::current_exe().expect("a test knows its own file");
    let folder = test
        .parent()
        .and_then(Path::parent)
        .expect("tests lie in target/PROFILE/deps");
    let path = folder.join(format!("{name}{}", env::consts::EXE_SUFFIX));
    assert!(
        path.exists(),
        "{} is missing: run `cargo build --workspace --bins --examples` first",
        path.display()
    );
    path
}

/// Runs `drumlin` to its end.
pub(crate) fn drumlin<S: AsRef<std::ffi::OsStr>>(arguments: impl IntoIterator<Item = S>) -> Output {
    Command::new(binary("drumlin"))
        .args(arguments)
        .env("COLUMNS", "100")
        .output()
        .expect("drumlin starts")
}

/// Runs `drumlin` and asks that it succeeds; gives back what it printed.
pub(crate) fn drumlin_ok<S: AsRef<std::ffi::OsStr>>(
    arguments: impl IntoIterator<Item = S>,
) -> String {
    let output = drumlin(arguments);
    assert!(output.status.success(), "{}", told(&output));
    String::from_utf8(output.stdout).expect("drumlin prints text")
}

/// Runs `drumlin`, asks that it succeeds, and reads what it printed as JSON.
pub(crate) fn drumlin_json<S: AsRef<std::ffi::OsStr>>(
    arguments: impl IntoIterator<Item = S>,
) -> Value {
    let text = drumlin_ok(arguments);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("not JSON ({error}): {text}"))
}

/// Runs `drumlin`, asks that it fails with an exit code and one clear line, and gives that line back.
pub(crate) fn drumlin_fails<S: AsRef<std::ffi::OsStr>>(
    code: i32,
    arguments: impl IntoIterator<Item = S>,
) -> String {
    let output = drumlin(arguments);
    let text = told(&output);
    assert_eq!(output.status.code(), Some(code), "{text}");
    let errors = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    assert!(!errors.is_empty() && !errors.contains("panicked"), "{text}");
    assert!(
        errors.lines().count() <= 3,
        "more than one clear line: {text}"
    );
    errors
}

/// Exit status and everything printed, for messages.
pub(crate) fn told(output: &Output) -> String {
    format!(
        "{}\nstdout: {}\nstderr: {}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    )
}

/// A folder that is the test binary's own and stays for a look afterwards: `target/tests/NAME`, emptied.
pub(crate) fn folder(name: &str) -> PathBuf {
    let path = root().join("target/tests").join(name);
    if path.exists() {
        fs::remove_dir_all(&path).expect("an old test folder can be removed");
    }
    fs::create_dir_all(&path).expect("a test folder can be made");
    path
}

/// The pyramid of the sample DEM, built once.
pub(crate) fn rainier_pyramid() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        let out = folder("rainier").join("rainier.zarr");
        drumlin_ok(
            [rainier().as_os_str(), "-o".as_ref(), out.as_os_str()]
                .into_iter()
                .fold(
                    vec!["build".as_ref()],
                    |mut all: Vec<&std::ffi::OsStr>, one| {
                        all.push(one);
                        all
                    },
                ),
        );
        out
    })
}

/// Copies a folder and all in it.
pub(crate) fn copy_tree(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder can be made");
    for entry in fs::read_dir(from).expect("the folder can be read") {
        let path = entry.expect("the entry can be read").path();
        let target = to.join(path.file_name().expect("an entry has a name"));
        if path.is_dir() {
            copy_tree(&path, &target);
        } else {
            fs::copy(&path, &target)
                .map(|_| ())
                .expect("a file can be copied");
        }
    }
}

/// Adds the paths of all files in a folder and below it.
pub(crate) fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder can be read") {
        let path = entry.expect("the entry can be read").path();
        if path.is_dir() {
            files(&path, found);
        } else {
            found.push(path);
        }
    }
}

/// True when pictures can be drawn; says so when they cannot.
///
/// # Panics
/// With `REQUIRE_GPU=1`, when there is no adapter.
pub(crate) fn has_gpu() -> bool {
    static FOUND: OnceLock<bool> = OnceLock::new();
    *FOUND.get_or_init(|| match drumlin::Headless::new() {
        Ok(_) => true,
        Err(error) => {
            assert!(env::var_os("REQUIRE_GPU").is_none(), "{error}");
            println!("skipped: {error}");
            false
        }
    })
}

/// One of GDAL's programs; `None` says that it was skipped: `cargo verify` does not set GDAL up.
pub(crate) fn gdal(program: &str) -> Option<Command> {
    let found = Command::new(program).arg("--version").output();
    if found.is_ok_and(|output| output.status.success()) {
        return Some(Command::new(program));
    }
    println!("skipped: no {program} here");
    None
}

/// The Python with zarr that `cargo verify` sets up; `None` says that it was skipped.
///
/// # Panics
/// On CI, where it must be there.
pub(crate) fn python() -> Option<PathBuf> {
    let python =
        env::var_os("DRUMLIN_PYTHON").map_or_else(|| PathBuf::from("python3"), PathBuf::from);
    let works = Command::new(&python)
        .args(["-c", "import zarr, numpy; assert zarr.__version__ >= '3'"])
        .output()
        .is_ok_and(|output| output.status.success());
    if works {
        return Some(python);
    }
    assert!(
        env::var_os("CI").is_none(),
        "{} has no zarr 3",
        python.display()
    );
    println!("skipped: {} has no zarr 3", python.display());
    None
}
