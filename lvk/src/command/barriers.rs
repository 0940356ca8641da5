//! From declared uses to recorded barriers.

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
    /// The next command uses a buffer.
    pub(crate) fn use_buffer(&mut self, buffer: &Buffer, next: Use) {
        let RecordingState { accesses, host_reads, .. } = &mut **self.state;
        use_buffer(accesses, host_reads, buffer, next);
    }

    /// The next command uses a part of the image that a texture shows.
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

    /// The next command's shaders trace rays in these stages.
    pub(super) fn use_accel_structs(&mut self, stages: Stages) {
        let reads = accel_struct_reads(&self.shared, self.recording.queue_index, stages);
        reads.into_iter().for_each(|(id, read)| self.state.accesses.add_id(id, read));
    }

    /// The pass that begins sees what this command buffer has built: no barrier can be placed once it is open, and only
    /// then is a pipeline bound that may query rays.
    pub(super) fn use_built_accel_structs(&mut self) {
        let reads = |stages| accel_struct_reads(&self.shared, self.recording.queue_index, stages);
        if let Some(stages) = self.shared.graphics_queries.waiting_stages(&self.recording.tracker, reads) {
            self.use_accel_structs(stages);
        }
    }

    /// The next command's shaders reach these in `stages`.
    #[inline(always)]
    pub(super) fn use_dependencies(&mut self, deps: &Dependencies<'_>, stages: Stages) -> Result<()> {
        // Most lists are empty: asked here, where that is quick.
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

    /// The next command's shaders reach a part of each texture, which must have the usage.
    #[inline(always)]
    fn use_images(
        &mut self,
        handles: &[TextureHandle],
        usage: TextureUsage,
        next: Use,
        part: impl Fn(&Texture) -> Subresources,
    ) -> Result<()> {
        let pool = &self.shared.store.textures;
        let RecordingState { accesses, texture_cache: found, .. } = &mut **self.state;
        for handle in handles {
            let row = found.index_of_handle(pool, *handle)?;
            let texture = found.object(row);
            texture.check_usage(usage)?;
            accesses.add_texture(found, row, part(texture), next)?;
        }
        Ok(())
    }

    /// The next command's shaders reach these buffers.
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

    /// Records the barriers in front of the next command.
    #[inline(never)]
    pub(crate) fn flush_barriers(&mut self) {
        self.end_rendering();
        let Recording { commands, tracker, images, .. } = &mut **self.recording;
        let RecordingState {
            accesses, texture_cache: found_textures, barriers, last_barrier, build_run, ..
        } = &mut **self.state;
        build_run.stop();
        barriers.clear();
        accesses.track(found_textures, tracker, images, barriers);
        emit(&self.shared.gpu, *commands, barriers, images, last_barrier);
    }

    /// In front of a command that runs shaders: makes what copies wrote readable, runs `gather`, then records the
    /// barriers; forgets the uses if gathering fails.
    pub(super) fn flush_barriers_after(
        &mut self,
        gather: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        self.make_visible();
        match gather(self) {
            Ok(()) => {
                self.flush_barriers();
                Ok(())
            }
            Err(error) => {
                self.state.accesses.clear();
                Err(error)
            }
        }
    }
}

/// A command uses a buffer; what it writes in mapped memory is for the host to read afterwards.
fn use_buffer(accesses: &mut CommandAccesses, host_reads: &mut Vec<ResourceId>, buffer: &Buffer, next: Use) {
    accesses.add_buffer(buffer, next);
    if next.is_write() && buffer.memory.mapped() && !host_reads.contains(&buffer.id) {
        host_reads.push(buffer.id);
    }
}

/// Everything that shaders of `stages` read when they trace rays.
fn accel_struct_reads(shared: &DeviceState, queue_index: usize, stages: Stages) -> [(ResourceId, Use); 4] {
    let read = match shared.gpu.caps.software_ray_query() {
        true => Use::software_traversal(stages),
        false => Use::accel_read(stages),
    };
    let tables = (shared.hit_tables_id, Use::shader_read(stages));
    [(shared.all_blas, read), (shared.new_blas[queue_index], read), (shared.all_tlas, read), tables]
}
