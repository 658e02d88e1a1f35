//! The archive's file, which takes in silence what is written after a failure.
//!
//! A `ZipWriter` that is dropped finishes its archive: after a failed write it would say so on standard error, or
//! panic where the file's position is before the member it has in mind. The failure itself is told where it happens.

use std::fs::File;
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};

pub(super) struct Output<'a> {
    file: &'a mut File,
    position: u64,
    end: u64,
    has_failed: bool,
}

impl<'a> Output<'a> {
    /// An empty file.
    pub(super) const fn new(file: &'a mut File) -> Self {
        Self {
            file,
            position: 0,
            end: 0,
            has_failed: false,
        }
    }

    /// Asks the file, unless it has failed before. From a failure on the position is the end, or after it.
    fn ask<T>(
        &mut self,
        instead: T,
        ask: impl FnOnce(&mut File) -> io::Result<T>,
    ) -> io::Result<T> {
        if self.has_failed {
            return Ok(instead);
        }
        let answer = ask(self.file);
        let failed = |error: &io::Error| error.kind() != ErrorKind::Interrupted;
        if answer.as_ref().is_err_and(failed) {
            self.has_failed = true;
            self.position = self.end;
        }
        answer
    }
}

impl Write for Output<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.ask(bytes.len(), |file| file.write(bytes))?;
        self.position += count as u64;
        self.end = self.end.max(self.position);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.ask((), Write::flush)
    }
}

impl Seek for Output<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = match to {
            SeekFrom::Start(position) => Some(position),
            SeekFrom::Current(by) => self.position.checked_add_signed(by),
            SeekFrom::End(by) => self.end.checked_add_signed(by),
        };
        let position = position.ok_or(ErrorKind::InvalidInput)?;
        let instead = position.max(self.position);
        self.position = self.ask(instead, |file| file.seek(SeekFrom::Start(position)))?;
        Ok(self.position)
    }
}
