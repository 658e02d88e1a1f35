//! Files that are whole or not there, and bytes at places of files.

use std::{
    fs::{self, File},
    io::{ErrorKind, Read, Write},
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
    time::SystemTime,
};

use super::PyramidError;

/// The path with something added to its last name.
pub(super) fn sibling(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(suffix);
    path.with_file_name(name)
}

/// A name that no other process has, nor this one again.
pub(super) fn unique() -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    let nanos = since.map_or(0, |since| since.as_nanos());
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    format!("{:x}-{nanos:x}-{count:x}", std::process::id())
}

/// Writes a file so that it is whole or not there, on the disk and not only in the cache.
///
/// # Errors
/// [`PyramidError::Io`]; what was at the path is still there then.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), PyramidError> {
    write_whole_with(path, |file| {
        file.write_all(bytes)
            .map_err(PyramidError::io("writing", path))
    })
}

/// As [`write_whole`], for bytes that are written in pieces.
///
/// # Errors
/// [`PyramidError::Io`], and what `write` says; what was at the path is still there then.
pub fn write_whole_with(
    path: &Path,
    write: impl FnOnce(&mut File) -> Result<(), PyramidError>,
) -> Result<(), PyramidError> {
    write_whole_as(path, &sibling(path, ".partial"), write)
}

/// As [`write_whole_with`], under another name on the same disk until it is whole.
pub(super) fn write_whole_as(
    path: &Path,
    partial: &Path,
    write: impl FnOnce(&mut File) -> Result<(), PyramidError>,
) -> Result<(), PyramidError> {
    let folder = path.parent().unwrap_or(Path::new("."));
    for folder in [Some(folder), partial.parent()].into_iter().flatten() {
        fs::create_dir_all(folder).map_err(PyramidError::io("creating", folder))?;
    }
    let written = File::options()
        .read(true)
        .write(true)
        .create(true)
        .truncate(true)
        .open(partial)
        .map_err(PyramidError::io("creating", partial))
        .and_then(|mut file| {
            write(&mut file)?;
            file.sync_all().map_err(PyramidError::io("flushing", path))
        });
    if let Err(error) = written {
        // What is left of it is in the way of nothing; the first error is the one to tell.
        let _ = fs::remove_file(partial);
        return Err(error);
    }
    fs::rename(partial, path).map_err(PyramidError::io("renaming", partial))?;
    sync_folder(folder)
}

/// Copies all there is to read; how many bytes, and their BLAKE3. The names are for messages.
pub(super) fn copy_hashed(
    from: &mut dyn Read,
    from_name: &str,
    to: &mut dyn Write,
    to_path: &Path,
) -> Result<(u64, String), PyramidError> {
    let mut hasher = blake3::Hasher::new();
    let mut piece = vec![0; 1 << 20];
    loop {
        let count = match from.read(&mut piece) {
            Ok(0) => return Ok((hasher.count(), hasher.finalize().to_hex().to_string())),
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            read => read.map_err(PyramidError::io("reading", from_name))?,
        };
        hasher.update(&piece[..count]);
        to.write_all(&piece[..count])
            .map_err(PyramidError::io("writing", to_path))?;
    }
}

/// Removes a folder and all in it, where there is one.
pub(super) fn remove_folder(path: &Path) -> Result<(), PyramidError> {
    match fs::remove_dir_all(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        other => other.map_err(PyramidError::io("removing", path)),
    }
}

/// Brings a folder's names to the disk.
#[cfg(unix)]
pub(super) fn sync_folder(folder: &Path) -> Result<(), PyramidError> {
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    File::open(folder)
        .and_then(|file| file.sync_all())
        .map_err(PyramidError::io("flushing", folder))
}

/// Folders cannot be flushed here.
#[cfg(not(unix))]
pub(super) fn sync_folder(_: &Path) -> Result<(), PyramidError> {
    Ok(())
}

/// Fills a buffer from a place of a file on; the file's own position may move.
#[cfg(unix)]
pub(super) fn read_exact_at(file: &File, buffer: &mut [u8], offset: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, buffer, offset)
}

/// Writes bytes from a place of a file on; the file's own position may move.
#[cfg(unix)]
pub(super) fn write_all_at(file: &File, bytes: &[u8], offset: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, bytes, offset)
}

/// As on Unix.
#[cfg(windows)]
pub(super) fn read_exact_at(
    file: &File,
    mut buffer: &mut [u8],
    mut offset: u64,
) -> std::io::Result<()> {
    while !buffer.is_empty() {
        let count = std::os::windows::fs::FileExt::seek_read(file, buffer, offset)?;
        if count == 0 {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        buffer = &mut buffer[count..];
        offset += count as u64;
    }
    Ok(())
}

/// As on Unix.
#[cfg(windows)]
pub(super) fn write_all_at(file: &File, mut bytes: &[u8], mut offset: u64) -> std::io::Result<()> {
    while !bytes.is_empty() {
        let count = std::os::windows::fs::FileExt::seek_write(file, bytes, offset)?;
        if count == 0 {
            return Err(ErrorKind::WriteZero.into());
        }
        bytes = &bytes[count..];
        offset += count as u64;
    }
    Ok(())
}
