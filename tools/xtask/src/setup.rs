//! What has to be on the machine: a Vulkan driver to draw with, and for the tests a Python that reads Zarr and a browser.
//!
//! Whatever is missing is installed with apt; where that cannot be, the error is the line to type.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Result, bail};

use crate::step::{command, program, run, succeeds, target};

/// Sees to it that there is an adapter to draw with. Needs a built `drumlin-view`, which is asked for it.
pub(crate) fn adapter(profile: &str) -> Result<()> {
    let view = program(profile, "drumlin-view");
    let found = || succeeds(command(&view, &["adapter"]).env_remove("RUST_BACKTRACE"));
    if (!cfg!(target_os = "linux") || has_vulkan_driver()) && found() {
        return Ok(());
    }
    if !cfg!(target_os = "linux") {
        bail!("no graphics adapter found; install your graphics card's driver");
    }
    eprintln!("no graphics adapter found: installing the software Vulkan driver");
    apt(&["mesa-vulkan-drivers"])?;
    if !found() {
        run(
            "asking drumlin-view for an adapter",
            &mut command(&view, &["adapter"]),
        )?;
    }
    Ok(())
}

/// A Python with `zarr`, `numpy` and Dask, in an environment of its own under the target folder.
pub(crate) fn python() -> Result<PathBuf> {
    let folder = target().join("venv");
    let python = folder.join(if cfg!(windows) {
        "Scripts/python.exe"
    } else {
        "bin/python"
    });
    let ready = || {
        succeeds(&mut command(
            &python,
            &[
                "-c",
                "import distributed, numpy, zarr; assert zarr.__version__ >= '3'",
            ],
        ))
    };
    if ready() {
        return Ok(python);
    }
    let system = if cfg!(windows) { "python" } else { "python3" };
    let make = || {
        let mut make = command(system, &["-m", "venv", "--clear"]);
        make.arg(&folder);
        make
    };
    if !succeeds(&mut make()) {
        apt(&["python3", "python3-venv"])?;
        run("making a Python environment", &mut make())?;
    }
    let arguments = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        "numpy",
        "zarr>=3",
        "distributed",
    ];
    run(
        "installing zarr and Dask for Python",
        &mut command(&python, &arguments),
    )?;
    if !ready() {
        bail!(
            "{}: zarr 3 or Dask does not load; zarr needs Python 3.11 or later",
            python.display()
        );
    }
    Ok(python)
}

/// A Chromium to compile the shaders in. It is large, so only CI installs it; elsewhere none, and the test says so.
pub(crate) fn browser() -> Result<Option<&'static str>> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let found = || {
        names
            .into_iter()
            .find(|name| succeeds(&mut command(name, &["--version"])))
    };
    if let Some(name) = found() {
        return Ok(Some(name));
    }
    if std::env::var("CI").is_ok_and(|value| value == "true") {
        apt(&["chromium"])?;
    }
    Ok(found())
}

/// True when a Vulkan driver has announced itself to the loader.
fn has_vulkan_driver() -> bool {
    let named = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"]
        .iter()
        .find_map(std::env::var_os);
    if let Some(files) = named {
        return std::env::split_paths(&files).any(|file| file.exists());
    }
    [
        "/usr/share/vulkan/icd.d",
        "/usr/local/share/vulkan/icd.d",
        "/etc/vulkan/icd.d",
    ]
    .iter()
    .filter_map(|folder| Path::new(folder).read_dir().ok())
    .flatten()
    .any(|file| file.is_ok_and(|file| file.path().extension().is_some_and(|end| end == "json")))
}

/// Installs packages with apt, through sudo if we are not root.
fn apt(packages: &[&str]) -> Result<()> {
    let root = succeeds(&mut shell("test \"$(id -u)\" = 0"));
    let sudo = if root { "" } else { "sudo " };
    let line = format!(
        "{sudo}apt-get update && {sudo}apt-get install -y {}",
        packages.join(" ")
    );
    let able = succeeds(&mut shell(&format!(
        "command -v apt-get && {}",
        if root { "true" } else { "sudo -v" }
    )));
    if !able || !shell(&line).status().is_ok_and(|status| status.success()) {
        bail!(
            "{} is missing and could not be installed; type\n  {line}",
            packages.join(", ")
        );
    }
    Ok(())
}

fn shell(line: &str) -> Command {
    let mut shell = command("sh", &["-c", line]);
    shell.env("DEBIAN_FRONTEND", "noninteractive");
    shell
}
