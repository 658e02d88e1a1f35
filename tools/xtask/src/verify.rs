//! `cargo verify`: everything that must hold. Warnings are errors, and a missing GPU is one too.

use anyhow::{Result, bail, ensure};

use crate::{
    setup,
    step::{cargo, run, watch},
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
    let tally = tests(&python)?;
    run(
        "docs",
        cargo("doc --workspace --no-deps").env("RUSTDOCFLAGS", "-D warnings"),
    )?;
    let packages =
        "package --package drumlin-shaders --package drumlin-core --package drumlin --allow-dirty";
    run("packages", &mut cargo(packages))?;
    println!("{tally}");
    Ok(())
}

/// Every test of the workspace, documentation included, on a GPU that keeps to the letter of WebGPU.
fn tests(python: &std::path::Path) -> Result<Tally> {
    let mut tests = cargo("test --workspace --no-fail-fast");
    tests
        .env("REQUIRE_GPU", "1")
        .env("STRICT_WEBGPU_COMPLIANCE", "1")
        .env("DRUMLIN_PYTHON", python);
    let mut tally = Tally::default();
    let succeeded = watch("tests", &mut tests, |line| tally.see(line))?;
    if !succeeded || tally.failed > 0 {
        println!("{tally}");
        bail!("step `tests` failed");
    }
    ensure!(tally.passed > 0, "step `tests` ran no test");
    Ok(tally)
}
