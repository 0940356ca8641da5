//! Traces of pipelines that are lowered to compute shaders.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::dependencies::Dependencies;
use super::push_constants::PushConstants;
use crate::barrier::{Stages, Use};
use crate::device_state::DeferredObject;
use crate::error::limit_origin::LimitOrigin;
use crate::error::{Error, Result, check_limit, check_limit_of};
use crate::kernels::{Kernel, TraceSizePushConstants};
use crate::pipeline::lowered::{LoweredPipeline, launch_offset};
use crate::pipeline::ray_tracing::TraceRegions;
use crate::pipeline::{ComputePipeline, RayTracingPipeline};
use crate::resource::Buffer;
use crate::shader::spirv::lower::{Launch, WORKGROUP_SIZE};

/// Sides of the block of rays that a workgroup of a launch with several rows traces.
const BLOCK: u32 = 8;
const _: () = assert!(BLOCK * BLOCK == WORKGROUP_SIZE);

/// Bytes of the workgroup counts in front of the launch block of an indirect trace, with padding.
const WORKGROUP_BYTES: usize = 16;

/// Most bytes of a launch block with the push constants behind it.
const MAX_LAUNCH_BYTES: usize = Launch::PUSH_CONSTANTS as usize + PushConstants::MAX_BYTES;

/// A trace of a lowered pipeline, without its size.
pub(super) struct LoweredTrace<'a> {
    pipeline: &'a RayTracingPipeline,
    shader: &'a ComputePipeline,
    launch: Launch,
}

impl<'a> LoweredTrace<'a> {
    /// Returns the trace from ray generation shader `ray_gen`, which has these regions.
    pub(super) fn new(
        pipeline: &'a RayTracingPipeline,
        lowered: &'a LoweredPipeline,
        regions: &TraceRegions,
        ray_gen: u32,
    ) -> Result<Self> {
        let Some(shader) = lowered.shader(ray_gen) else {
            let message = format!("ray generation shader {ray_gen} does not exist");
            return Err(Error::usage(&*pipeline.name, message));
        };
        let launch = Launch {
            ray_gen: regions.ray_gen.device_address,
            regions: [&regions.miss, &regions.hit, &regions.callable].map(|region| region.device_address),
            ..Launch::default()
        };
        Ok(Self { pipeline, shader, launch })
    }
}

impl CommandBuffer {
    /// Runs the compute shader of a trace with `size` rays (`vkCmdDispatch`).
    pub(super) fn trace_lowered(
        &mut self,
        trace: &LoweredTrace<'_>,
        size: [u32; 3],
        dependencies: &Dependencies<'_>,
    ) -> Result<()> {
        let limits = &self.shared.gpu.caps.limits;
        let (most_rays, most) = (limits.max_trace_invocations, limits.max_dispatch_workgroups);
        let [x, y, z] = launch_workgroups(&trace.pipeline.name, size, most_rays, most)?;
        if x == 0 {
            return Ok(());
        }
        let (bytes, count) = self.launch_bytes(trace, size);
        let mut address = 0;
        self.flush_barriers_after(|cmd| {
            address = cmd.upload_bytes(&bytes[..count], size_of::<u64>() as u64)?;
            cmd.use_trace(trace.pipeline, Stages::COMPUTE, dependencies)
        })?;
        self.bind_lowered(trace, address);
        // SAFETY: a compute pipeline is bound and the counts are within the limits.
        unsafe { self.shared.gpu.device.cmd_dispatch(self.raw(), x, y, z) };
        self.restore_compute();
        Ok(())
    }

