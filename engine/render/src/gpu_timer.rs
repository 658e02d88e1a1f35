//! GPU times from timestamp queries, where the device has them; read frames later, never waited for.
//!
//! Three spans a frame: the stages (one compute pass), `refine` (another, in frames in which tables of features arrive),
//! and the caller's render pass, if the caller puts `pass_writes` into it. A span that was not written is not resolved.

use crate::readback::Readback;

const STAGES: u32 = 0;
const REFINE: u32 = 2;
const PASS: u32 = 4;
const QUERIES: u32 = 6;
/// Where a span is resolved to: a multiple of what WebGPU asks for.
const RESOLVED_STRIDE: u64 = 256;
const BYTES: u64 = QUERIES as u64 * 8;

/// GPU times of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GpuTimes {
    /// The frame they belong to, counted from 1.
    pub frame: u64,
    /// From decoding the uploads to writing the last index, milliseconds.
    pub stages_millis: f64,
    /// Executing the tables of features that arrived, milliseconds; where there were any.
    pub refine_millis: Option<f64>,
    /// The render pass the terrain was drawn in, milliseconds; where the caller timed it.
    pub pass_millis: Option<f64>,
}

/// A query set, and the way its results come back.
pub(crate) struct GpuTimer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readback: Readback,
    period: f64,
    written: Option<u64>,
    refine_written: bool,
    pass_written: bool,
    latest: Option<GpuTimes>,
}

impl GpuTimer {
    /// A timer, where the device has timestamps.
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Option<Self> {
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let queries = device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("drumlin times"),
            ty: wgpu::QueryType::Timestamp,
            count: QUERIES,
        });
        let resolved = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("drumlin times"),
            size: 3 * RESOLVED_STRIDE,
            usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Some(Self {
            queries,
            resolved,
            readback: Readback::new(device, "drumlin times", BYTES),
            period: f64::from(queue.get_timestamp_period()) * 1e-6,
            written: None,
            refine_written: false,
            pass_written: false,
            latest: None,
        })
    }

    /// Collects what has arrived, and resolves the frame before: its passes are submitted by now.
    pub(crate) fn begin(&mut self, encoder: &mut wgpu::CommandEncoder) {
        self.collect();
        let Some(frame) = self.written.take() else {
            return;
        };
        let spans = [
            (STAGES, true),
            (REFINE, std::mem::take(&mut self.refine_written)),
            (PASS, std::mem::take(&mut self.pass_written)),
        ];
        let Some(buffer) = self.readback.record(encoder, frame) else {
            return;
        };
        encoder.clear_buffer(buffer, 0, None);
        for (first, _) in spans.into_iter().filter(|span| span.1) {
            let place = u64::from(first / 2) * RESOLVED_STRIDE;
            encoder.resolve_query_set(&self.queries, first..first + 2, &self.resolved, place);
            encoder.copy_buffer_to_buffer(&self.resolved, place, buffer, u64::from(first) * 8, 16);
        }
    }

    /// What the compute pass of the stages writes.
    pub(crate) fn stage_writes(&self) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(STAGES),
            end_of_pass_write_index: Some(STAGES + 1),
        }
    }

    /// What the compute pass of `refine` writes.
    pub(crate) fn refine_writes(&mut self) -> wgpu::ComputePassTimestampWrites<'_> {
        self.refine_written = true;
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(REFINE),
            end_of_pass_write_index: Some(REFINE + 1),
        }
    }

    /// Marks the frame's stages as encoded.
    pub(crate) fn end(&mut self, frame: u64) {
        self.written = Some(frame);
    }

    /// What the caller's render pass writes.
    pub(crate) fn pass_writes(&mut self) -> wgpu::RenderPassTimestampWrites<'_> {
        self.pass_written = true;
        wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(PASS),
            end_of_pass_write_index: Some(PASS + 1),
        }
    }

    /// The latest times that have arrived.
    pub(crate) fn latest(&self) -> Option<GpuTimes> {
        self.latest
    }

    /// Bytes on the device, for budgets.
    pub(crate) fn byte_count(&self) -> u64 {
        self.resolved.size() + self.readback.byte_count()
    }

    fn collect(&mut self) {
        let (period, latest) = (self.period, &mut self.latest);
        self.readback
            .drain(|frame, bytes| *latest = Some(times(frame, bytes, period)));
    }
}

#[expect(
    clippy::cast_precision_loss,
    reason = "a span of ticks of one frame is far below 2^53"
)]
fn times(frame: u64, bytes: &[u8], period: f64) -> GpuTimes {
    let tick = |index: u32| {
        let at = index as usize * 8;
        bytes
            .get(at..at + 8)
            .and_then(|word| word.try_into().ok())
            .map_or(0, u64::from_le_bytes)
    };
    let span = |first: u32| {
        let (start, end) = (tick(first), tick(first + 1));
        (start != 0 && end != 0).then(|| end.saturating_sub(start) as f64 * period)
    };
    GpuTimes {
        frame,
        stages_millis: span(STAGES).unwrap_or(0.0),
        refine_millis: span(REFINE),
        pass_millis: span(PASS),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pass_that_was_not_timed_has_no_time() {
        let mut bytes = Vec::new();
        for tick in [1_000_000_u64, 3_000_000, 4_000_000, 4_500_000, 0, 0] {
            bytes.extend_from_slice(&tick.to_le_bytes());
        }
        let times = times(7, &bytes, 1e-6);
        assert_eq!(
            times,
            GpuTimes {
                frame: 7,
                stages_millis: 2.0,
                refine_millis: Some(0.5),
                pass_millis: None
            }
        );
    }
}
