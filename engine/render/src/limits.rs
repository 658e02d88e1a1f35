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
            "maxTextureDimension2D",
            TEXTURE_SIDE,
            limits.max_texture_dimension_2d,
        ),
    ];
    match wanted
        .into_iter()
        .find(|&(_, needed, found)| found < needed)
    {
        None => Ok(()),
        Some((limit, needed, found)) => Err(RenderError::LimitTooSmall {
            limit,
            needed: needed.into(),
            found: found.into(),
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
