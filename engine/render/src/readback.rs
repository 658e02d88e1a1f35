//! Small results of the GPU, read without waiting.
//!
//! A ring of three mappable buffers: `record` copies into a free one and asks for it to be mapped when the caller
//! submits; some frames later `latest` finds it mapped. Nothing waits: with no free buffer a frame's result is skipped.

use std::sync::{
    Arc,
    atomic::{AtomicU8, Ordering},
};

/// Buffers of a ring: frames between writing on the GPU and reading on the CPU, plus one.
const RING: usize = 3;

const FREE: u8 = 0;
const IN_FLIGHT: u8 = 1;
const MAPPED: u8 = 2;

struct Entry {
    buffer: wgpu::Buffer,
    state: Arc<AtomicU8>,
    frame: u64,
}

/// A ring of mappable buffers of one size.
pub(crate) struct Readback {
    entries: Vec<Entry>,
    byte_count: u64,
}

impl Readback {
    /// A ring for results of `byte_count` bytes.
    pub(crate) fn new(device: &wgpu::Device, label: &str, byte_count: u64) -> Self {
        let entry = |_| Entry {
            buffer: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: byte_count,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            }),
            state: Arc::new(AtomicU8::new(FREE)),
            frame: 0,
        };
        Self {
            entries: (0..RING).map(entry).collect(),
            byte_count,
        }
    }

    /// Bytes of the ring, for budgets.
    pub(crate) fn byte_count(&self) -> u64 {
        self.byte_count * RING as u64
    }

    /// Copies the first bytes of `source` into a free buffer, once the encoder is submitted.
    pub(crate) fn record(
        &mut self,
        encoder: &wgpu::CommandEncoder,
        frame: u64,
    ) -> Option<&wgpu::Buffer> {
        let entry = self
            .entries
            .iter_mut()
            .find(|entry| entry.state.load(Ordering::Acquire) == FREE)?;
        entry.state.store(IN_FLIGHT, Ordering::Release);
        entry.frame = frame;
        let state = Arc::clone(&entry.state);
        encoder.map_buffer_on_submit(&entry.buffer, wgpu::MapMode::Read, .., move |result| {
            state.store(
                if result.is_ok() { MAPPED } else { FREE },
                Ordering::Release,
            );
        });
        Some(&entry.buffer)
    }

    /// Hands every result that has arrived to `read`, oldest frame first, and frees its buffer.
    pub(crate) fn drain(&mut self, mut read: impl FnMut(u64, &[u8])) {
        self.entries.sort_by_key(|entry| entry.frame);
        for entry in &self.entries {
            if entry.state.load(Ordering::Acquire) != MAPPED {
                continue;
            }
            if let Ok(view) = entry.buffer.get_mapped_range(..) {
                read(entry.frame, &view);
            }
            entry.buffer.unmap();
            entry.state.store(FREE, Ordering::Release);
        }
    }
}