    /// Runs the compute shader of a trace with a size from `offset` in `arguments` on (`vkCmdDispatchIndirect`).
    pub(super) fn trace_lowered_indirect(
        &mut self,
        trace: &LoweredTrace<'_>,
        arguments: &Buffer,
        offset: u64,
        dependencies: &Dependencies<'_>,
    ) -> Result<()> {
        let kernel = self.kernel_pipeline(Kernel::TraceSize)?;
        let launch = self.new_launch_buffer(trace)?;
        let size = launch.address + WORKGROUP_BYTES as u64;
        let of_trace =
            self.collect_for_later(|cmd| cmd.use_trace(trace.pipeline, Stages::COMPUTE, dependencies))?;
        self.use_buffer(arguments, Use::shader_read(Stages::COMPUTE));
        self.state.accesses.add_buffer(&launch, Use::shader_write(Stages::COMPUTE));
        self.flush_barriers();
        let push = TraceSizePushConstants {
            arguments: arguments.address + offset,
            workgroups: launch.address,
            size,
            max_workgroups: self.shared.gpu.caps.limits.max_dispatch_workgroups[0],
            unused: 0,
        };
        self.dispatch_kernel(Some(&kernel), bytemuck::bytes_of(&push), [1, 1, 1]);
        // Nothing fails from the kernel on until the caller's pipeline is bound again.
        self.restore_accesses(of_trace);
        self.state.accesses.add_buffer(&launch, Use::indirect());
        self.state.accesses.add_buffer(&launch, Use::shader_read(Stages::COMPUTE));
        self.flush_barriers();
        self.restore_push_constants();
        self.bind_lowered(trace, size);
        // SAFETY: a compute pipeline is bound, and the counts lie at the start of the buffer, where the kernel writes them.
        // The caller keeps the size within the limits.
        unsafe { self.shared.gpu.device.cmd_dispatch_indirect(self.raw(), launch.raw, 0) };
        self.restore_compute();
        Ok(())
    }

    /// Returns a buffer for the workgroup counts, which a kernel writes, and the launch block without its size.
    fn new_launch_buffer(&self, trace: &LoweredTrace<'_>) -> Result<Arc<Buffer>> {
        let (bytes, count) = self.launch_bytes(trace, [0; 3]);
        let (shared, all) = (&self.shared, (WORKGROUP_BYTES + MAX_LAUNCH_BYTES) as u64);
        let buffer = shared.launch_buffers.acquire(&shared.gpu, "launch of an indirect trace", all)?;
        buffer.fill_with(|out| {
            let place = out.get_mut(WORKGROUP_BYTES..WORKGROUP_BYTES + count);
            place.into_iter().for_each(|place| place.copy_from_slice(&bytes[..count]));
        });
        shared.free_later(DeferredObject::LaunchBuffer(Arc::clone(&buffer)));
        Ok(buffer)
    }

    /// Returns the launch block with the push constants of the pipeline behind it, and the number of their bytes.
    fn launch_bytes(&self, trace: &LoweredTrace<'_>, size: [u32; 3]) -> ([u8; MAX_LAUNCH_BYTES], usize) {
        let mut bytes = [0; MAX_LAUNCH_BYTES];
        let (block, behind) = bytes.split_at_mut(Launch::PUSH_CONSTANTS as usize);
        block.copy_from_slice(bytemuck::bytes_of(&Launch { size, ..trace.launch }));
        let pushed = self.state.push_constants.pushed_bytes();
        let count = (trace.pipeline.push_constant_bytes as usize).min(pushed.len());
        behind[..count].copy_from_slice(&pushed[..count]);
        (bytes, Launch::PUSH_CONSTANTS as usize + count)
    }

    /// Binds the shader of a trace, and pushes the address of its launch block.
    fn bind_lowered(&mut self, trace: &LoweredTrace<'_>, launch: u64) {
        let (point, stages) = (vk::PipelineBindPoint::COMPUTE, vk::ShaderStageFlags::ALL);
        self.bind_set(point);
        let (device, layout, raw) = (&self.shared.gpu.device, &self.shared.layout, self.raw());
        let offset = launch_offset(layout.push_constant_bytes);
        // SAFETY: the pipeline is alive and has the layout, whose push constants contain the address.
        unsafe {
            device.cmd_bind_pipeline(raw, point, trace.shader.raw);
            device.cmd_push_constants(raw, layout.raw, stages, offset, bytemuck::bytes_of(&launch));
        }
    }
}

