//! What a pyramid remembers of the files it was built from.

use std::{fs::File, io, path::Path};

use anyhow::{Context, Result};
use drumlin_core::pyramid::SourceMetadata;

/// Name, size and BLAKE3 of a file.
pub(crate) fn describe(file: &Path) -> Result<SourceMetadata> {
    let hash = || -> io::Result<_> {
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(File::open(file)?)?;
        Ok((hasher.count(), hasher.finalize()))
    };
    let (bytes, hash) = hash().with_context(|| format!("{}: reading failed", file.display()))?;
    let name = file
        .file_name()
        .unwrap_or(file.as_os_str())
        .to_string_lossy()
        .into_owned();
    Ok(SourceMetadata {
        name,
        bytes,
        blake3: hash.to_hex().to_string(),
    })
}
