//! The tasks of a build, pass by pass: what they are, and how they are done, gone on with, or left to others.
//!
//! A pass starts when the one before is done; its tasks know nothing of each other, and each is the only one to write
//! a file of the planes that it makes (4096 × 4096 samples), or a shard. What a task is does not depend on memory or
//! threads: those decide into which blocks it is cut. One process does the blocks of all tasks, or many do a task each,
//! in whichever order the passes allow.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use serde::{Serialize, de::DeserializeOwned};

use super::journal::{Journal, Made};
use super::options::Watch;
use super::scratch::Check;
use crate::pyramid::PyramidError;
use crate::pyramid::writer::holds;

/// A pass of a build.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Pass {
    /// Its name, as `fit-3`.
    pub(super) name: String,
    /// How many tasks it is.
    pub(super) tasks: usize,
    /// Samples that all of them go over; bytes, where it is imagery.
    pub(super) samples: u64,
    /// The planes it reads.
    pub(super) reads: Vec<String>,
    /// The planes or arrays it writes.
    pub(super) writes: Vec<String>,
}

/// What is wanted of a build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Want {
    /// All of it.
    Whole,
    /// One task, counted over all passes; the passes before are done.
    Task(usize),
    /// What comes after the tasks, which are done.
    Finish,
}

/// Does tasks.
pub(super) struct Tasks<'a> {
    pub(super) passes: Vec<Pass>,
    pub(super) want: Want,
    /// Where the shards are.
    pub(super) folder: PathBuf,
    pub(super) watch: &'a Watch<'a>,
    pub(super) journal: Journal,
    /// Tasks that had been done before.
    pub(super) kept: AtomicUsize,
    /// The one task that was wanted is done.
    pub(super) done: AtomicBool,
}

/// What a pass asks for.
pub(super) struct Job<'a> {
    /// Its name.
    pub(super) pass: &'a str,
    /// The planes it writes.
    pub(super) planes: &'a [&'a dyn Check],
    /// A block is work for all threads: one at a time.
    pub(super) in_turn: bool,
    /// Hears of finished blocks, and says whether to go on.
    pub(super) advance: &'a (dyn Fn(u64) -> Result<(), PyramidError> + Sync),
}

