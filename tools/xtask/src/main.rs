//! `cargo demo` and `cargo verify`: everything a newcomer and the continuous checks need, set-up included.
//!
//! Knows the names of crates and commands; knows nothing of terrain.

mod demo;
mod setup;
mod step;
mod tally;
mod verify;

use std::process::ExitCode;

const USAGE: &str = "usage: cargo demo | cargo verify

  cargo demo     builds the pyramid of assets/ and flies over it: a window where there is a display, else pictures
  cargo verify   format, clippy, all tests, docs and packaging; warnings are errors";

fn main() -> ExitCode {
    let verbs: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match verbs.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["demo"] => demo::fly(),
        ["verify"] => verify::all(),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{} stopped: {error:#}", verbs[0]);
            ExitCode::FAILURE
        }
    }
}
