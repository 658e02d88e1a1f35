//! Exit codes, and how errors become one line and a code.

use std::process::ExitCode;

use drumlin_core::{dem::DemError, pyramid::PyramidError};

/// What every verb's help says of its exit code.
pub(crate) const EXIT_CODES: &str =
    "Exit codes: 0 done, 1 invalid data, 2 wrong usage, 3 input or output failed, 4 interrupted (run again to go on)";

/// How a verb ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    Done,
    InvalidData,
    Usage,
    Io,
    Interrupted,
    /// Of another program.
    #[cfg_attr(unix, expect(dead_code, reason = "where a program can become another, nothing comes back"))]
    Code(u8),
}

impl Outcome {
    /// Says on standard error what went wrong, in one line, and what kind of wrong it was.
    pub(crate) fn of_error(error: anyhow::Error) -> Self {
        eprintln!("drumlin: {}", one_line(&error));
        Self::of(&error)
    }

    fn of(error: &anyhow::Error) -> Self {
        for cause in error.chain() {
            if let Some(error) = cause.downcast_ref::<PyramidError>() {
                return Self::of_pyramid(error);
            }
            if let Some(error) = cause.downcast_ref::<DemError>() {
                return Self::of_dem(error);
            }
            if cause.is::<std::io::Error>() {
                return Self::Io;
            }
        }
        Self::Usage
    }

    fn of_pyramid(error: &PyramidError) -> Self {
        match error {
            PyramidError::Io { .. } => Self::Io,
            PyramidError::Refused(_) => Self::Usage,
            PyramidError::Interrupted => Self::Interrupted,
            PyramidError::Dem(error) => Self::of_dem(error),
            _ => Self::InvalidData,
        }
    }

    const fn of_dem(error: &DemError) -> Self {
        if matches!(error, DemError::Io { .. }) { Self::Io } else { Self::InvalidData }
    }
}

/// The code the shell sees.
pub(crate) fn exit_code(outcome: Outcome) -> ExitCode {
    ExitCode::from(match outcome {
        Outcome::Done => 0,
        Outcome::InvalidData => 1,
        Outcome::Usage => 2,
        Outcome::Io => 3,
        Outcome::Interrupted => 4,
        Outcome::Code(code) => code,
    })
}

/// The error and its causes, leaving out a cause that the text before it already ends with.
fn one_line(error: &anyhow::Error) -> String {
    let mut line = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if line.is_empty() {
            line = cause;
        } else if !line.ends_with(&cause) {
            line = format!("{line}: {cause}");
        }
    }
    line.replace('\n', " ")
}

#[cfg(test)]
mod tests {
    use std::io;

    use anyhow::Context;

    use super::*;

    #[test]
    fn errors_have_the_documented_codes() {
        let io = || io::Error::new(io::ErrorKind::StorageFull, "disk full");
        let code = |error: anyhow::Error| Outcome::of(&error);
        assert_eq!(code(PyramidError::io("writing", "a")(io()).into()), Outcome::Io);
        assert_eq!(code(PyramidError::Refused("no".into()).into()), Outcome::Usage);
        assert_eq!(code(PyramidError::Interrupted.into()), Outcome::Interrupted);
        assert_eq!(code(DemError::Io { file: "a".into(), source: io() }.into()), Outcome::Io);
        let bad = DemError::Format { file: "a".into(), what: "not a TIFF".into() };
        assert_eq!(code(PyramidError::Dem(bad).into()), Outcome::InvalidData);
        assert_eq!(code(anyhow::anyhow!("usage")), Outcome::Usage);
    }

    #[test]
    fn a_cause_is_told_once_and_on_one_line() {
        let error = PyramidError::io("writing", "a.zarr")(io::Error::other("disk\nfull"));
        let error = Err::<(), _>(error).context("building").unwrap_err();
        assert_eq!(one_line(&error), "building: a.zarr: writing failed: disk full");
    }
}
