//! Shards that come from another pyramid as they are.

use std::io::Read;

use super::PyramidWriter;
use crate::pyramid::{
    PyramidError,
    files::{copy_hashed, write_whole_with},
};

impl PyramidWriter {
    /// Writes a shard from what is read; its size and BLAKE3. `name` is what to call its source in messages.
    ///
    /// # Errors
    ///
    /// [`PyramidError::Io`].
    pub(in crate::pyramid) fn copy_shard(
        &self,
        key: &str,
        from: &mut dyn Read,
        name: &str,
    ) -> Result<(u64, String), PyramidError> {
        let path = self.folder.join(key);
        let mut found = (0, String::new());
        write_whole_with(&path, |file| {
            found = copy_hashed(from, name, file, &path)?;
            Ok(())
        })?;
        Ok(found)
    }
}
