//! What `drumlin` and `drumlin-view` share at the terminal: exit codes, one-line errors, amounts of memory.

pub mod outcome;
pub mod size;
pub mod usage;

use std::io::{self, Write};

/// Prints to standard output; a reader that has gone away, as in `drumlin info … | head`, is no error.
///
/// # Errors
///
/// What the system said of anything else.
pub fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}