impl Tasks<'_> {
    /// Does the tasks of a pass, each of some blocks, and joins what they find, in whatever order it comes.
    ///
    /// Tasks that are done are kept where what they wrote is as they left it.
    ///
    /// # Errors
    /// What the work says; [`PyramidError::Interrupted`] also where another task was wanted and is done now;
    /// [`PyramidError::Refused`] where this pass had to be done before.
    pub(super) fn run<B: Send, R: Default + Send + Serialize + DeserializeOwned>(
        &self,
        job: &Job<'_>,
        blocks: impl Fn(usize) -> Vec<B> + Sync,
        work: impl Fn(B) -> Result<Made<R>, PyramidError> + Sync,
        join: impl Fn(R, R) -> R + Sync,
    ) -> Result<Made<R>, PyramidError> {
        let (pass, first) = self.pass(job.pass)?;
        let wanted: Vec<usize> = match self.want {
            Want::Whole => (0..pass.tasks).collect(),
            Want::Task(task) if (first..first + pass.tasks).contains(&task) => vec![task - first],
            _ => return self.believed(pass, first, join),
        };
        let kept: Vec<Option<Made<R>>> = wanted
            .par_iter()
            .map(|task| self.kept(job, *task))
            .collect();
        let (mut all, mut open) = (Made::default(), Vec::new());
        for (task, kept) in wanted.into_iter().zip(kept) {
            let blocks = blocks(task);
            if let Some(kept) = kept {
                self.kept.fetch_add(1, Ordering::Relaxed);
                (job.advance)(blocks.len() as u64)?;
                all = all.and(kept, &join);
            } else {
                if blocks.is_empty() {
                    let none = Made::<R>::default();
                    self.journal.write(&pass.name, &task.to_string(), &none)?;
                }
                let state = Mutex::new((blocks.len(), Made::default()));
                open.push((blocks, (task, state)));
            }
        }
        let (todo, states): (Vec<_>, Vec<_>) = open.into_iter().unzip();
        let todo = todo
            .into_iter()
            .zip(&states)
            .flat_map(|(blocks, state)| blocks.into_iter().map(move |block| (block, state)));
        let step = |(block, (task, state)): (B, &(usize, Mutex<_>))| {
            self.watch.check()?;
            let made = work(block)?;
            let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
            let (left, all): &mut (usize, Made<R>) = &mut state;
            *all = std::mem::take(all).and(made, &join);
            *left -= 1;
            if *left == 0 {
                self.journal.write(&pass.name, &task.to_string(), all)?;
            }
            drop(state);
            (job.advance)(1)
        };
        if job.in_turn {
            todo.into_iter().try_for_each(step)?;
        } else {
            todo.par_bridge().try_for_each(step)?;
        }
        if self.want != Want::Whole {
            self.done.store(true, Ordering::Relaxed);
            return Err(PyramidError::Interrupted);
        }
        for (_, state) in states {
            let (_, made) = state.into_inner().unwrap_or_else(PoisonError::into_inner);
            all = all.and(made, &join);
        }
        all.written.clear();
        Ok(all)
    }

    /// A pass of so many tasks by itself, for tests.
    #[cfg(test)]
    pub(super) fn of_pass<'a>(
        name: &str,
        count: usize,
        folder: &std::path::Path,
        watch: &'a Watch<'a>,
    ) -> Tasks<'a> {
        Tasks {
            passes: vec![Pass {
                name: name.to_owned(),
                tasks: count,
                samples: 0,
                reads: Vec::new(),
                writes: Vec::new(),
            }],
            want: Want::Whole,
            folder: folder.to_owned(),
            watch,
            journal: Journal::new(folder.join("journal")),
            kept: AtomicUsize::new(0),
            done: AtomicBool::new(false),
        }
    }

    /// A pass, and its first task's number over all passes.
    fn pass(&self, name: &str) -> Result<(&Pass, usize), PyramidError> {
        let at = self.passes.iter().position(|pass| pass.name == name);
        let at = at.ok_or_else(|| PyramidError::Refused(format!("there is no pass {name}")))?;
        let before = self.passes[..at].iter().map(|pass| pass.tasks);
        Ok((&self.passes[at], before.sum()))
    }

    /// What an earlier run made of a task, where it is as it was left.
    fn kept<R: DeserializeOwned>(&self, job: &Job<'_>, task: usize) -> Option<Made<R>> {
        let made = self.journal.read::<R>(job.pass, &task.to_string())?;
        let written = made
            .written
            .iter()
            .all(|written| job.planes.iter().any(|plane| plane.holds(written)));
        let whole = || made.shards.iter().all(|shard| holds(&self.folder, shard));
        (written && whole()).then_some(made)
    }

    /// What others have found of a pass.
    fn believed<R: Default + Serialize + DeserializeOwned>(
        &self,
        pass: &Pass,
        first: usize,
        join: impl Fn(R, R) -> R,
    ) -> Result<Made<R>, PyramidError> {
        const ALL: &str = "all";
        if let Some(all) = self.journal.read(&pass.name, ALL) {
            return Ok(all);
        }
        let mut all = Made::default();
        for task in 0..pass.tasks {
            let made = self.journal.read(&pass.name, &task.to_string());
            let made = made.ok_or_else(|| {
                PyramidError::Refused(format!(
                    "task {} ({} {task}) has to be done first",
                    first + task,
                    pass.name
                ))
            })?;
            all = all.and(made, &join);
        }
        all.written.clear();
        self.journal.write(&pass.name, ALL, &all)?;
        Ok(all)
    }
}
