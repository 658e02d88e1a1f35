//! How far the work is: a bar with rate and time left on a terminal, silence elsewhere.

use std::{sync::Mutex, time::Duration};

use indicatif::{ProgressBar, ProgressStyle};

/// A bar that starts afresh with every stage. Told from any thread.
pub(crate) struct Progress {
    bar: ProgressBar,
    stage: Mutex<&'static str>,
}

impl Progress {
    /// A bar on standard error, where that is a terminal.
    pub(crate) fn new() -> Self {
        let bar = ProgressBar::no_length();
        let template =
            "{msg:>10} {wide_bar:.cyan/blue} {human_pos} of {human_len}, {per_sec}, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("━╸─"));
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self {
            bar,
            stage: Mutex::new(""),
        }
    }

    /// Says a line, above the bar where there is one.
    pub(crate) fn say(&self, line: &str) {
        self.bar.suspend(|| eprintln!("drumlin: {line}"));
    }

    /// So much of a stage is done.
    pub(crate) fn tell(&self, stage: &'static str, done: u64, total: u64) {
        let mut current = self
            .stage
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        if *current != stage {
            *current = stage;
            self.bar.reset();
            self.bar.set_message(stage);
        }
        self.bar.set_length(total);
        self.bar.set_position(done);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
