//! A pyramid as one file: a ZIP archive whose members are the folder's files, uncompressed and aligned.
//!
//! Shards begin at multiples of 4 KiB, so that a map of the archive serves them as it would serve files. The same
//! pyramid gives the same archive. Both ways every shard is compared with the manifest before the result has a name.

mod output;

use std::{fs::File, path::Path};

use zip::{CompressionMethod, DateTime, ZipWriter, result::ZipError, write::SimpleFileOptions};

use self::output::Output;
use super::{
    Pyramid, PyramidError, PyramidWriter, ShardInfo, StoreError,
    files::copy_hashed,
    manifest::read_manifest,
    store::StoreReader,
    writer::{MANIFEST, shard_keys},
    zarr,
};

/// Shards begin at pages.
const SHARD_ALIGNMENT: u16 = 4096;
/// The small files begin at cache lines.
const NODE_ALIGNMENT: u16 = 64;

/// Writes a pyramid into an archive. `path` is what to call the archive in messages, `progress` is told how many of how
/// many shards are done.
///
/// # Errors
///
/// Where a file of the pyramid is missing or not what the manifest says, or the archive cannot be written.
pub fn pack(
    pyramid: &Pyramid,
    file: &mut File,
    path: &Path,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<(), PyramidError> {
    let mut archive = Archive {
        zip: ZipWriter::new(Output::new(file)),
        pyramid,
        path,
    };
    archive.add(zarr::NODE, NODE_ALIGNMENT)?;
    for (key, _) in zarr::nodes(pyramid.metadata()) {
        archive.add(&key, NODE_ALIGNMENT)?;
    }
    archive.add(MANIFEST, NODE_ALIGNMENT)?;
    let shards = shards(pyramid)?;
    for (done, info) in (0..).zip(&shards) {
        progress(done, shards.len() as u64);
        let found = archive.add(&info.key, SHARD_ALIGNMENT)?;
        check(pyramid, info, found)?;
    }
    progress(shards.len() as u64, shards.len() as u64);
    archive.zip.finish().map_err(|error| failed(path, error))?;
    Ok(())
}

/// Writes a pyramid into a folder, which appears when it is whole.
///
/// # Errors
///
/// As [`pack`]; refused where `output` is something else, or a pyramid and `overwrite` is false.
pub fn unpack(
    pyramid: &Pyramid,
    output: &Path,
    overwrite: bool,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<(), PyramidError> {
    let shards = shards(pyramid)?;
    let writer = PyramidWriter::create(output, overwrite)?;
    let copied = (0..).zip(&shards).try_for_each(|(done, info)| {
        progress(done, shards.len() as u64);
        let mut reader = open(pyramid, &info.key)?;
        let found = writer.copy_shard(&info.key, &mut reader, &pyramid.store().name(&info.key))?;
        check(pyramid, info, found)
    });
    if let Err(error) = copied {
        // The first error is the one to tell.
        let _ = writer.discard();
        return Err(error);
    }
    progress(shards.len() as u64, shards.len() as u64);
    writer.publish(pyramid.metadata(), &shards)
}

struct Archive<'a> {
    zip: ZipWriter<Output<'a>>,
    pyramid: &'a Pyramid,
    path: &'a Path,
}

impl Archive<'_> {
    /// Copies a file of the pyramid; its size and BLAKE3.
    fn add(&mut self, key: &str, alignment: u16) -> Result<(u64, String), PyramidError> {
        let mut reader = open(self.pyramid, key)?;
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default())
            .large_file(reader.byte_count() >= u64::from(u32::MAX))
            .with_alignment(alignment);
        self.zip
            .start_file(key, options)
            .map_err(|error| failed(self.path, error))?;
        copy_hashed(
            &mut reader,
            &self.pyramid.store().name(key),
            &mut self.zip,
            self.path,
        )
    }
}

/// The shards that the pyramid must have, as the manifest describes them, in the order of their levels.
fn shards(pyramid: &Pyramid) -> Result<Vec<ShardInfo>, PyramidError> {
    let invalid = |what| PyramidError::Invalid {
        path: pyramid.store().name(MANIFEST).into(),
        what,
    };
    let mut manifest = read_manifest(pyramid.store()).map_err(invalid)?;
    shard_keys(pyramid.metadata())
        .map(|key| {
            manifest
                .remove(&key)
                .ok_or_else(|| invalid(format!("does not list {key}")))
        })
        .collect()
}

fn open<'a>(pyramid: &'a Pyramid, key: &'a str) -> Result<StoreReader<'a>, PyramidError> {
    StoreReader::open(pyramid.store(), key).map_err(|error| {
        let path = pyramid.store().name(key).into();
        match error {
            StoreError::Io { source, .. } => PyramidError::io("reading", path)(source),
            StoreError::Missing { .. } | StoreError::Short { .. } => PyramidError::Invalid {
                path,
                what: "is missing".into(),
            },
        }
    })
}

fn check(
    pyramid: &Pyramid,
    info: &ShardInfo,
    (bytes, blake3): (u64, String),
) -> Result<(), PyramidError> {
    if bytes == info.bytes && blake3 == info.blake3 {
        return Ok(());
    }
    Err(PyramidError::Invalid {
        path: pyramid.store().name(&info.key).into(),
        what: "is not what the manifest says; `drumlin validate --deep` says where".into(),
    })
}

fn failed(path: &Path, error: ZipError) -> PyramidError {
    PyramidError::io("writing", path)(error.into())
}

#[cfg(test)]
mod tests;
