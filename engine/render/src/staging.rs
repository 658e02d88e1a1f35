//! Tiles on their way up: packed into words as `shaders/shared/upload.wgsl` says, and grouped by page.
//!
//! `decode` writes one page at a time, so the tiles of a frame lie in the staging buffers page by page, each batch from
//! an offset that a binding may have.

use drumlin_core::{
    geo::{CAGE_CONTROL_COUNT, PATCH_COUNT, TILE_SAMPLE_COUNT},
    pyramid::Tile,
    reference::shared::UploadHeader,
    terrain::Upload,
};

use crate::{
    pool::Pool,
    vram::{PAGE_COUNT, UPLOADS_PER_FRAME},
};

/// Words of the void bits.
const VOID_WORDS: usize = TILE_SAMPLE_COUNT.div_ceil(32);
/// Words of a tile.
pub(crate) const UPLOAD_WORDS: usize =
    CAGE_CONTROL_COUNT + TILE_SAMPLE_COUNT + VOID_WORDS + PATCH_COUNT / 4;

/// Multiples at which a binding may begin, by WebGPU's default limits.
const ALIGNMENT: usize = 256;

/// Tiles of one page, next to each other in the staging buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Batch {
    /// The page.
    pub(crate) page: usize,
    /// Tiles.
    pub(crate) count: u32,
    /// Where their headers begin, bytes.
    pub(crate) header_offset: u32,
    /// Where their words begin, bytes.
    pub(crate) tile_offset: u32,
}

/// The staging buffers, and the memory they are filled from.
pub(crate) struct Staging {
    /// Headers of the tiles.
    pub(crate) headers: wgpu::Buffer,
    /// Words of the tiles.
    pub(crate) tiles: wgpu::Buffer,
    header_bytes: Vec<u8>,
    words: Vec<u32>,
    batches: Vec<Batch>,
}

impl Staging {
    /// Room for a frame's tiles, twice: a binding covers as many tiles from wherever it begins.
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let buffer = |label, tile_bytes: usize| {
            let room =
                2 * UPLOADS_PER_FRAME as usize * tile_bytes + PAGE_COUNT as usize * ALIGNMENT;
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: room as u64,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        Self {
            headers: buffer("drumlin headers", size_of::<UploadHeader>()),
            tiles: buffer("drumlin staging", UPLOAD_WORDS * 4),
            header_bytes: Vec::new(),
            words: Vec::new(),
            batches: Vec::new(),
        }
    }

    /// Puts a frame's tiles into the staging buffers; at most [`UPLOADS_PER_FRAME`], whose pages exist.
    pub(crate) fn write(
        &mut self,
        queue: &wgpu::Queue,
        pool: &Pool,
        uploads: &[Upload],
        unit: f32,
    ) -> &[Batch] {
        self.header_bytes.clear();
        self.words.clear();
        self.batches.clear();
        for page in 0..PAGE_COUNT as usize {
            self.pack_page(page, pool, uploads, unit);
        }
        if !self.batches.is_empty() {
            queue.write_buffer(&self.headers, 0, &self.header_bytes);
            queue.write_buffer(&self.tiles, 0, bytemuck::cast_slice(&self.words));
        }
        &self.batches
    }

    /// Bytes on the device.
    pub(crate) fn byte_count(&self) -> u64 {
        self.headers.size() + self.tiles.size()
    }

    fn pack_page(&mut self, page: usize, pool: &Pool, uploads: &[Upload], unit: f32) {
        self.header_bytes
            .resize(self.header_bytes.len().next_multiple_of(ALIGNMENT), 0);
        self.words
            .resize(self.words.len().next_multiple_of(ALIGNMENT / 4), 0);
        let (header_offset, tile_offset) = (
            offset(self.header_bytes.len()),
            offset(self.words.len() * 4),
        );
        let mut count = 0;
        for upload in uploads {
            let Some((_, slot)) = pool.place(upload.slot).filter(|place| place.0 == page) else {
                continue;
            };
            self.header_bytes
                .extend_from_slice(bytemuck::bytes_of(&UploadHeader {
                    slot,
                    quantum: upload.tile.step,
                    unit,
                    reserved: 0,
                    step: upload.step,
                    reserved_2: [0.0; 2],
                }));
            pack(&upload.tile, &mut self.words);
            count += 1;
        }
        if count > 0 {
            self.batches.push(Batch {
                page,
                count,
                header_offset,
                tile_offset,
            });
        }
    }
}

/// Offsets stay below a few megabytes.
fn offset(bytes: usize) -> u32 {
    u32::try_from(bytes).unwrap_or(u32::MAX)
}

/// Appends the words of a tile: controls, codes, void bits, patch errors. Short parts are filled with zeros.
pub(crate) fn pack(tile: &Tile, words: &mut Vec<u32>) {
    let start = words.len();
    let mut end = start + CAGE_CONTROL_COUNT;
    words.extend(tile.controls.iter().map(|control| control.cast_unsigned()));
    words.resize(end, 0);
    end += TILE_SAMPLE_COUNT;
    words.extend(tile.detail.iter().map(|code| code.cast_unsigned()));
    words.resize(end, 0);
    end += VOID_WORDS;
    pack_bytes(tile.voids.as_deref().unwrap_or(&[]), words);
    words.resize(end, 0);
    end += PATCH_COUNT / 4;
    pack_bytes(&tile.patch_codes, words);
    words.resize(end, 0);
}

/// Four bytes a word, lowest first.
fn pack_bytes(bytes: &[u8], words: &mut Vec<u32>) {
    words.extend(bytes.chunks(4).map(|chunk| {
        let mut word = [0; 4];
        word[..chunk.len()].copy_from_slice(chunk);
        u32::from_le_bytes(word)
    }));
}

#[cfg(test)]
mod tests {
    use drumlin_core::{geo::TileId, pyramid::Summary};

    use super::*;

    fn tile(voids: Option<Box<[u8]>>) -> Tile {
        Tile {
            id: TileId::ROOT,
            summary: Summary::default(),
            children: [Summary::default(); 4],
            step: 1,
            controls: vec![-1; CAGE_CONTROL_COUNT].into(),
            detail: vec![2; TILE_SAMPLE_COUNT].into(),
            patch_codes: vec![0x31; PATCH_COUNT].into(),
            voids,
        }
    }

    #[test]
    fn every_part_starts_where_the_shader_looks_for_it() {
        let mut words = Vec::new();
        pack(
            &tile(Some(vec![0xff; TILE_SAMPLE_COUNT.div_ceil(8)].into())),
            &mut words,
        );
        assert_eq!(words.len(), UPLOAD_WORDS);
        assert_eq!(
            [words[0], words[1224], words[1225]],
            [u32::MAX, u32::MAX, 2]
        );
        assert_eq!(
            [words[17_865], words[17_866], words[18_387]],
            [2, u32::MAX, 0x3131_3131]
        );
    }

    #[test]
    fn a_tile_without_voids_has_zeros_there() {
        let mut words = vec![7];
        pack(&tile(None), &mut words);
        assert_eq!([words[1 + 17_866], words[1 + 18_386]], [0, 0]);
    }
}
