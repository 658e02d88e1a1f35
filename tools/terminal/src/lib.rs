//! What `drumlin` and `drumlin-view` share at the terminal: exit codes, one-line errors, amounts of memory.

pub mod outcome;
pub mod size;
pub mod usage;

use std::{
    fs,
    io::{self, Write},
    path::Path,
};

use drumlin_core::pyramid::{PyramidError, write_whole};

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

/// Writes a file that is whole or not there; what is no plain file, as `/dev/stdout`, is written to as it is.
///
/// # Errors
///
/// What the system said, with the path.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), PyramidError> {
    if path.metadata().is_ok_and(|about| !about.is_file()) {
        return fs::write(path, bytes).map_err(PyramidError::io("writing", path));
    }
    write_whole(path, bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_a_folder_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.obj");
        write(&file, b"one").unwrap();
        write(&file, b"two").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"two");
        assert!(write(folder.path(), b"three").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
