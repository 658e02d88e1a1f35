//! How long the first picture of a flight takes, counted from the process's start.

use std::time::{Duration, Instant};

use anyhow::Result;
use cpu_time::ProcessTime;
use drumlin::Headless;
use serde::Serialize;

use crate::stopwatch::millis;

/// From the process's start to the first picture, milliseconds.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Start {
    /// Making the device, the driver's own work; by the wall clock.
    pub(crate) device_millis: f64,
    /// Everything else by the wall clock, until the device had finished the first frame that shows terrain; null where
    /// none does.
    pub(crate) first_picture_millis: Option<f64>,
    /// Work of all threads of the process in that time, the driver's included.
    pub(crate) first_picture_cpu_millis: Option<f64>,
    #[serde(skip)]
    process_start: Instant,
    /// Work of all threads on the device.
    #[serde(skip)]
    device_work: Duration,
}

impl Start {
    /// Makes the device, and measures that; `process_start` is where the wait for the first picture began.
    pub(crate) fn with_device(process_start: Instant) -> Result<(Headless, Self)> {
        let (clock, work) = (Instant::now(), ProcessTime::now());
        let headless = Headless::new()?;
        let start = Self {
            device_millis: millis(clock.elapsed()),
            first_picture_millis: None,
            first_picture_cpu_millis: None,
            process_start,
            device_work: work.elapsed(),
        };
        Ok((headless, start))
    }

    /// True once the first picture was there.
    pub(crate) fn is_over(&self) -> bool {
        self.first_picture_millis.is_some()
    }

    /// The first picture is there.
    pub(crate) fn end(&mut self) {
        let work = ProcessTime::now().as_duration();
        self.first_picture_millis = Some(millis(self.process_start.elapsed()) - self.device_millis);
        self.first_picture_cpu_millis = Some(millis(work.saturating_sub(self.device_work)));
    }

    /// A line for the terminal; none before the first picture.
    pub(crate) fn line(&self) -> String {
        let device = self.device_millis;
        let times = self.first_picture_millis.zip(self.first_picture_cpu_millis);
        times.map_or_else(String::new, |(first, work)| {
            format!(
                "first picture after {first:.0} ms ({work:.0} ms of work), beside {device:.0} ms for the device\n"
            )
        })
    }
}
