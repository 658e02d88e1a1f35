//! Exit codes, and how errors become one line and a code.

use std::{error::Error, process::ExitCode};

use drumlin_core::{cage::CageError, dem::DemError, pyramid::PyramidError};

/// What every verb's help says of its exit code.
pub const EXIT_CODES: &str = "Exit codes: 0 done, 1 invalid data, 2 wrong usage, 3 input or output failed, 4 interrupted (run again to go on)";

/// How a verb ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All went well.
    Done,
    /// What was read is not what it should be, or a device failed.
    InvalidData,
    /// What was asked for makes no sense or cannot be.
    Usage,
    /// The system refused to read or write.
    Io,
    /// Stopped on request; a second run goes on.
    Interrupted,
    /// How another program ended.
    Code(u8),
}

impl Outcome {
    /// The code the shell sees.
    #[must_use]
    pub fn exit_code(self) -> ExitCode {
        ExitCode::from(match self {
            Self::Done => 0,
            Self::InvalidData => 1,
            Self::Usage => 2,
            Self::Io => 3,
            Self::Interrupted => 4,
            Self::Code(code) => code,
        })
    }

    /// Says on standard error what went wrong, in one line that starts with the program's name, and what kind of wrong
    /// it was. `kind` knows errors of the caller's own.
    pub fn of_error(
        program: &str,
        error: &anyhow::Error,
        kind: impl Fn(&(dyn Error + 'static)) -> Option<Self>,
    ) -> Self {
        eprintln!("{program}: {}", one_line(error));
        error
            .chain()
            .find_map(|cause| kind(cause).or_else(|| Self::of(cause)))
            .unwrap_or(Self::Usage)
    }

    /// The kind of a pyramid's error.
    #[must_use]
    pub const fn of_pyramid(error: &PyramidError) -> Self {
        match error {
            PyramidError::Io { .. } | PyramidError::Dem(DemError::Io { .. }) => Self::Io,
            PyramidError::Refused(_) => Self::Usage,
            PyramidError::Interrupted | PyramidError::Changed(_) => Self::Interrupted,
            _ => Self::InvalidData,
        }
    }

    fn of(cause: &(dyn Error + 'static)) -> Option<Self> {
        if let Some(error) = cause.downcast_ref::<PyramidError>() {
            return Some(Self::of_pyramid(error));
        }
        if let Some(error) = cause.downcast_ref::<DemError>() {
            return Some(if matches!(error, DemError::Io { .. }) {
                Self::Io
            } else {
                Self::InvalidData
            });
        }
        if let Some(error) = cause.downcast_ref::<CageError>() {
            return Some(if matches!(error, CageError::Shape(_)) {
                Self::Usage
            } else {
                Self::InvalidData
            });
        }
        cause.is::<std::io::Error>().then_some(Self::Io)
    }
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
        let code = |error: anyhow::Error| Outcome::of_error("test", &error, |_| None);
        assert_eq!(
            code(PyramidError::io("writing", "a")(io()).into()),
            Outcome::Io
        );
        assert_eq!(
            code(PyramidError::Refused("no".into()).into()),
            Outcome::Usage
        );
        assert_eq!(
            code(PyramidError::Unfit("all void".into()).into()),
            Outcome::InvalidData
        );
        assert_eq!(code(PyramidError::Interrupted.into()), Outcome::Interrupted);
        assert_eq!(
            code(
                DemError::Io {
                    file: "a".into(),
                    source: io()
                }
                .into()
            ),
            Outcome::Io
        );
        let bad = DemError::Format {
            file: "a".into(),
            what: "not a TIFF".into(),
        };
        assert_eq!(code(PyramidError::Dem(bad).into()), Outcome::InvalidData);
        assert_eq!(code(anyhow::anyhow!("usage")), Outcome::Usage);
    }

    #[test]
    fn a_cause_is_told_once_and_on_one_line() {
        let error = PyramidError::io("writing", "a.zarr")(io::Error::other("disk\nfull"));
        let error = Err::<(), _>(error).context("building").unwrap_err();
        assert_eq!(
            one_line(&error),
            "building: a.zarr: writing failed: disk full"
        );
    }
}
