//! The `drumlin` command: elevation models in, pyramids out, and questions to pyramids.
//!
//! One verb, one file; the library does the work. Needs no GPU: `view` and `fly` run `drumlin-view`, which lives beside
//! this program.

mod arguments;
mod build;
mod height;
mod info;
mod interrupt;
mod outcome;
mod progress;
mod size;
mod validate;
mod viewer;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::outcome::Outcome;

/// Large terrain: builds, inspects, checks and shows pyramids of elevation.
#[derive(Debug, Parser)]
#[command(name = "drumlin", version, after_help = outcome::EXIT_CODES, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Builds a pyramid from elevation models
    #[command(after_help = outcome::EXIT_CODES)]
    Build(build::Arguments),
    /// Says what a pyramid holds
    #[command(after_help = outcome::EXIT_CODES)]
    Info(info::Arguments),
    /// Checks a pyramid's files
    #[command(after_help = outcome::EXIT_CODES)]
    Validate(validate::Arguments),
    /// Heights of places, of the surface as stored at the finest level
    #[command(after_help = outcome::EXIT_CODES)]
    Height(height::Arguments),
    /// Opens a window on a pyramid (`drumlin-view view`)
    #[command(disable_help_flag = true)]
    View(viewer::Arguments),
    /// Flies over a pyramid along a path and measures (`drumlin-view fly`)
    #[command(disable_help_flag = true)]
    Fly(viewer::Arguments),
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse_from(arguments::prepared(std::env::args_os())).verb {
        Verb::Build(arguments) => build::run(&arguments),
        Verb::Info(arguments) => info::run(&arguments),
        Verb::Validate(arguments) => validate::run(&arguments),
        Verb::Height(arguments) => height::run(&arguments),
        Verb::View(arguments) => viewer::run("view", &arguments),
        Verb::Fly(arguments) => viewer::run("fly", &arguments),
    };
    outcome::exit_code(outcome.unwrap_or_else(Outcome::of_error))
}
