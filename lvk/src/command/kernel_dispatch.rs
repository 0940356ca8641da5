//! Runs the library's own compute shaders between the caller's commands, and restores the caller's compute state.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use crate::accel::AccelStruct;
use crate::accel::blas::Blas;
use crate::accel::geometry::BlasGeometry;
use crate::barrier::{Stages, Use};
use crate::error::Result;
use crate::format::IndexFormat;
use crate::kernels::{GatherPushConstants, Kernel, workgroup_counts};
use crate::pipeline::ComputePipeline;

const KIND_NO_INDICES: u32 = 0;
const KIND_INDICES_16: u32 = 1;
const KIND_INDICES_32: u32 = 2;
const KIND_BOXES: u32 = 3;
const BOX_BYTES: u64 = 24;

impl CommandBuffer {
    /// Gathers indices and AABBs for the parts of BLAS that are built, or refitted if the flag is true. A refit moves
    /// vertices or AABBs, never indices.
    pub(super) fn gather_inputs<'a>(
        &mut self,
        builds: impl Iterator<Item = (&'a AccelStruct, bool)>,
    ) -> Result<()> {
        let mut runs = Vec::new();
        for (target, refit) in builds {
            let planned = self.plan_gathers(target.blas()?, refit, &mut runs);
            planned.inspect_err(|_| self.state.accesses.clear())?;
        }
        if runs.is_empty() {
            return Ok(());
        }
        self.flush_barriers();
        self.dispatch_kernel_runs(
            Kernel::Gather,
            runs.iter().map(|push| (bytemuck::bytes_of(push), push.count)),
        )
    }

    fn plan_gathers(&mut self, blas: &Blas, refit: bool, runs: &mut Vec<GatherPushConstants>) -> Result<()> {
        for part in &blas.parts {
            let Some(map) = &part.map else { continue };
            let Some(inputs) = map.gathered_inputs() else { continue };
            let counts = part.input.ranges.iter().map(|range| range.primitive_count);
            for (index, (geometry, count)) in blas.geometries.iter().zip(counts).enumerate() {
                if count == 0 || (refit && !geometry.is_aabbs()) {
                    continue;
                }
                let source = self.gather_source(geometry)?;
                self.use_buffer(&map.table, Use::shader_read(Stages::COMPUTE));
                self.use_buffer(&inputs, Use::shader_write(Stages::COMPUTE));
                let (numbers, gathered) = (map.primitive_ids_address(index), map.input_address(index));
                runs.push(GatherPushConstants { numbers, gathered, count, ..source });
            }
        }
        Ok(())
    }

    /// Returns the address and the layout of a geometry's inputs.
    fn gather_source(&mut self, geometry: &BlasGeometry) -> Result<GatherPushConstants> {
        let push = |source: u64, kind, box_stride| GatherPushConstants {
            source: source & !3,
            kind,
            odd_half: u32::from(source & 2 != 0),
            box_stride,
            ..bytemuck::Zeroable::zeroed()
        };
        let (handle, offset, kind, stride) = match geometry {
            BlasGeometry::Aabbs(boxes) => {
                let stride = if boxes.stride == 0 { BOX_BYTES } else { boxes.stride };
                (boxes.buffer, boxes.offset, KIND_BOXES, stride as u32)
            }
            BlasGeometry::Triangles(triangles) => match triangles.indices {
                None => return Ok(push(0, KIND_NO_INDICES, 0)),
                Some(indices) => {
                    let short = indices.format == IndexFormat::U16;
                    let kind = if short { KIND_INDICES_16 } else { KIND_INDICES_32 };
                    (indices.buffer, indices.offset, kind, 0)
                }
            },
        };
        let buffer = self.shared.store.buffers.get(handle)?;
        self.use_buffer(&buffer, Use::shader_read(Stages::COMPUTE));
        Ok(push(buffer.address + offset, kind, stride))
    }

    /// Runs a kernel several times, each with its push constants and number of invocations. Expects its barriers to be
    /// recorded. Restores the caller's pipeline and push constants afterwards.
    pub(super) fn dispatch_kernel_runs<'a>(
        &mut self,
        kernel: Kernel,
        runs: impl Iterator<Item = (&'a [u8], u32)>,
    ) -> Result<()> {
        let pipeline = self.kernel_pipeline(kernel)?;
        let mut unbound = Some(&pipeline);
        for (push, invocations) in runs {
            self.dispatch_kernel(unbound.take(), push, workgroup_counts(invocations));
        }
        self.restore_compute();
        Ok(())
    }

    /// Returns the pipeline of a kernel.
    pub(crate) fn kernel_pipeline(&self, kernel: Kernel) -> Result<Arc<ComputePipeline>> {
        let shared = &self.shared;
        shared.kernels.pipeline_of(&shared.gpu, &shared.layout, shared.pipeline_base().cache, kernel)
    }

    /// Dispatches a kernel, after binding `pipeline` if there is one. Expects its barriers to be recorded. Call
    /// [`restore_compute`](Self::restore_compute) after the last dispatch.
    pub(crate) fn dispatch_kernel(
        &self,
        pipeline: Option<&Arc<ComputePipeline>>,
        push: &[u8],
        [x, y, z]: [u32; 3],
    ) {
        let (device, raw) = (&self.shared.gpu.device, self.raw());
        let (point, stages) = (vk::PipelineBindPoint::COMPUTE, vk::ShaderStageFlags::ALL);
        // SAFETY: the pipeline lives as long as the context; it uses no descriptors, and its push constants and
        // workgroups are within every device's limits.
        unsafe {
            if let Some(pipeline) = pipeline {
                device.cmd_bind_pipeline(raw, point, pipeline.raw);
            }
            device.cmd_push_constants(raw, self.shared.layout.raw, stages, 0, push);
            device.cmd_dispatch(raw, x, y, z);
        }
    }

    /// Restores the caller's compute pipeline and push constants after kernels.
    pub(crate) fn restore_compute(&self) {
        if let Some(own) = &self.compute {
            let (device, raw) = (&self.shared.gpu.device, self.raw());
            // SAFETY: the pipeline is alive.
            unsafe { device.cmd_bind_pipeline(raw, vk::PipelineBindPoint::COMPUTE, own.raw) };
        }
        self.restore_push_constants();
    }

    /// Restores the caller's push constants after kernels.
    pub(crate) fn restore_push_constants(&self) {
        let (device, raw) = (&self.shared.gpu.device, self.raw());
        let pushed = self.state.push_constants.pushed_bytes();
        if !pushed.is_empty() {
            let stages = vk::ShaderStageFlags::ALL;
            // SAFETY: the bytes lie inside the push constants of the layout.
            unsafe { device.cmd_push_constants(raw, self.shared.layout.raw, stages, 0, pushed) };
        }
    }
}
