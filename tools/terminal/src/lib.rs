//! What `drumlin` and `drumlin-view` share at the terminal: exit codes, one-line errors, amounts of memory.

pub mod outcome;
pub mod size;
pub mod usage;

use std::{
    fs::{self, File},
    io::{self, ErrorKind, Write},
    path::{Path, PathBuf},
};

use drumlin_core::pyramid::{PyramidError, write_whole, write_whole_with};

/// Prints to standard output; a reader that has gone away, as in `drumlin info … | head`, is no error.
///
/// # Errors
///
/// What the system said of anything else.
pub fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

/// Writes a file that is whole or not there; what is no plain file, as `/dev/stdout`, is written to as it is. Of a link,
/// the file that it leads to is written. No folder is made.
///
/// # Errors
///
/// What the system said, with the path.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), PyramidError> {
    if path.metadata().is_ok_and(|about| !about.is_file()) {
        return fs::write(path, bytes).map_err(PyramidError::io("writing", path));
    }
    write_whole(&target(path)?, bytes)
}

/// As [`write()`], for large files that are written in pieces and whose places are gone back to. One that is there is
/// replaced only where `overwrite` says so.
///
/// # Errors
///
/// Refused where the file is there; what the system and `write` said.
pub fn write_new(
    path: &Path,
    overwrite: bool,
    write: impl FnOnce(&mut File) -> Result<(), PyramidError>,
) -> Result<(), PyramidError> {
    match path.metadata() {
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        Err(error) => return Err(PyramidError::io("looking at", path)(error)),
        Ok(about) if about.is_file() && overwrite => {}
        Ok(about) => {
            return Err(PyramidError::Refused(format!(
                "{}: {}",
                path.display(),
                if about.is_file() {
                    "is there already; `--overwrite` replaces it"
                } else {
                    "is there already, and no file"
                }
            )));
        }
    }
    write_whole_with(&target(path)?, write)
}

/// The file that is to be written: where a link leads to. Its folder must be there.
fn target(path: &Path) -> Result<PathBuf, PyramidError> {
    let failed = |error| PyramidError::io("writing", path)(error);
    let target = if path.is_symlink() {
        path.canonicalize().map_err(failed)?
    } else {
        path.to_owned()
    };
    let folder = target.parent().unwrap_or(Path::new(""));
    if !folder.as_os_str().is_empty() {
        folder.metadata().map_err(failed)?;
    }
    Ok(target)
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

    #[test]
    fn a_missing_folder_is_an_error_and_stays_missing() {
        let folder = tempfile::tempdir().unwrap();
        assert!(write(&folder.path().join("none/a.obj"), b"one").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_file_that_is_there_is_replaced_only_where_asked_and_only_by_a_whole_one() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.tif");
        let one = |overwrite, text: &'static [u8]| {
            write_new(&file, overwrite, |out| {
                out.write_all(text)
                    .map_err(PyramidError::io("writing", "a"))
            })
        };
        one(false, b"one").unwrap();
        assert!(matches!(one(false, b"two"), Err(PyramidError::Refused(_))));
        let half = write_new(&file, true, |out| {
            let _ = out.write_all(b"ha");
            Err(PyramidError::Interrupted)
        });
        assert!(half.is_err() && fs::read(&file).unwrap() == b"one");
        one(true, b"two").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"two");
        assert!(write_new(folder.path(), true, |_| Ok(())).is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_and_what_it_leads_to_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, nowhere] = ["a", "b", "c"].map(|name| folder.path().join(name));
        fs::write(&file, b"one").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write(&link, b"two").unwrap();
        assert!(link.is_symlink() && fs::read(&file).unwrap() == b"two");
        std::os::unix::fs::symlink(folder.path().join("none"), &nowhere).unwrap();
        assert!(write(&nowhere, b"three").is_err() && nowhere.is_symlink());
    }
}
