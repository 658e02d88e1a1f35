//! Measuring: runs and their median, the machine they ran on, tables for the terminal and JSON for the rest.
//!
//! Knows nothing of what is measured. One run is no result: a [`Timing`] keeps the median with the least and the
//! greatest, so that a reader sees how steady the machine was.

use std::{
    fmt::Write as _,
    fs,
    path::Path,
    process::Command,
    time::{Duration, Instant},
};

use anyhow::{Context as _, Result};
use cpu_time::ThreadTime;
use serde::Serialize;

/// Seconds of several runs of one thing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Timing {
    /// The median run.
    pub median: f64,
    /// The fastest run.
    pub least: f64,
    /// The slowest run.
    pub greatest: f64,
    /// How many runs.
    pub runs: usize,
}

impl Timing {
    /// Of runs that were timed elsewhere.
    ///
    /// # Panics
    /// When there is no run.
    #[must_use]
    pub fn of(mut seconds: Vec<f64>) -> Self {
        assert!(!seconds.is_empty(), "a timing needs a run");
        seconds.sort_by(f64::total_cmp);
        let runs = seconds.len();
        Self {
            median: 0.5 * (seconds[(runs - 1) / 2] + seconds[runs / 2]),
            least: seconds[0],
            greatest: seconds[runs - 1],
            runs,
        }
    }

    /// The median in milliseconds.
    #[must_use]
    pub fn millis(&self) -> f64 {
        1e3 * self.median
    }

    /// How many of `count` things a second, by the median.
    #[must_use]
    pub fn rate(&self, count: u64) -> f64 {
        count as f64 / self.median
    }
}

/// Which time counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// The clock on the wall.
    Wall,
    /// Seconds of this thread's processor, for work that it does alone: what else the machine does meanwhile does not
    /// count. On an idle machine the same as the wall's.
    Thread,
}

impl Clock {
    /// Seconds that `work` takes, and what it gives.
    pub fn time<T>(self, work: impl FnOnce() -> T) -> (f64, T) {
        match self {
            Self::Wall => timed(work, Instant::now, |start| start.elapsed()),
            Self::Thread => timed(work, ThreadTime::now, ThreadTime::elapsed),
        }
    }
}

/// Times `work` a number of times, at least once, after one run that is not counted; also what the last run gave.
/// What a run gives is dropped outside of its time.
pub fn median_of<T>(runs: usize, work: impl FnMut() -> T) -> (Timing, T) {
    clocked_median_of(Clock::Wall, runs, work)
}

/// [`median_of`] by [`Clock::Thread`].
pub fn thread_median_of<T>(runs: usize, work: impl FnMut() -> T) -> (Timing, T) {
    clocked_median_of(Clock::Thread, runs, work)
}

/// [`median_of`] by either clock.
pub fn clocked_median_of<T>(clock: Clock, runs: usize, mut work: impl FnMut() -> T) -> (Timing, T) {
    prepared_median_of(clock, runs, &mut (), |()| (), |()| work())
}

/// [`clocked_median_of`] of work that needs its state made ready before every run, outside of the time.
pub fn prepared_median_of<S, T>(
    clock: Clock,
    runs: usize,
    state: &mut S,
    mut prepare: impl FnMut(&mut S),
    mut work: impl FnMut(&mut S) -> T,
) -> (Timing, T) {
    prepare(state);
    let mut last = work(state);
    let mut seconds = Vec::with_capacity(runs.max(1));
    for _ in 0..runs.max(1) {
        prepare(state);
        let (time, result) = clock.time(|| work(state));
        seconds.push(time);
        last = result;
    }
    (Timing::of(seconds), last)
}

fn timed<T, Start>(
    work: impl FnOnce() -> T,
    now: fn() -> Start,
    since: fn(&Start) -> Duration,
) -> (f64, T) {
    let start = now();
    let result = std::hint::black_box(work());
    (since(&start).as_secs_f64(), result)
}

/// Runs `work` with a rayon pool of so many threads.
///
/// # Errors
/// When the threads cannot be started.
pub fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .context("starting the threads of a measurement")?;
    Ok(pool.install(work))
}

/// The geometric mean of ratios; NaN of none.
#[must_use]
pub fn geometric_mean(ratios: &[f64]) -> f64 {
    (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp()
}

/// What figures depend on besides the code: printed with them.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// The processor's own name.
    pub processor: String,
    /// Threads it runs at once.
    pub threads: usize,
    /// Commit of the code, `-dirty` when it has changed since; "unknown" outside of a repository.
    pub commit: String,
}

