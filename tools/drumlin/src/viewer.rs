//! `drumlin view` and `drumlin fly`: hand over to `drumlin-view`, which lives beside this program so that a build
//! server needs no GPU library.

use std::{ffi::OsString, path::PathBuf, process::Command};

use anyhow::{Context, Result};
use clap::Args;
use drumlin_terminal::outcome::Outcome;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Handed over as they are
    #[arg(
        trailing_var_arg = true,
        allow_hyphen_values = true,
        value_name = "ARGUMENTS"
    )]
    rest: Vec<OsString>,
}

pub(crate) fn run(verb: &str, arguments: &Arguments) -> Result<Outcome> {
    let program = beside_us()?;
    let mut command = Command::new(&program);
    command.arg(verb).args(&arguments.rest);
    let missing = || {
        let file = program.display();
        format!(
            "{file}: cannot be run; `{verb}` lives in drumlin-view, which belongs beside drumlin"
        )
    };
    let status = hand_over(&mut command).with_context(missing)?;
    Ok(Outcome::Code(status))
}

fn beside_us() -> Result<PathBuf> {
    let us = std::env::current_exe().context("this program cannot find itself")?;
    let us = us.canonicalize().unwrap_or(us);
    Ok(us.with_file_name(format!("drumlin-view{}", std::env::consts::EXE_SUFFIX)))
}

/// Becomes the other program, so that signals and exit codes need no passing on. Returns only when that fails.
#[cfg(unix)]
fn hand_over(command: &mut Command) -> std::io::Result<u8> {
    use std::os::unix::process::CommandExt;
    Err(command.exec())
}

#[cfg(not(unix))]
fn hand_over(command: &mut Command) -> std::io::Result<u8> {
    let code = command.status()?.code().unwrap_or(1);
    Ok(u8::try_from(code).unwrap_or(1))
}
