//! The names around a pyramid under construction: what may be replaced, who builds, what is left of an earlier run.

use std::{
    fs::{self, File, TryLockError},
    io::{ErrorKind, Seek, Write},
    path::Path,
};

use super::{MARKER, PASSES, SCRATCH};
use crate::pyramid::{
    PyramidError,
    files::{remove_folder, sibling},
    zarr,
};

/// True for a folder with a pyramid's root in it, of whatever version.
pub(super) fn is_pyramid(path: &Path) -> bool {
    fs::read(path.join(zarr::NODE)).is_ok_and(|bytes| zarr::is_root(&bytes))
}

/// Refuses what is no name, and what must not be replaced.
pub(in crate::pyramid) fn check_target(path: &Path, overwrite: bool) -> Result<(), PyramidError> {
    if path.file_name().is_none() {
        return Err(PyramidError::Refused(format!(
            "{}: not a name for a pyramid",
            path.display()
        )));
    }
    match path.symlink_metadata() {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(PyramidError::io("looking at", path)(error)),
        Ok(_) if !is_pyramid(path) => Err(PyramidError::Refused(format!(
            "{}: exists and is not a Drumlin pyramid; it was left as it is",
            path.display()
        ))),
        Ok(_) if overwrite => Ok(()),
        Ok(_) => Err(PyramidError::Refused(format!(
            "{}: a pyramid is there already; ask to overwrite it, or choose another name",
            path.display()
        ))),
    }
}

/// Ends a replacement that was killed between its steps: the old pyramid gets its name back, or goes.
pub(super) fn settle_replacement(path: &Path) -> Result<(), PyramidError> {
    let replaced = sibling(path, ".replaced");
    if !is_pyramid(&replaced) {
        return Ok(());
    }
    if path.symlink_metadata().is_ok() {
        fs::remove_dir_all(&replaced).map_err(PyramidError::io("removing", &replaced))
    } else {
        fs::rename(&replaced, path).map_err(PyramidError::io("renaming", &replaced))
    }
}

/// Makes the folder of a build, or takes over one that nobody works on; returns its marker, locked.
pub(super) fn claim(folder: &Path) -> Result<File, PyramidError> {
    let marker = folder.join(MARKER);
    let refused = |what: &str| PyramidError::Refused(format!("{}: {what}", folder.display()));
    match fs::create_dir(folder) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            if !marker.is_file()
                && !is_pyramid(folder)
                && fs::read_dir(folder).is_ok_and(|mut it| it.next().is_some())
            {
                return Err(refused(
                    "is in the way of the build, and is not the rest of one",
                ));
            }
        }
        other => other.map_err(PyramidError::io("creating", folder))?,
    }
    let file = File::options()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(&marker)
        .map_err(PyramidError::io("opening", &marker))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(refused("another process is building this pyramid")),
        Err(TryLockError::Error(error)) => Err(PyramidError::io("locking", marker)(error)),
    }
}

/// The marker of a build that was begun, locked together with others, or against all others.
pub(super) fn join(folder: &Path, alone: bool) -> Result<File, PyramidError> {
    let marker = folder.join(MARKER);
    let refused = |what: &str| PyramidError::Refused(format!("{}: {what}", folder.display()));
    let file = match File::options().read(true).write(true).open(&marker) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            return Err(refused("no build was begun here; plan it first"));
        }
        other => other.map_err(PyramidError::io("opening", &marker))?,
    };
    let locked = if alone {
        file.try_lock()
    } else {
        file.try_lock_shared()
    };
    match locked {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(refused("another process is building this pyramid")),
        Err(TryLockError::Error(error)) => Err(PyramidError::io("locking", marker)(error)),
    }
}

/// Empties a build's folder and says what is being built now.
pub(super) fn start_over(
    folder: &Path,
    marker: &mut File,
    fingerprint: &str,
) -> Result<(), PyramidError> {
    for name in ["tile", "feature", "color", "manifest", SCRATCH, PASSES] {
        remove_folder(&folder.join(name))?;
    }
    remove_if_there(&folder.join(zarr::NODE))?;
    let manifest = folder.join("manifest");
    fs::create_dir(&manifest).map_err(PyramidError::io("creating", manifest))?;
    marker
        .set_len(0)
        .and_then(|()| marker.rewind())
        .and_then(|()| marker.write_all(fingerprint.as_bytes()))
        .and_then(|()| marker.sync_all())
        .map_err(PyramidError::io("writing", folder.join(MARKER)))
}

pub(super) fn remove_if_there(path: &Path) -> Result<(), PyramidError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        other => other.map_err(PyramidError::io("removing", path)),
    }
}
