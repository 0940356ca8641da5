//! Turns declared uses into recorded barriers.

use std::mem::take;
use std::sync::Arc;

use super::CommandBuffer;
use super::accesses::CommandAccesses;
use super::dependencies::Dependencies;
use super::recording_state::RecordingState;
use crate::barrier::{ResourceId, Stages, Subresources, Use};
use crate::device_state::DeviceState;
use crate::error::Result;
use crate::handle::{BufferHandle, TextureHandle};
use crate::resource::texture_desc::TextureUsage;
use crate::resource::{Buffer, Texture};
use crate::submit::Recording;
use crate::submit::emit_barriers::emit;

impl CommandBuffer {
    /// Declares that the next command uses a buffer.
    pub(crate) fn use_buffer(&mut self, buffer: &Buffer, next: Use) {
        let RecordingState { accesses, host_reads, .. } = &mut **self.state;
        use_buffer(accesses, host_reads, buffer, next);
    }

    /// Declares that the next command uses subresources of a texture.
    pub(super) fn use_texture(
        &mut self,
        texture: &Arc<Texture>,
        part: Subresources,
        next: Use,
    ) -> Result<()> {
        let RecordingState { accesses, texture_cache: found_textures, .. } = &mut **self.state;
        let row = found_textures.index_of(texture);
        accesses.add_texture(found_textures, row, part, next)
    }

    /// Declares that the shaders of the next command trace rays in these stages.
    pub(super) fn use_accel_structs(&mut self, stages: Stages) {
        let reads = accel_struct_reads(&self.shared, self.recording.queue_index, stages);
        reads.into_iter().for_each(|(id, read)| self.state.accesses.add_id(id, read));
    }

    /// Makes acceleration structures that this command buffer has built visible to the pass that begins. No barrier can
    /// be recorded inside the pass, where pipelines that may query rays are bound.
    pub(super) fn use_built_accel_structs(&mut self) {
        let reads = |stages| accel_struct_reads(&self.shared, self.recording.queue_index, stages);
        if let Some(stages) = self.shared.graphics_queries.waiting_stages(&self.recording.tracker, reads) {
            self.use_accel_structs(stages);
        }
    }

    /// Declares that the shaders of the next command access these resources in `stages`.
    #[inline(always)]
    pub(super) fn use_dependencies(&mut self, deps: &Dependencies<'_>, stages: Stages) -> Result<()> {
        // Most lists are empty, and a check here is cheap.
        if !deps.sampled_images.is_empty() {
            let (usage, next) = (TextureUsage::SAMPLED, Use::shader_read(stages));
            self.use_images(deps.sampled_images, usage, next, |texture| texture.range)?;
        }
        if !deps.storage_images.is_empty() {
            let (usage, next) = (TextureUsage::STORAGE, Use::shader_write(stages));
            self.use_images(deps.storage_images, usage, next, |texture| texture.stored_part)?;
        }
        if !deps.buffers.is_empty() {
            self.use_buffers(deps.buffers, Use::shader_write(stages))?;
        }
        if !deps.read_buffers.is_empty() {
            self.use_buffers(deps.read_buffers, Use::shader_read(stages))?;
        }
        for handle in deps.acceleration_structures {
            self.shared.store.accel_structs.get(*handle)?;
            self.use_accel_structs(stages);
        }
        if deps.wait_for.is_empty() { Ok(()) } else { self.wait_for_resource(deps.wait_for) }
    }

    /// Declares that the shaders of the next command access a part of each texture, which must have the usage.
    #[inline(always)]
    fn use_images(
        &mut self,
        handles: &[TextureHandle],
        usage: TextureUsage,
        next: Use,
        part: impl Fn(&Texture) -> Subresources,
    ) -> Result<()> {
        let pool = &self.shared.store.textures;
        let RecordingState { accesses, texture_cache: found, declared, .. } = &mut **self.state;
        for handle in handles {
            let row = found.index_of_handle(pool, *handle)?;
            let texture = found.object(row);
            texture.check_usage(usage)?;
            if self.shared.bindless.checks.is_some() {
                declared.push((texture.slot, next.is_write()));
            }
            accesses.add_texture(found, row, part(texture), next)?;
        }
        Ok(())
    }

