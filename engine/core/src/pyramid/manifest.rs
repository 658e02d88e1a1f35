//! The manifest: one line a shard, with its size and hash.

use std::{
    collections::HashMap,
    io::{BufRead, BufReader, Read},
};

use super::{ShardInfo, Store, store::StoreReader, writer::MANIFEST};

/// No line is longer.
const LINE_LIMIT: u64 = 4096;

/// The manifest's lines by key.
///
/// # Errors
///
/// Where it is missing, cannot be read, or has a line that is none or a key twice: what, in words.
pub(super) fn read_manifest(store: &dyn Store) -> Result<HashMap<String, ShardInfo>, String> {
    let file = StoreReader::open(store, MANIFEST).map_err(|error| error.to_string())?;
    let wrap = |what: String| format!("{}: {what}", store.name(MANIFEST));
    let mut file = BufReader::new(file);
    let mut manifest = HashMap::new();
    for number in 1.. {
        let mut line = Vec::new();
        let read = file.by_ref().take(LINE_LIMIT).read_until(b'\n', &mut line);
        if read.map_err(|error| wrap(format!("reading failed: {error}")))? == 0 {
            break;
        }
        let info: ShardInfo = serde_json::from_slice(&line)
            .map_err(|error| wrap(format!("line {number}: {error}")))?;
        if let Some(twice) = manifest.insert(info.key.clone(), info) {
            return Err(wrap(format!(
                "line {number}: {:?} for the second time",
                twice.key
            )));
        }
    }
    Ok(manifest)
}