impl Machine {
    /// This machine.
    #[must_use]
    pub fn here() -> Self {
        let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let name = info.lines().find_map(|line| {
            let (key, value) = line.split_once(':')?;
            (key.trim() == "model name").then(|| value.trim().to_owned())
        });
        Self {
            processor: name.unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            commit: commit().unwrap_or_else(|| "unknown".to_owned()),
        }
    }

    /// One line for the terminal.
    #[must_use]
    pub fn line(&self) -> String {
        let Self {
            processor,
            threads,
            commit,
        } = self;
        format!("{processor}, {threads} threads, commit {commit}")
    }
}

fn commit() -> Option<String> {
    let output = Command::new("git")
        .args(["describe", "--always", "--dirty"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    (output.status.success()).then(|| text.trim().to_owned())
}

/// A table for the terminal, which is Markdown too: the first column to the left, the others to the right.
#[derive(Clone, Debug, Default)]
pub struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    /// With these column names.
    #[must_use]
    pub fn new(names: &[&str]) -> Self {
        let mut table = Self::default();
        table.row(names.iter().map(ToString::to_string));
        table
    }

    /// Adds a row; cells that are missing are empty.
    pub fn row<T: Into<String>>(&mut self, cells: impl IntoIterator<Item = T>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// The text, every line with its end.
    #[must_use]
    pub fn text(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let cell = |row: &Vec<String>, column: usize| row.get(column).cloned().unwrap_or_default();
        let widths: Vec<usize> = (0..columns)
            .map(|column| {
                let width = |row| cell(row, column).chars().count();
                self.rows.iter().map(width).max().unwrap_or(0).max(2)
            })
            .collect();
        let mut text = String::new();
        for (index, row) in self.rows.iter().enumerate() {
            for (column, &width) in widths.iter().enumerate() {
                let cell = cell(row, column);
                // Writing into a string cannot fail.
                let _ = if column == 0 {
                    write!(text, "| {cell:<width$} ")
                } else {
                    write!(text, "| {cell:>width$} ")
                };
            }
            text += "|\n";
            if index == 0 {
                text += &rule(&widths);
            }
        }
        text
    }
}

fn rule(widths: &[usize]) -> String {
    let cell = |(column, &width): (usize, &usize)| {
        let dashes = "-".repeat(width + 1);
        let end = if column == 0 { "-" } else { ":" };
        format!("|{dashes}{end}")
    };
    widths.iter().enumerate().map(cell).collect::<String>() + "|\n"
}

/// A whole number with commas between thousands.
#[must_use]
pub fn thousands(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A number with three digits that count, without an exponent.
#[must_use]
pub fn three_digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let before_point = value.abs().log10().floor() as i32 + 1;
    let decimals = usize::try_from(3 - before_point).unwrap_or(0);
    format!("{value:.decimals$}")
}

/// Writes a report as JSON.
///
/// # Errors
/// When the file cannot be written, with its name.
pub fn write_json(file: &Path, report: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(report)? + "\n";
    fs::write(file, text).with_context(|| format!("{}: writing failed", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_run_or_the_mean_of_the_middle_two() {
        let odd = Timing::of(vec![5.0, 1.0, 2.0]);
        assert_eq!((odd.median, odd.least, odd.greatest), (2.0, 1.0, 5.0));
        assert_eq!(Timing::of(vec![4.0, 1.0, 2.0, 8.0]).median, 3.0);
        let mut count = 0;
        let (timing, last) = median_of(3, || {
            count += 1;
            count
        });
        assert_eq!((timing.runs, last), (3, 4), "one run warms up");
    }

    #[test]
    fn a_thread_that_sleeps_uses_no_processor() {
        let nap = Duration::from_millis(20);
        let (wall, ()) = median_of(1, || std::thread::sleep(nap));
        let (thread, ()) = thread_median_of(1, || std::thread::sleep(nap));
        assert!(wall.least >= nap.as_secs_f64());
        assert!(thread.median < wall.median);
    }

    #[test]
    fn tables_are_aligned_markdown() {
        let mut table = Table::new(&["what", "count"]);
        table.row(["patches", "4,900"]);
        table.row(["points"]);
        let wanted =
            "| what    | count |\n|---------|------:|\n| patches | 4,900 |\n| points  |       |\n";
        assert_eq!(table.text(), wanted);
    }

    #[test]
    fn numbers_are_written_as_people_read_them() {
        assert_eq!(thousands(805_293), "805,293");
        assert_eq!(thousands(93), "93");
        assert_eq!(three_digits(0.012_345), "0.0123");
        assert_eq!(three_digits(12_345.6), "12346");
        assert_eq!(three_digits(2.5), "2.50");
    }

    #[test]
    fn equal_ratios_have_themselves_as_mean() {
        assert!((geometric_mean(&[2.0, 8.0]) - 4.0).abs() < 1e-12);
    }
}
