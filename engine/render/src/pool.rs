//! Decoded tiles on the device: up to four pages of slots, each within one storage binding.
//!
//! A page is made when its first slot is used, which is the only growth; slots are the planner's to give and take.

use drumlin_core::{reference::shared::SLOTS_PER_PAGE, terrain::PoolSizes};

use crate::vram::SLOT_BYTES;

/// Pages a terrain may have; all are bound at once.
pub(crate) const PAGE_COUNT: u32 = PoolSizes::PAGES;

/// Pages of slots.
pub(crate) struct Pool {
    pages: Vec<wgpu::Buffer>,
    unused: wgpu::Buffer,
    slots: u32,
}

impl Pool {
    /// A pool of `slots` slots, its first page made.
    pub(crate) fn new(device: &wgpu::Device, slots: u32) -> Self {
        let slots = slots.min(PAGE_COUNT * SLOTS_PER_PAGE);
        let mut pool = Self {
            pages: Vec::new(),
            unused: page(device, 0, 256),
            slots,
        };
        pool.hold(device, 0);
        pool
    }

    /// Makes the pages up to the one of `slot`; true when one was made and bindings must be made anew.
    pub(crate) fn hold(&mut self, device: &wgpu::Device, slot: u32) -> bool {
        let wanted = (slot.min(self.slots.saturating_sub(1)) / SLOTS_PER_PAGE + 1) as usize;
        let before = self.pages.len();
        for index in before..wanted {
            let first = u32::try_from(index).unwrap_or(PAGE_COUNT) * SLOTS_PER_PAGE;
            let slots = self.slots.saturating_sub(first).clamp(1, SLOTS_PER_PAGE);
            self.pages
                .push(page(device, index, u64::from(slots) * SLOT_BYTES));
        }
        self.pages.len() > before
    }

    /// The four pages to bind; a small stand-in where there is none yet.
    pub(crate) fn bindings(&self) -> [&wgpu::Buffer; PAGE_COUNT as usize] {
        std::array::from_fn(|index| self.pages.get(index).unwrap_or(&self.unused))
    }

    /// The pages there are.
    pub(crate) fn pages(&self) -> &[wgpu::Buffer] {
        &self.pages
    }

    /// The page of a slot and the slot's place in it.
    pub(crate) fn place(&self, slot: u32) -> Option<(usize, u32)> {
        let page = (slot / SLOTS_PER_PAGE) as usize;
        (slot < self.slots && page < self.pages.len()).then_some((page, slot % SLOTS_PER_PAGE))
    }

    /// Bytes on the device now.
    pub(crate) fn byte_count(&self) -> u64 {
        self.pages.iter().map(wgpu::Buffer::size).sum::<u64>() + self.unused.size()
    }
}

fn page(device: &wgpu::Device, index: usize, byte_count: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(&format!("drumlin page {index}")),
        size: byte_count,
        usage: wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
