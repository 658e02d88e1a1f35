//! Named steps: one command each, from the workspace root, and a failure that says which step it was.

use std::{
    io::{BufRead, BufReader, Write},
    path::PathBuf,
    process::{Command, Stdio},
};

use anyhow::{Context, Result, ensure};

/// The folder that holds the workspace.
pub(crate) fn root() -> PathBuf {
    let manifest = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    manifest
        .ancestors()
        .nth(2)
        .map_or(manifest.clone(), Into::into)
}

/// Where cargo puts what it builds.
pub(crate) fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR")
        .map_or_else(|| root().join("target"), |folder| root().join(folder))
}

/// A built program of ours; `profile` is `debug` or `release`.
pub(crate) fn program(profile: &str, name: &str) -> PathBuf {
    target()
        .join(profile)
        .join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

/// A command that runs in the workspace root.
pub(crate) fn command(program: impl AsRef<std::ffi::OsStr>, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(root());
    command
}

/// The cargo that runs us, with arguments separated by blanks.
pub(crate) fn cargo(arguments: &str) -> Command {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    command(cargo, &arguments.split_whitespace().collect::<Vec<_>>())
}

/// Runs a step to its end; its failure carries the step's name.
pub(crate) fn run(name: &str, command: &mut Command) -> Result<()> {
    eprintln!("── {name}");
    let status = command
        .status()
        .with_context(|| format!("step `{name}` could not start"))?;
    ensure!(status.success(), "step `{name}` failed ({status})");
    Ok(())
}

/// Runs a step, showing its standard output and handing each line of it to `see`. True when it succeeded.
pub(crate) fn watch(name: &str, command: &mut Command, mut see: impl FnMut(&str)) -> Result<bool> {
    eprintln!("── {name}");
    let mut child = command
        .stdout(Stdio::piped())
        .spawn()
        .with_context(|| format!("step `{name}` could not start"))?;
    let lines = child.stdout.take().map(BufReader::new);
    let mut out = std::io::stdout();
    for line in lines.into_iter().flat_map(|reader| reader.split(b'\n')) {
        let line = line.with_context(|| format!("step `{name}`: its output broke off"))?;
        let line = String::from_utf8_lossy(&line);
        writeln!(out, "{line}")?;
        see(&line);
    }
    Ok(child.wait()?.success())
}

/// True when the command runs and succeeds; what it prints is dropped.
pub(crate) fn succeeds(command: &mut Command) -> bool {
    command
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}
