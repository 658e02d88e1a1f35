//! One run of a command, measured by GNU time.

use std::{fs, path::Path, process::Command};

use anyhow::{Context as _, Result, bail, ensure};
use serde::Serialize;

/// What one run took.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Run {
    /// Processor seconds, user and system, of all threads.
    pub(crate) cpu: f64,
    /// Seconds by the clock.
    pub(crate) wall: f64,
    /// Peak resident memory, bytes.
    pub(crate) rss: u64,
}

/// Runs a command to its end; it must succeed.
pub(crate) fn measured(command: &[String], folder: &Path) -> Result<Run> {
    let told = folder.join("time");
    let output = Command::new("/usr/bin/time")
        .args(["-f", "%U %S %e %M", "-o"])
        .arg(&told)
        .args(command)
        .output()
        .context("/usr/bin/time: starting failed (`apt install time`)")?;
    if !output.status.success() {
        bail!(
            "`{}` failed ({}): {}",
            command.join(" "),
            output.status,
            String::from_utf8_lossy(&output.stderr).trim()
        );
    }
    let text =
        fs::read_to_string(&told).with_context(|| format!("{}: reading failed", told.display()))?;
    let numbers: Vec<f64> = text
        .split_whitespace()
        .filter_map(|number| number.parse().ok())
        .collect();
    ensure!(
        numbers.len() == 4,
        "{}: {text:?} is no measurement",
        told.display()
    );
    Ok(Run {
        cpu: numbers[0] + numbers[1],
        wall: numbers[2],
        // GNU time counts in KiB.
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number of KiB"
        )]
        rss: numbers[3] as u64 * 1024,
    })
}

/// The median of each figure by itself.
pub(crate) fn median(runs: &[Run]) -> Run {
    let middle = |figure: &dyn Fn(&Run) -> f64| {
        let mut all: Vec<f64> = runs.iter().map(figure).collect();
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "bytes of memory"
    )]
    let rss = middle(&|run| run.rss as f64) as u64;
    Run {
        cpu: middle(&|run| run.cpu),
        wall: middle(&|run| run.wall),
        rss,
    }
}
