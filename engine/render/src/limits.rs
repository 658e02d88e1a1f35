//! What a terrain asks of a device: WebGPU's default limits, and which of them it really leans on.

use crate::RenderError;

/// Storage buffers the busiest stage binds.
const STORAGE_BUFFERS: u32 = 8;
/// Invocations of the largest workgroup.
const INVOCATIONS: u32 = 256;
/// Workgroup memory of the hungriest stage, bytes.
const WORKGROUP_BYTES: u32 = 16 << 10;
/// Frame, tiles, the stage's own.
const BIND_GROUPS: u32 = 3;
/// Bytes of the largest buffer bound at once: a page of the pool, a feature's tables.
const BINDING_BYTES: u64 = 128 << 20;
/// Texels a side of a colour tile.
const TEXTURE_SIDE: u32 = 256;

/// Tells whether a device can carry a terrain. WebGPU's default limits can.
///
/// # Errors
///
/// [`RenderError::LimitTooSmall`] names the first limit that is too small.
pub fn check_limits(limits: &wgpu::Limits) -> Result<(), RenderError> {
    let wanted = [
        (
            "maxStorageBuffersPerShaderStage",
            STORAGE_BUFFERS,
            limits.max_storage_buffers_per_shader_stage,
        ),
        (
            "maxComputeInvocationsPerWorkgroup",
            INVOCATIONS,
            limits.max_compute_invocations_per_workgroup,
        ),
        (
            "maxComputeWorkgroupSizeX",
            INVOCATIONS,
            limits.max_compute_workgroup_size_x,
        ),
        (
            "maxComputeWorkgroupStorageSize",
            WORKGROUP_BYTES,
            limits.max_compute_workgroup_storage_size,
        ),
        ("maxBindGroups", BIND_GROUPS, limits.max_bind_groups),
        (
            "maxDynamicUniformBuffersPerPipelineLayout",
            1,
            limits.max_dynamic_uniform_buffers_per_pipeline_layout,
        ),
        (
            "maxTextureDimension2D",
            TEXTURE_SIDE,
            limits.max_texture_dimension_2d,
        ),
    ];
    let wanted = wanted.map(|(limit, needed, found)| (limit, u64::from(needed), u64::from(found)));
    let bytes = [
        (
            "maxStorageBufferBindingSize",
            BINDING_BYTES,
            limits.max_storage_buffer_binding_size,
        ),
        ("maxBufferSize", BINDING_BYTES, limits.max_buffer_size),
    ];
    let mut wanted = wanted.into_iter().chain(bytes);
    match wanted.find(|&(_, needed, found)| found < needed) {
        None => Ok(()),
        Some((limit, needed, found)) => Err(RenderError::LimitTooSmall {
            limit,
            needed,
            found,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_limits_of_webgpu_are_enough() {
        assert!(check_limits(&wgpu::Limits::default()).is_ok());
    }

    #[test]
    fn a_device_with_four_storage_buffers_is_refused_by_name() {
        let error = check_limits(&wgpu::Limits::downlevel_defaults()).expect_err("too small");
        assert!(error.to_string().contains("max"), "{error}");
    }
}
