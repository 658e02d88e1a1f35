//! Reading elevation models and imagery.

/// Placeholder until the readers land.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[error("no reader")]
pub struct DemError;
