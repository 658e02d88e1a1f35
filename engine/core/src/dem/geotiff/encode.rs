//! A tile's heights as stored bytes.

use std::io;

use super::{Compression, TIFF_TILE};

/// The bytes of a whole tile.
///
/// # Errors
/// Where zstd has no memory.
pub(super) fn encode(samples: &[f32], compression: Compression) -> io::Result<Vec<u8>> {
    match compression {
        Compression::None => Ok(samples.iter().flat_map(|v| v.to_le_bytes()).collect()),
        Compression::Zstd(level) => zstd::bulk::compress(&predicted(samples), level),
    }
}

/// The floating-point predictor: of every row first all highest bytes, then all second ones, …, each byte as its
/// difference from the one before.
fn predicted(samples: &[f32]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(4 * samples.len());
    for row in samples.chunks_exact(TIFF_TILE as usize) {
        let mut before = 0_u8;
        for place in 0..4 {
            for sample in row {
                let byte = sample.to_be_bytes()[place];
                bytes.push(byte.wrapping_sub(before));
                before = byte;
            }
        }
    }
    bytes
}
