//! A file of a store as a stream, for what is read from end to end.

use std::io;

use super::{Store, StoreError};

/// Bytes asked for at a time.
const PIECE: u64 = 1 << 20;

/// Reads a file of a store from its start to its end.
#[derive(Debug)]
pub(in crate::pyramid) struct StoreReader<'a> {
    store: &'a dyn Store,
    key: &'a str,
    bytes: u64,
    next: u64,
    piece: io::Cursor<Vec<u8>>,
}

impl<'a> StoreReader<'a> {
    /// Starts at the first byte.
    ///
    /// # Errors
    ///
    /// Where there is no such file.
    pub(in crate::pyramid) fn open(store: &'a dyn Store, key: &'a str) -> Result<Self, StoreError> {
        Ok(Self {
            store,
            key,
            bytes: store.size(key)?,
            next: 0,
            piece: io::Cursor::default(),
        })
    }

    /// Bytes of the file.
    pub(in crate::pyramid) const fn byte_count(&self) -> u64 {
        self.bytes
    }
}

impl io::Read for StoreReader<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let read = self.piece.read(out)?;
        if read > 0 || out.is_empty() || self.next == self.bytes {
            return Ok(read);
        }
        let range = self.next..self.bytes.min(self.next + PIECE);
        let want = range.end - range.start;
        self.next = range.end;
        let piece = self
            .store
            .read(self.key, range)
            .map_err(StoreError::into_io)?;
        if piece.len() as u64 != want {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        self.piece = io::Cursor::new(piece);
        self.piece.read(out)
    }
}
