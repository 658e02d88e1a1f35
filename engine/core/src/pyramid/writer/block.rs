//! The chunks of one shard, made in parallel and written in order.

use std::{
    fs::File,
    io::{Seek, SeekFrom, Write},
    path::Path,
};

use rayon::prelude::*;

use crate::{
    geo::TileId,
    pyramid::{
        PyramidError,
        shard::{
            SHARD_TILES, ShardIndex, encode_image, encode_jpeg, encode_record, shard_shape, z_order,
        },
    },
};

/// Chunks in memory at once, for each of which a record is made.
const BATCH: usize = 64;

/// What a tile's chunk holds, before it is compressed; none for a tile that is absent.
pub type Contents<'a> = &'a (dyn Fn(TileId) -> Result<Option<Vec<u8>>, PyramidError> + Sync);

/// What one shard holds.
pub(super) struct Block {
    pub(super) level: u8,
    pub(super) tiles: [u32; 2],
    pub(super) shard: [u32; 2],
    pub(super) chunk_bytes: usize,
    pub(super) packing: Packing,
}

/// How a tile's bytes become a chunk.
pub(super) enum Packing {
    /// A record, of parts of these lengths.
    Record(Vec<usize>),
    /// Whatever, compressed whole.
    Whole,
    /// RGBA texels, as JPEG of a quality.
    Jpeg(u8),
}

impl Block {
    /// Writes chunks after the place of the index, then the index; returns how many chunks there are.
    pub(super) fn write(
        &self,
        file: &mut File,
        path: &Path,
        contents: Contents<'_>,
    ) -> Result<u32, PyramidError> {
        let failed = || PyramidError::io("writing", path);
        let shape = shard_shape(self.tiles);
        let mut index = ShardIndex::new(shape);
        let mut offset = ShardIndex::byte_count(shape) as u64;
        file.seek(SeekFrom::Start(offset)).map_err(failed())?;
        for slots in z_order(shape).chunks(BATCH) {
            let chunks: Vec<_> = slots
                .par_iter()
                .map(|&slot| self.chunk(slot, path, contents))
                .collect();
            for (&slot, chunk) in slots.iter().zip(chunks) {
                let Some(chunk) = chunk? else { continue };
                file.write_all(&chunk).map_err(failed())?;
                index.set(slot, offset..offset + chunk.len() as u64);
                offset += chunk.len() as u64;
            }
        }
        file.rewind()
            .and_then(|()| file.write_all(&index.encode()))
            .map_err(failed())?;
        Ok(u32::try_from(index.chunk_count()).unwrap_or(u32::MAX))
    }

    fn chunk(
        &self,
        slot: [u32; 2],
        path: &Path,
        contents: Contents<'_>,
    ) -> Result<Option<Vec<u8>>, PyramidError> {
        let [row, column] = [0, 1].map(|axis| self.shard[axis] * SHARD_TILES + slot[axis]);
        if row >= self.tiles[0] || column >= self.tiles[1] {
            return Ok(None);
        }
        let Some(bytes) = contents(TileId::new(self.level, row, column))? else {
            return Ok(None);
        };
        assert_eq!(
            bytes.len(),
            self.chunk_bytes,
            "bytes of a chunk of level {}",
            self.level
        );
        let chunk = match &self.packing {
            Packing::Record(sections) => encode_record(&bytes, sections),
            Packing::Whole => encode_image(&bytes),
            Packing::Jpeg(quality) => encode_jpeg(&bytes, *quality),
        };
        chunk
            .map(Some)
            .map_err(PyramidError::io("compressing", path))
    }
}
