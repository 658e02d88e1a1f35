//! What one view needs on the device beside the pool: the frame, the drawn tiles, and the lists the stages fill.
//!
//! Made once, from the budget; a frame only writes into them.

use drumlin_core::{
    geo::PATCH_COUNT,
    reference::shared::{
        CLASS_COUNTS_WORD, DRAW_LIST_WORDS, DrawnTile, FLAG_SRGB_OUT, Frame, INDEX_COUNT_WORD,
        SHIFT_COUNTS_WORD,
    },
    terrain::PoolSizes,
};

use crate::readback::Readback;

/// Bytes of the head of the emitted list: the draw's arguments first, then what was counted.
const DRAW_LIST_BYTES: u64 = DRAW_LIST_WORDS as u64 * 4;

/// The lists of one view.
pub(crate) struct FrameBuffers {
    /// The view.
    pub(crate) frame: wgpu::Buffer,
    /// The drawn tiles.
    pub(crate) drawn: wgpu::Buffer,
    /// A depth a patch: written by `depth`.
    pub(crate) depths: wgpu::Buffer,
    /// Raised depths a patch: written and read by `balance`.
    pub(crate) raised: wgpu::Buffer,
    /// A word a patch: written by `balance`.
    pub(crate) patches: wgpu::Buffer,
    /// The emitted indices.
    pub(crate) indices: wgpu::Buffer,
    /// The draw's arguments and the counters: written by `emit`.
    pub(crate) draw_list: wgpu::Buffer,
    capacity: u32,
    drawn_count: u32,
    counts: Readback,
    latest: Option<DrawCounts>,
}

/// What the stages emitted for one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawCounts {
    /// The frame it belongs to, counted from 1.
    pub frame: u64,
    /// Triangles drawn.
    pub triangles: u32,
    /// Patches without finer neighbours, by depth 0, 1, 2.
    pub regular_patches: [u32; 3],
    /// Patches with finer neighbours, by depth.
    pub transition_patches: [u32; 3],
    /// Depths the whole frame gave up so that its list fits: 0 is the normal state.
    pub shift: u32,
}

impl FrameBuffers {
    /// Lists as large as the planner's sizes.
    pub(crate) fn new(device: &wgpu::Device, sizes: &PoolSizes) -> Self {
        use wgpu::BufferUsages as Usage;
        let drawn = u64::from(sizes.max_drawn);
        let patches = drawn * PATCH_COUNT as u64 * 4;
        let written = Usage::STORAGE | Usage::COPY_SRC;
        Self {
            frame: buffer(
                device,
                "drumlin frame",
                size_of::<Frame>() as u64,
                Usage::UNIFORM | Usage::COPY_DST,
            ),
            drawn: buffer(
                device,
                "drumlin drawn tiles",
                drawn * size_of::<DrawnTile>() as u64,
                Usage::STORAGE | Usage::COPY_DST,
            ),
            depths: buffer(device, "drumlin depths", patches, written),
            raised: buffer(device, "drumlin raised depths", patches, written),
            patches: buffer(device, "drumlin patches", patches, written),
            indices: buffer(
                device,
                "drumlin indices",
                u64::from(sizes.index_capacity) * 4,
                written | Usage::INDEX,
            ),
            draw_list: buffer(
                device,
                "drumlin draw list",
                DRAW_LIST_BYTES,
                written | Usage::INDIRECT | Usage::COPY_DST,
            ),
            capacity: sizes.max_drawn,
            drawn_count: 0,
            counts: Readback::new(device, "drumlin counts", DRAW_LIST_BYTES),
            latest: None,
        }
    }

    /// Writes the frame and its drawn tiles; a list past the capacity is cut, which the planner never lets happen.
    pub(crate) fn write(
        &mut self,
        queue: &wgpu::Queue,
        drawn: &[DrawnTile],
        frame: &Frame,
        srgb_out: bool,
    ) {
        let count = drawn.len().min(self.capacity as usize);
        debug_assert_eq!(count, drawn.len(), "the planner knows the capacity");
        self.drawn_count = u32::try_from(count).unwrap_or(self.capacity);
        let encode = if srgb_out { FLAG_SRGB_OUT } else { 0 };
        let frame = Frame {
            drawn_count: self.drawn_count,
            index_capacity: self.index_capacity(),
            flags: frame.flags & !FLAG_SRGB_OUT | encode,
            ..*frame
        };
        queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame));
        if count > 0 {
            queue.write_buffer(&self.drawn, 0, bytemuck::cast_slice(&drawn[..count]));
        }
    }

    /// Sends the counters on their way to the CPU.
    pub(crate) fn record_counts(&mut self, encoder: &mut wgpu::CommandEncoder, frame: u64) {
        if let Some(buffer) = self.counts.record(encoder, frame) {
            encoder.copy_buffer_to_buffer(&self.draw_list, 0, buffer, 0, DRAW_LIST_BYTES);
        }
    }

    /// The latest counters that have arrived.
    pub(crate) fn latest_counts(&mut self) -> Option<DrawCounts> {
        let latest = &mut self.latest;
        let capacity = u32::try_from(self.indices.size() / 4).unwrap_or(u32::MAX);
        self.counts
            .drain(|frame, bytes| *latest = Some(parse_counts(frame, bytes, capacity)));
        self.latest
    }

    /// Tiles of the list.
    pub(crate) fn drawn_count(&self) -> u32 {
        self.drawn_count
    }

    /// Indices the list may hold.
    pub(crate) fn index_capacity(&self) -> u32 {
        u32::try_from(self.indices.size() / 4).unwrap_or(u32::MAX)
    }

    /// Bytes on the device.
    pub(crate) fn byte_count(&self) -> u64 {
        [
            &self.frame,
            &self.drawn,
            &self.depths,
            &self.raised,
            &self.patches,
            &self.indices,
            &self.draw_list,
        ]
        .into_iter()
        .map(wgpu::Buffer::size)
        .sum::<u64>()
            + self.counts.byte_count()
    }
}

fn buffer(
    device: &wgpu::Device,
    label: &str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage,
        mapped_at_creation: false,
    })
}

/// Reads the words of `shaders/shared/draw_list.wgsl`.
fn parse_counts(frame: u64, bytes: &[u8], capacity: u32) -> DrawCounts {
    let (words, _) = bytes.as_chunks::<4>();
    let word = |index: usize| words.get(index).map_or(0, |word| u32::from_le_bytes(*word));
    let classes: [u32; 6] = std::array::from_fn(|class| word(CLASS_COUNTS_WORD + class));
    let [a, b, c, d, e, f] = classes;
    let fits = |shift: &u32| word(SHIFT_COUNTS_WORD + *shift as usize) <= capacity;
    DrawCounts {
        frame,
        triangles: word(INDEX_COUNT_WORD) / 3,
        regular_patches: [a, b, c],
        transition_patches: [d, e, f],
        shift: (0..2).find(fits).unwrap_or(2),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counters_say_triangles_classes_and_the_shift() {
        let words: [u32; 16] = [300, 1, 0, 0, 0, 9_000, 300, 60, 300, 1, 2, 3, 4, 5, 6, 0];
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let counts = parse_counts(5, &bytes, 400);
        assert_eq!(counts.triangles, 100);
        assert_eq!(
            (counts.regular_patches, counts.transition_patches),
            ([1, 2, 3], [4, 5, 6])
        );
        assert_eq!(counts.shift, 1);
    }
}
