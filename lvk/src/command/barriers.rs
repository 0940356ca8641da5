//! From declared uses to recorded barriers.

use std::sync::Arc;

use super::CommandBuffer;
use super::accesses::Uses;
use super::dependencies::Dependencies;
use super::recording_state::Notes;
use crate::barrier::{ResourceId, Stages, Subresources, Use};
use crate::device_state::Shared;
use crate::error::Result;
use crate::handle::{BufferHandle, TextureHandle};
use crate::resource::texture_desc::TextureUsage;
use crate::resource::{Buffer, Texture};
use crate::submit::Recording;
use crate::submit::emit_barriers::emit;

impl CommandBuffer {
    /// The next command uses a buffer.
    pub(crate) fn use_buffer(&mut self, buffer: &Buffer, next: Use) {
        let Notes { uses, host_reads, .. } = &mut **self.notes;
        use_buffer(uses, host_reads, buffer, next);
    }

    /// The next command uses a part of the image that a texture shows.
    pub(super) fn use_texture(
        &mut self,
        texture: &Arc<Texture>,
        part: Subresources,
        next: Use,
    ) -> Result<()> {
        let Notes { uses, found_textures, .. } = &mut **self.notes;
        let row = found_textures.row(texture);
        uses.texture(found_textures, row, part, next)
    }

    /// The next command's shaders trace rays in these stages.
    pub(super) fn use_structures(&mut self, stages: Stages) {
        let reads = structure_reads(&self.shared, self.recording.queue_index, stages);
        reads.into_iter().for_each(|(id, read)| self.notes.uses.id(id, read));
    }

    /// The pass that begins sees what this command buffer has built: no barrier can be placed once it is open, and only
    /// then is a pipeline bound that may query rays.
    pub(super) fn use_built_structures(&mut self) {
        let reads = |stages| structure_reads(&self.shared, self.recording.queue_index, stages);
        if let Some(stages) = self.shared.graphics_queries.waiting_stages(&self.recording.tracker, reads) {
            self.use_structures(stages);
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
            self.use_structures(stages);
        }
        if deps.wait_for.is_empty() { Ok(()) } else { self.wait_for(deps.wait_for) }
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
        let Notes { uses, found_textures: found, .. } = &mut **self.notes;
        for handle in handles {
            let row = found.find(pool, *handle)?;
            let texture = found.at(row);
            texture.check_usage(usage)?;
            uses.texture(found, row, part(texture), next)?;
        }
        Ok(())
    }

    /// The next command's shaders reach these buffers.
    #[inline(never)]
    fn use_buffers(&mut self, handles: &[BufferHandle], next: Use) -> Result<()> {
        let pool = &self.shared.store.buffers;
        let Notes { uses, host_reads, found_buffers: found, .. } = &mut **self.notes;
        for handle in handles {
            let row = found.find(pool, *handle)?;
            use_buffer(uses, host_reads, found.at(row), next);
        }
        Ok(())
    }

    /// Records the barriers in front of the next command.
    #[inline(never)]
    pub(super) fn flush(&mut self) {
        self.end_rendering();
        let Recording { commands, tracker, images, .. } = &mut **self.recording;
        let Notes { uses, found_textures, barriers, last_barrier, build_run, .. } = &mut **self.notes;
        build_run.stop();
        barriers.clear();
        uses.track(found_textures, tracker, images, barriers);
        emit(&self.shared.gpu, *commands, barriers, images, last_barrier);
    }

    /// In front of a command that runs shaders: makes what copies wrote readable, runs `gather`, then records the
    /// barriers; forgets the uses if gathering fails.
    pub(super) fn flush_after(&mut self, gather: impl FnOnce(&mut Self) -> Result<()>) -> Result<()> {
        self.settle();
        match gather(self) {
            Ok(()) => {
                self.flush();
                Ok(())
            }
            Err(error) => {
                self.notes.uses.clear();
                Err(error)
            }
        }
    }
}

/// A command uses a buffer; what it writes in mapped memory is for the host to read afterwards.
fn use_buffer(uses: &mut Uses, host_reads: &mut Vec<ResourceId>, buffer: &Buffer, next: Use) {
    uses.buffer(buffer, next);
    if next.is_write() && buffer.memory.mapped() && !host_reads.contains(&buffer.id) {
        host_reads.push(buffer.id);
    }
}

/// Everything that shaders of `stages` read when they trace rays.
fn structure_reads(shared: &Shared, queue_index: usize, stages: Stages) -> [(ResourceId, Use); 4] {
    let read = match shared.gpu.caps.software_ray_query() {
        true => Use::software_traversal(stages),
        false => Use::accel_read(stages),
    };
    let tables = (shared.tlas_tables, Use::shader_read(stages));
    [(shared.all_blas, read), (shared.new_blas[queue_index], read), (shared.all_tlas, read), tables]
}
