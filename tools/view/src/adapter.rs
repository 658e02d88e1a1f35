//! `drumlin-view adapter`: which graphics adapter would draw.

use anyhow::Result;
use drumlin::{Headless, wgpu};
use drumlin_terminal::{outcome::Outcome, print};

/// Prints the adapter; fails, with what to install, where there is none.
pub(crate) fn run() -> Result<Outcome> {
    let headless = Headless::new()?;
    print(&format!(
        "{}\n{}\n",
        name(&headless.adapter),
        driver(&headless.adapter)
    ))?;
    Ok(Outcome::Done)
}

/// Name, interface and kind.
pub(crate) fn name(adapter: &wgpu::AdapterInfo) -> String {
    format!(
        "{} ({}, {:?})",
        adapter.name, adapter.backend, adapter.device_type
    )
}

/// The driver and its version.
pub(crate) fn driver(adapter: &wgpu::AdapterInfo) -> String {
    format!("{} {}", adapter.driver, adapter.driver_info)
        .trim()
        .to_owned()
}
