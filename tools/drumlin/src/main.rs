//! The `drumlin` command: elevation models in, pyramids out, and questions to pyramids.
//!
//! One verb, one file; the library does the work. Needs no GPU: `view` and `fly` run `drumlin-view`, which lives beside
//! this program.

mod arguments;
mod build;
mod cage;
mod diff;
mod export;
mod extract;
mod feature;
mod height;
mod info;
mod input_list;
mod interrupt;
mod pack;
mod plan;
mod progress;
mod serve;
mod sources;
mod synth;
mod validate;
mod viewer;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use drumlin_terminal::{
    outcome::{EXIT_CODES, Outcome},
    usage,
};

/// Large terrain: builds, inspects, checks and shows pyramids of elevation.
#[derive(Debug, Parser)]
#[command(name = "drumlin", version, after_help = EXIT_CODES, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Builds a pyramid from elevation models
    #[command(after_help = EXIT_CODES)]
    Build(build::Arguments),
    /// Writes a build down as tasks, for as many processes and machines as see its files
    #[command(after_help = EXIT_CODES)]
    Plan(plan::PlanArguments),
    /// Does one task of a plan, where it is not done; the passes before it are
    #[command(after_help = EXIT_CODES)]
    Task(plan::TaskArguments),
    /// Publishes the pyramid of a plan whose tasks are done
    #[command(after_help = EXIT_CODES)]
    Finish(plan::FinishArguments),
    /// Says what a pyramid holds
    #[command(after_help = EXIT_CODES)]
    Info(info::Arguments),
    /// Checks a pyramid's files
    #[command(after_help = EXIT_CODES)]
    Validate(validate::Arguments),
    /// Heights of places: of the finest samples, and of features where they stand (the highest of an overhang)
    #[command(after_help = EXIT_CODES)]
    Height(height::Arguments),
    /// Looks into a cage: counts, exact places of its surface, refinement
    #[command(after_help = EXIT_CODES)]
    Cage(cage::Arguments),
    /// Makes the cage of a cliff, an arch or a road, for `build --features`
    #[command(after_help = EXIT_CODES)]
    Feature(feature::Arguments),
    /// Compares the heights of two pyramids; exit code 1 where they differ
    #[command(after_help = EXIT_CODES)]
    Diff(diff::Arguments),
    /// Cuts a box out of a pyramid's level, as a GeoTIFF of exactly its heights
    #[command(after_help = EXIT_CODES)]
    Extract(extract::Arguments),
    /// Writes a pyramid's heights for other programs
    #[command(after_help = EXIT_CODES)]
    Export(export::Arguments),
    /// Makes one file of a pyramid: a ZIP archive, uncompressed, that every verb reads
    #[command(after_help = EXIT_CODES)]
    Pack(pack::PackArguments),
    /// Makes a folder of a pyramid's archive again
    #[command(after_help = EXIT_CODES)]
    Unpack(pack::UnpackArguments),
    /// Serves a pyramid's files over HTTP, with ranges, on this machine alone unless told otherwise
    #[command(after_help = EXIT_CODES)]
    Serve(serve::Arguments),
    /// Makes an elevation model: endless mountains, a function of a seed, the same on every machine
    #[command(after_help = EXIT_CODES)]
    Synth(synth::Arguments),
    /// Opens a window on a pyramid (`drumlin-view view`)
    #[command(disable_help_flag = true)]
    View(viewer::Arguments),
    /// Flies over a pyramid along a path and measures (`drumlin-view fly`)
    #[command(disable_help_flag = true)]
    Fly(viewer::Arguments),
}

fn main() -> ExitCode {
    let arguments: Arguments = match usage::parse(arguments::prepared(std::env::args_os())) {
        Ok(arguments) => arguments,
        Err(code) => return code,
    };
    let outcome = match arguments.verb {
        Verb::Build(arguments) => build::run(&arguments),
        Verb::Plan(arguments) => plan::run(&arguments),
        Verb::Task(arguments) => plan::run_one(&arguments),
        Verb::Finish(arguments) => plan::run_finish(&arguments),
        Verb::Info(arguments) => info::run(&arguments),
        Verb::Validate(arguments) => validate::run(&arguments),
        Verb::Height(arguments) => height::run(&arguments),
        Verb::Cage(arguments) => cage::run(&arguments),
        Verb::Feature(arguments) => feature::run(&arguments),
        Verb::Diff(arguments) => diff::run(&arguments),
        Verb::Extract(arguments) => extract::run(&arguments),
        Verb::Export(arguments) => export::run(&arguments),
        Verb::Pack(arguments) => pack::run_pack(&arguments),
        Verb::Unpack(arguments) => pack::run_unpack(&arguments),
        Verb::Serve(arguments) => serve::run(&arguments),
        Verb::Synth(arguments) => synth::run(&arguments),
        Verb::View(arguments) => viewer::run("view", &arguments),
        Verb::Fly(arguments) => viewer::run("fly", &arguments),
    };
    outcome
        .unwrap_or_else(|error| Outcome::of_error("drumlin", &error, |_| None))
        .exit_code()
}