    /// Declares that the shaders of the next command access these buffers.
    #[inline(never)]
    fn use_buffers(&mut self, handles: &[BufferHandle], next: Use) -> Result<()> {
        let pool = &self.shared.store.buffers;
        let RecordingState { accesses, host_reads, buffer_cache: found, .. } = &mut **self.state;
        for handle in handles {
            let row = found.index_of_handle(pool, *handle)?;
            use_buffer(accesses, host_reads, found.object(row), next);
        }
        Ok(())
    }

    /// Records the barriers before the next command.
    #[inline(never)]
    pub(crate) fn flush_barriers(&mut self) {
        self.end_rendering();
        self.record_declarations();
        let Recording { commands, tracker, images, .. } = &mut **self.recording;
        let RecordingState {
            accesses, texture_cache: found_textures, barriers, last_barrier, build_run, ..
        } = &mut **self.state;
        build_run.stop();
        barriers.clear();
        accesses.track(found_textures, tracker, images, barriers);
        emit(&self.shared.gpu, *commands, barriers, images, last_barrier);
    }

    /// Records the barriers of a command that runs shaders: makes the results of copies visible, runs `gather`, then
    /// records the barriers. Clears the accesses if `gather` fails.
    pub(super) fn flush_barriers_after(
        &mut self,
        gather: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        self.gather_accesses(gather)?;
        self.flush_barriers();
        Ok(())
    }

    /// Returns the accesses of a command before which a kernel runs, with accesses of its own. `gather` is as for
    /// [`flush_barriers_after`](Self::flush_barriers_after).
    pub(super) fn collect_for_later(
        &mut self,
        gather: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<LaterAccesses> {
        self.gather_accesses(gather)?;
        let RecordingState { accesses, declared, .. } = &mut **self.state;
        Ok(LaterAccesses { accesses: take(accesses), declared: take(declared) })
    }

    /// Puts accesses back that were gathered for later. Those of the kernel are recorded by now.
    pub(super) fn restore_accesses(&mut self, later: LaterAccesses) {
        (self.state.accesses, self.state.declared) = (later.accesses, later.declared);
    }

    fn gather_accesses(&mut self, gather: impl FnOnce(&mut Self) -> Result<()>) -> Result<()> {
        self.make_visible();
        gather(self).inspect_err(|_| {
            self.state.accesses.clear();
            self.state.declared.clear();
        })
    }
}

/// Accesses of a command that is recorded after a kernel. Its handles are not looked up again: another thread may destroy
/// an object in the meantime.
pub(super) struct LaterAccesses {
    accesses: CommandAccesses,
    declared: Vec<(u32, bool)>,
}

/// Adds an access to a buffer. The end of the recording makes writes to mapped memory visible to the host.
fn use_buffer(accesses: &mut CommandAccesses, host_reads: &mut Vec<ResourceId>, buffer: &Buffer, next: Use) {
    accesses.add_buffer(buffer, next);
    if next.is_write() && buffer.memory.mapped() && !host_reads.contains(&buffer.id) {
        host_reads.push(buffer.id);
    }
}

/// Returns the accesses of shaders in `stages` that trace rays.
fn accel_struct_reads(shared: &DeviceState, queue_index: usize, stages: Stages) -> [(ResourceId, Use); 4] {
    let read = match shared.gpu.caps.builds_software_structures() {
        true => Use::software_traversal(stages),
        false => Use::accel_read(stages),
    };
    let tables = (shared.hit_tables_id, Use::shader_read(stages));
    [(shared.all_blas, read), (shared.new_blas[queue_index], read), (shared.all_tlas, read), tables]
}
