//! What the end-to-end tests share.

pub mod scene;

use drumlin::Headless;

/// A device; none, said aloud, where there is no adapter and `REQUIRE_GPU` does not insist.
///
/// # Panics
///
/// Where `REQUIRE_GPU=1` and there is no adapter.
#[must_use]
pub fn gpu() -> Option<Headless> {
    match Headless::new() {
        Ok(gpu) => Some(gpu),
        Err(error) if std::env::var("REQUIRE_GPU").is_ok_and(|value| value == "1") => {
            panic!("{error}")
        }
        Err(error) => {
            println!("skipped: {error}");
            None
        }
    }
}