/// Returns the workgroups of a launch, all 0 for a launch without rays. `most` are the device's largest counts.
///
/// # Errors
/// [`LimitExceeded`](Error::LimitExceeded) for a launch with more than `most_rays` rays, or that needs more workgroups.
fn launch_workgroups(pipeline: &str, size: [u32; 3], most_rays: u32, most: [u32; 3]) -> Result<[u32; 3]> {
    let rays = size.iter().fold(1_u64, |all, side| all.saturating_mul((*side).into()));
    check_limit_of(LimitOrigin::Library, pipeline, "number of rays", rays, most_rays.into())?;
    let counts = match size {
        _ if size.contains(&0) => return Ok([0; 3]),
        [width, 1, 1] => {
            let count = width.div_ceil(WORKGROUP_SIZE);
            let rows = count.div_ceil(most[0].max(1));
            [count.div_ceil(rows), rows, 1]
        }
        [width, height, depth] => [width.div_ceil(BLOCK), height.div_ceil(BLOCK), depth],
    };
    for (count, most) in counts.into_iter().zip(most) {
        let what = "number of workgroups along an axis of the trace";
        check_limit(pipeline, what, count.into(), most.into())?;
    }
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::gpu::caps::limits::lowered::MAX_RAYS;

    const MOST: [u32; 3] = [65_535; 3];

    #[test]
    fn long_rows_continue_along_y() {
        let workgroups = |size| launch_workgroups("p", size, MAX_RAYS, MOST).unwrap();
        assert_eq!(workgroups([1, 1, 1]), [1, 1, 1]);
        assert_eq!(workgroups([65, 1, 1]), [2, 1, 1]);
        assert_eq!(workgroups([64 * 65_535, 1, 1]), [65_535, 1, 1]);
        assert_eq!(workgroups([64 * 65_535 + 1, 1, 1]), [32_768, 2, 1]);
        assert_eq!(workgroups([9, 8, 3]), [2, 1, 3]);
        assert_eq!(workgroups([9, 1, 2]), [2, 1, 2]);
        assert_eq!(workgroups([7, 0, 2]), [0; 3]);
    }

    #[test]
    fn launches_beyond_the_limits_are_refused() {
        for (size, what) in [
            ([8 * 65_535 + 1, 2, 1], "number of workgroups along an axis of the trace"),
            ([2, 8 * 65_535 + 1, 1], "number of workgroups along an axis of the trace"),
            ([2, 2, 65_536], "number of workgroups along an axis of the trace"),
            ([65_536, 65_536, 1], "number of rays"),
        ] {
            let error = launch_workgroups("p", size, MAX_RAYS, MOST).unwrap_err();
            assert!(matches!(error, Error::LimitExceeded { what: found, .. } if found == what), "{error}");
        }
    }

    proptest! {
        #[test]
        fn every_ray_has_one_invocation(width in 1..=MAX_RAYS, most in 1024..=u32::MAX) {
            let limits = [most, 65_535, 65_535];
            if let Ok([x, y, z]) = launch_workgroups("p", [width, 1, 1], MAX_RAYS, limits) {
                let invocations = u64::from(x) * u64::from(y) * u64::from(WORKGROUP_SIZE);
                prop_assert!(x <= most && z == 1);
                prop_assert!(invocations >= u64::from(width));
                prop_assert!(invocations <= 1 << 32, "the shader counts them in 32 bits");
            }
        }
    }

    /// The last row of workgroups is longer than necessary, so the indices of so many invocations would wrap.
    #[test]
    fn launches_whose_indices_would_wrap_are_refused() {
        let [x, y, _] = launch_workgroups("p", [u32::MAX, 1, 1], u32::MAX, MOST).unwrap();
        assert!(u64::from(x) * u64::from(y) * u64::from(WORKGROUP_SIZE) > 1 << 32);
        let error = launch_workgroups("p", [u32::MAX, 1, 1], MAX_RAYS, MOST).unwrap_err();
        assert!(matches!(error, Error::LimitExceeded { what: "number of rays", .. }), "{error}");
        assert_eq!(launch_workgroups("p", [MAX_RAYS, 1, 1], MAX_RAYS, MOST).unwrap(), [65_409, 513, 1]);
    }
}
