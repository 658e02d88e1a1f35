//! `drumlin plan`, `task` and `finish`: a build as tasks, for as many processes and machines as see its files.
//!
//! ```text
//! PLAN    {"drumlin_plan": 1, "folder": …, "arguments": […], "sources": […]}
//!         {"task": 0, "pass": "read", "needs": null, …}
//!         {"task": 1, …}
//! ```
//!
//! The first line is what a task needs to know: the words that were typed after `plan`, where, and the inputs' hashes.
//! The others are for whoever hands out the tasks.

use std::{
    env,
    ffi::OsString,
    fs::File,
    io::{BufRead, BufReader, Read, Write},
    path::PathBuf,
};

use anyhow::{Context, Result, bail};
use clap::{Args, FromArgMatches, Parser};
use drumlin_core::pyramid::{
    PyramidError,
    build::{finish, plan_tasks, run_task},
};
use drumlin_terminal::{outcome::Outcome, print, write_new};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::{
    build::{self, Inputs, with_inputs},
    interrupt,
    sources::{Source, Sources},
};

/// The version of the plan's first line.
const VERSION: u32 = 1;
/// Bytes of the first line: a million inputs.
const HEAD_LIMIT: u64 = 1 << 30;

#[derive(Debug, Args)]
pub(crate) struct PlanArguments {
    #[command(flatten)]
    build: build::Arguments,
    /// The plan to write: JSON lines
    #[arg(long, value_name = "PLAN")]
    plan: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct TaskArguments {
    /// What `drumlin plan` wrote
    plan: PathBuf,
    /// The task's number
    #[arg(long, value_name = "N")]
    id: usize,
    /// Threads
    #[arg(short = 'j', long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: u16,
}

#[derive(Debug, Args)]
pub(crate) struct FinishArguments {
    /// What `drumlin plan` wrote
    plan: PathBuf,
    /// A summary for programs on standard output
    #[arg(long)]
    json: bool,
}

/// The first line of a plan.
#[derive(Serialize, Deserialize)]
struct Head {
    drumlin_plan: u32,
    /// Where relative paths start.
    folder: PathBuf,
    /// What was typed after the verb.
    arguments: Vec<String>,
    sources: Vec<Source>,
}

/// The words of a build, without the verb.
#[derive(Debug, Parser)]
struct Words {
    #[command(flatten)]
    plan: PlanArguments,
}

pub(crate) fn run(arguments: &PlanArguments) -> Result<Outcome> {
    if arguments.build.dry_run {
        bail!("a plan is dry: --dry-run goes with build");
    }
    let folder = env::current_dir().context("the working folder is unknown")?;
    let typed: Result<Vec<String>, OsString> =
        env::args_os().skip(2).map(OsString::into_string).collect();
    let typed = typed.map_err(|word| {
        PyramidError::Refused(format!(
            "{}: a plan is text, and this is none",
            word.display()
        ))
    })?;
    let mut sources = Sources::default();
    let tasks = with_inputs(&arguments.build, &mut sources, |inputs| {
        Ok(plan_tasks(inputs.raster, inputs.imagery, inputs.options)?)
    })?;
    let head = Head {
        drumlin_plan: VERSION,
        folder,
        arguments: typed,
        sources: sources.found,
    };
    let mut text = serde_json::to_vec(&head)?;
    text.push(b'\n');
    for task in &tasks {
        serde_json::to_writer(&mut text, task)?;
        text.push(b'\n');
    }
    let path = &arguments.plan;
    // Planning again is harmless, and what a plan replaces can only be a plan.
    let replaces = File::open(path).is_ok_and(|file| head_of(file).is_ok());
    write_new(path, replaces, |file| {
        file.write_all(&text)
            .map_err(PyramidError::io("writing", path))
    })?;
    let passes = tasks.chunk_by(|a, b| a.pass == b.pass).count();
    print(&if arguments.build.json {
        format!(
            "{:#}\n",
            json!({ "plan": path, "tasks": tasks.len(), "passes": passes })
        )
    } else {
        format!(
            "{}\n  {} tasks in {passes} passes\n",
            path.display(),
            tasks.len()
        )
    })?;
    Ok(Outcome::Done)
}

pub(crate) fn run_one(arguments: &TaskArguments) -> Result<Outcome> {
    let cancel = interrupt::flag()?;
    let (mut build, mut sources) = read(&arguments.plan)?;
    build.jobs = Some(arguments.jobs);
    with_inputs(&build, &mut sources, |inputs| {
        let Inputs {
            raster,
            imagery,
            options,
        } = inputs;
        let quiet = |_| ();
        Ok(run_task(
            raster,
            imagery,
            options,
            arguments.id,
            (&quiet, &cancel),
        )?)
    })?;
    Ok(Outcome::Done)
}

pub(crate) fn run_finish(arguments: &FinishArguments) -> Result<Outcome> {
    let (mut build, mut sources) = read(&arguments.plan)?;
    build.json |= arguments.json;
    let report = with_inputs(&build, &mut sources, |inputs| {
        Ok(finish(inputs.raster, inputs.imagery, inputs.options)?)
    })?;
    build::print_report(&build, &report)?;
    Ok(Outcome::Done)
}

/// The build of a plan, and its inputs; goes to the folder where it was planned.
fn read(plan: &PathBuf) -> Result<(build::Arguments, Sources)> {
    let file = File::open(plan).map_err(PyramidError::io("opening", plan))?;
    let head = head_of(file).map_err(|what| PyramidError::Invalid {
        path: plan.clone(),
        what,
    })?;
    env::set_current_dir(&head.folder).map_err(PyramidError::io("going to", &head.folder))?;
    let words = std::iter::once("drumlin plan").chain(head.arguments.iter().map(String::as_str));
    let invalid = |error: clap::Error| PyramidError::Invalid {
        path: plan.clone(),
        what: format!("holds words that no build has: {}", error.kind()),
    };
    let matches = <Words as clap::CommandFactory>::command()
        .try_get_matches_from(words)
        .map_err(invalid)?;
    let words = Words::from_arg_matches(&matches).map_err(invalid)?;
    Ok((words.plan.build, Sources::planned(head.sources)))
}

fn head_of(file: File) -> Result<Head, String> {
    let mut line = Vec::new();
    BufReader::new(file)
        .take(HEAD_LIMIT)
        .read_until(b'\n', &mut line)
        .map_err(|error| format!("reading failed: {error}"))?;
    let head: Head =
        serde_json::from_slice(&line).map_err(|_| "is not a plan of drumlin's".to_owned())?;
    if head.drumlin_plan != VERSION {
        return Err(format!(
            "is a plan of version {}; this program knows version {VERSION}",
            head.drumlin_plan
        ));
    }
    Ok(head)
}
