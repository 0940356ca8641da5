//! Binds pipelines and the bindless set, and records push constants.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use crate::error::{Error, Result};

impl CommandBuffer {
    /// Sets the push constants of the pipeline bound last, for this and later pipelines.
    ///
    /// `constants` must match the shader's block, up to padding at the end (`vkCmdPushConstants`).
    #[inline]
    pub fn push_constants<T: bytemuck::NoUninit>(&mut self, constants: &T) -> Result<()> {
        let bytes = bytemuck::bytes_of(constants);
        let size = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        if self.state.push_constants.is_whole(size) {
            self.record_push(0, bytes);
            return Ok(());
        }
        self.push_partial_block(bytes)
    }

    /// Pushes bytes whose number differs from the bound pipeline's block, or returns the error for them.
    #[cold]
    fn push_partial_block(&mut self, bytes: &[u8]) -> Result<()> {
        self.state.push_constants.check_whole(bytes.len())?;
        self.push_constant_bytes(0, bytes)
    }

    /// Sets part of the push constants: `bytes` from `offset` on. The offset and the number of bytes are multiples of
    /// 4.
    pub fn push_constant_bytes(&mut self, offset: u32, bytes: &[u8]) -> Result<()> {
        let size = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        self.state.push_constants.check_range(offset, size)?;
        let layout_bytes = self.shared.layout.push_constant_bytes.saturating_sub(offset) as usize;
        self.record_push(offset, &bytes[..bytes.len().min(layout_bytes)]);
        Ok(())
    }

    /// Pushes bytes inside the layout's range. Inlined, so that bytes whose number the caller knows are copied without
    /// a call.
    #[inline]
    fn record_push(&mut self, offset: u32, bytes: &[u8]) {
        let shared = &self.shared;
        // SAFETY: the layout is alive and the range lies inside its push constants.
        unsafe {
            let stages = vk::ShaderStageFlags::ALL;
            shared.gpu.device.cmd_push_constants(self.raw(), shared.layout.raw, stages, offset, bytes);
        }
        self.state.push_constants.store(offset, bytes);
    }

    /// Binds a pipeline, and the bindless set on the first use of its bind point.
    pub(super) fn bind_pipeline(
        &mut self,
        point: vk::PipelineBindPoint,
        pipeline: vk::Pipeline,
        name: &Arc<str>,
        push_constant_bytes: u32,
    ) {
        // SAFETY: the pipeline is alive.
        unsafe { self.shared.gpu.device.cmd_bind_pipeline(self.raw(), point, pipeline) };
        self.bind_set(point);
        self.expect_push_block(name, push_constant_bytes);
    }

    /// Binds the bindless set on the first use of a bind point.
    pub(super) fn bind_set(&mut self, point: vk::PipelineBindPoint) {
        if self.state.sets_bound.contains(&point) {
            return;
        }
        let (shared, raw) = (&self.shared, self.raw());
        let sets = [shared.bindless.set];
        // SAFETY: the set is alive, and has the layout of every pipeline.
        unsafe { shared.gpu.device.cmd_bind_descriptor_sets(raw, point, shared.layout.raw, 0, &sets, &[]) };
        self.state.sets_bound.push(point);
    }

    /// Records that the push constants are those of a pipeline with a block of this size.
    pub(super) fn expect_push_block(&mut self, name: &Arc<str>, push_constant_bytes: u32) {
        let layout_bytes = self.shared.layout.push_constant_bytes;
        self.state.push_constants.expect_block(name, push_constant_bytes, layout_bytes);
    }

    /// True if all these 4-byte words were pushed; see [`word_mask`](super::push_constants::word_mask).
    #[inline]
    pub(super) fn has_pushed(&self, needed: u64) -> bool {
        self.state.push_constants.has_pushed(needed)
    }

    /// Fails if a pipeline about to run reads bytes that were never pushed.
    #[inline]
    pub(super) fn check_pushed(&self, pipeline: &str, expected: u32) -> Result<()> {
        self.state.push_constants.check_pushed(pipeline, expected)
    }

    /// Returns the error for push constants that were never pushed.
    pub(super) fn missing_constants_error(&self, pipeline: &str, expected: u32) -> Error {
        self.state.push_constants.missing_error(pipeline, expected)
    }
}
