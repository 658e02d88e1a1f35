//! Tiles on their way up: packed into words as `shaders/shared/upload.wgsl` says, and grouped by page.
//!
//! `decode` writes one page at a time, so the tiles of a frame lie in the staging buffers page by page, each batch from
//! an offset that a binding may have.

use drumlin_core::{
    reference::{
        decode::stage_tile,
        shared::{UPLOAD_CUT_WORD, UPLOAD_WORDS, UploadHeader},
    },
    terrain::Upload,
};

use crate::{
    pool::{PAGE_COUNT, Pool},
    vram::UPLOADS_AT_ONCE,
};

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
    /// As long as the buffer, and never cleared: a tile overwrites all its words.
    words: Vec<u32>,
    /// Words of this frame.
    word_count: usize,
    batches: Vec<Batch>,
}

impl Staging {
    /// Room for a frame's tiles, twice: a binding covers as many tiles from wherever it begins.
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let buffer = |label, tile_bytes: usize| {
            let room = 2 * UPLOADS_AT_ONCE as usize * tile_bytes + PAGE_COUNT as usize * ALIGNMENT;
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: room as u64,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let headers = buffer("drumlin headers", size_of::<UploadHeader>());
        let tiles = buffer("drumlin staging", UPLOAD_WORDS * 4);
        Self {
            header_bytes: Vec::with_capacity(host_size(&headers)),
            words: vec![0; host_size(&tiles) / 4],
            word_count: 0,
            batches: Vec::with_capacity(PAGE_COUNT as usize),
            headers,
            tiles,
        }
    }

    /// Puts a frame's tiles into the staging buffers; at most [`UPLOADS_AT_ONCE`], whose pages exist.
    pub(crate) fn write(
        &mut self,
        queue: &wgpu::Queue,
        pool: &Pool,
        uploads: &[Upload],
        unit: f32,
    ) -> &[Batch] {
        self.header_bytes.clear();
        self.word_count = 0;
        self.batches.clear();
        for page in 0..PAGE_COUNT as usize {
            self.pack_page(page, pool, uploads, unit);
        }
        if !self.batches.is_empty() {
            let words = &self.words[..self.word_count];
            queue.write_buffer(&self.headers, 0, &self.header_bytes);
            queue.write_buffer(&self.tiles, 0, bytemuck::cast_slice(words));
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
        self.word_count = self.word_count.next_multiple_of(ALIGNMENT / 4);
        let (header_offset, tile_offset) =
            (offset(self.header_bytes.len()), offset(self.word_count * 4));
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
            let words = &mut self.words[self.word_count..][..UPLOAD_WORDS];
            stage_tile(&upload.tile, words);
            if let Some(cut) = &upload.cut {
                words[UPLOAD_CUT_WORD..].copy_from_slice(&cut[..]);
            }
            self.word_count += UPLOAD_WORDS;
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

/// Bytes of a buffer, as memory beside it counts them.
fn host_size(buffer: &wgpu::Buffer) -> usize {
    usize::try_from(buffer.size()).unwrap_or(usize::MAX)
}

/// Offsets stay below a few megabytes.
fn offset(bytes: usize) -> u32 {
    u32::try_from(bytes).unwrap_or(u32::MAX)
}
