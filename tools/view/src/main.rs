//! `drumlin-view`: the viewer and the flythrough benchmark; `drumlin view` and `drumlin fly` run it.

mod adapter;
mod arguments;
mod auto_path;
mod camera;
mod cameras;
mod controls;
mod data_set;
mod depth_frames;
mod fly;
mod frames;
mod path;
mod report;
mod scene;
mod screen;
mod sky;
mod start;
mod stopwatch;
mod view;
mod viewer;

use std::{error::Error, process::ExitCode, time::Instant};

use drumlin::RenderError;
use drumlin_terminal::{outcome::Outcome, usage};

use crate::arguments::{Arguments, Verb};

fn main() -> ExitCode {
    let start = Instant::now();
    let arguments: Arguments = match usage::parse(std::env::args_os()) {
        Ok(arguments) => arguments,
        Err(code) => return code,
    };
    let outcome = match arguments.verb {
        Verb::Adapter => adapter::run(),
        Verb::Fly(arguments) => fly::run(&arguments, start),
        Verb::View(arguments) => view::run(arguments),
    };
    outcome
        .unwrap_or_else(|error| Outcome::of_error("drumlin-view", &error, kind))
        .exit_code()
}

/// What kind of wrong the renderer's errors are.
fn kind(error: &(dyn Error + 'static)) -> Option<Outcome> {
    Some(match error.downcast_ref::<RenderError>()? {
        RenderError::Pyramid(error) => Outcome::of_pyramid(error),
        RenderError::BudgetTooSmall { .. } => Outcome::Usage,
        _ => Outcome::InvalidData,
    })
}
