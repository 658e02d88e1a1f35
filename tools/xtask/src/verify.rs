//! `cargo verify`: everything that must hold. Warnings are errors, and a missing GPU is one too.

use std::{
    env, fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail, ensure};

use crate::{
    setup,
    step::{cargo, run, target, watch},
    tally::Tally,
};

/// Format, clippy, programs, set-up, tests, docs, packages; stops at the first step that fails.
pub(crate) fn all() -> Result<()> {
    run("format", &mut cargo("fmt --all -- --check"))?;
    run(
        "clippy",
        &mut cargo("clippy --workspace --all-targets -- -D warnings"),
    )?;
    // The same set of features as the tests have, so that nothing is compiled twice.
    run(
        "programs",
        &mut cargo("build --workspace --bins --examples"),
    )?;
    setup::adapter("debug")?;
    let python = setup::python()?;
    let tally = tests(&python, setup::browser()?)?;
    run(
        "docs",
        cargo("doc --workspace --no-deps").env("RUSTDOCFLAGS", "-D warnings"),
    )?;
    let packages =
        "package --package drumlin-shaders --package drumlin-core --package drumlin --allow-dirty";
    // Apart from everything else, for what is compiled there is forgotten every time.
    let folder = target().join("packages");
    forget_packages(&folder)?;
    run("packages", cargo(packages).arg("--target-dir").arg(folder))?;
    println!("{tally}");
    Ok(())
}

/// Removes what an earlier run unpacked and compiled: Cargo takes a package of one version for unchangeable and would build
/// the next package against the old one.
fn forget_packages(compiled: &Path) -> Result<()> {
    let home = env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(env::home_dir()?.join(".cargo")));
    let home = home.context("there is neither CARGO_HOME nor a home folder")?;
    // A registry on this disk has no host, and its folder's name nothing before the dash.
    for registry in names(&home.join("registry/src"), "-") {
        names(&registry, "drumlin").try_for_each(remove)?;
    }
    names(&compiled.join("debug/.fingerprint"), "drumlin").try_for_each(remove)
}

/// What lies in a folder, if it is there, under names that begin so.
fn names(folder: &Path, start: &'static str) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .filter(move |entry| entry.file_name().to_string_lossy().starts_with(start))
        .map(|entry| entry.path())
}

fn remove(folder: PathBuf) -> Result<()> {
    fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())
}

/// Every test of the workspace, documentation included, on a GPU that keeps to the letter of WebGPU.
fn tests(python: &Path, browser: Option<&str>) -> Result<Tally> {
    let mut tests = cargo("test --workspace --no-fail-fast");
    tests
        .env("REQUIRE_GPU", "1")
        .env("STRICT_WEBGPU_COMPLIANCE", "1")
        .env("DRUMLIN_PYTHON", python);
    if let Some(browser) = browser {
        tests.env("DRUMLIN_BROWSER", browser);
    }
    let mut tally = Tally::default();
    let succeeded = watch("tests", &mut tests, |line| tally.see(line))?;
    if !succeeded || tally.failed > 0 {
        println!("{tally}");
        bail!("step `tests` failed");
    }
    ensure!(tally.passed > 0, "step `tests` ran no test");
    Ok(tally)
}
