//! `cargo verify`: everything that must hold. Warnings are errors, and a missing GPU is one too.

use std::{env, fs, path::PathBuf};

use anyhow::{Context, Result, bail, ensure};

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
    forget_packages()?;
    run("packages", &mut cargo(packages))?;
    println!("{tally}");
    Ok(())
}

/// Removes what an earlier run unpacked: Cargo keeps one copy of a package of this workspace for each version and would
/// build the next package against that old copy.
fn forget_packages() -> Result<()> {
    let home = env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(env::home_dir()?.join(".cargo")));
    let unpacked = home
        .context("there is neither CARGO_HOME nor a home folder")?
        .join("registry/src");
    let Ok(registries) = fs::read_dir(&unpacked) else {
        return Ok(());
    };
    for registry in registries {
        let registry = registry?;
        // A registry on this disk has no host, and its folder's name nothing before the dash.
        if !registry.file_name().to_string_lossy().starts_with('-') {
            continue;
        }
        for name in ["drumlin-shaders", "drumlin-core", "drumlin"] {
            let old = registry
                .path()
                .join(format!("{name}-{}", env!("CARGO_PKG_VERSION")));
            if old.exists() {
                fs::remove_dir_all(&old).with_context(|| old.display().to_string())?;
            }
        }
    }
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
