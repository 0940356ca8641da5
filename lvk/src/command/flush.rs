//! From declared uses to recorded barriers.

use std::sync::Arc;

use super::CommandBuffer;
use super::dependencies::Dependencies;
use super::uses::Uses;
use crate::barrier::{ResourceId, Stages, Subresources, Use};
use crate::error::Result;
use crate::resource::texture_desc::TextureUsage;
use crate::resource::{Buffer, Texture};
use crate::shared::Shared;
use crate::submit::Recording;
use crate::submit::emit::emit;

impl CommandBuffer {
    /// The next command uses a buffer.
    pub(super) fn use_buffer(&mut self, buffer: &Buffer, next: Use) {
        use_buffer(&mut self.uses, &mut self.host_reads, buffer, next);
    }

    /// The next command uses a part of the image that a texture shows.
    pub(super) fn use_texture(
        &mut self,
        texture: &Arc<Texture>,
        part: Subresources,
        next: Use,
    ) -> Result<()> {
        let row = self.found_textures.row(texture);
        self.uses.texture(&self.found_textures, row, part, next)
    }

    /// The next command's shaders trace rays in these stages.
    pub(super) fn use_structures(&mut self, stages: Stages) {
        let reads = structure_reads(&self.shared, self.recording.lane, stages);
        reads.into_iter().for_each(|(id, read)| self.uses.id(id, read));
    }

    /// The pass that begins sees what this command buffer has built: no barrier can be placed once it is open, and only
    /// then is a pipeline bound that may query rays.
    pub(super) fn use_built_structures(&mut self) {
        let reads = |stages| structure_reads(&self.shared, self.recording.lane, stages);
        if let Some(stages) = self.shared.graphics_queries.waiting(&self.recording.tracker, reads) {
            self.use_structures(stages);
        }
    }

    /// The next command's shaders reach these in `stages`.
    pub(super) fn use_dependencies(&mut self, deps: &Dependencies<'_>, stages: Stages) -> Result<()> {
        let (store, found) = (&self.shared.store, &mut self.found_textures);
        for handle in deps.sampled_images {
            let row = found.find(&store.textures, *handle)?;
            let texture = found.at(row);
            texture.check_usage(TextureUsage::SAMPLED)?;
            self.uses.texture(found, row, texture.range, Use::shader_read(stages))?;
        }
        for handle in deps.storage_images {
            let row = found.find(&store.textures, *handle)?;
            let texture = found.at(row);
            texture.check_usage(TextureUsage::STORAGE)?;
            self.uses.texture(found, row, texture.stored_part, Use::shader_write(stages))?;
        }
        let found = &mut self.found_buffers;
        for handle in deps.buffers {
            let row = found.find(&store.buffers, *handle)?;
            use_buffer(&mut self.uses, &mut self.host_reads, found.at(row), Use::shader_write(stages));
        }
        for handle in deps.read_buffers {
            let row = found.find(&store.buffers, *handle)?;
            use_buffer(&mut self.uses, &mut self.host_reads, found.at(row), Use::shader_read(stages));
        }
        for handle in deps.acceleration_structures {
            self.shared.store.accel_structs.get(*handle)?;
            self.use_structures(stages);
        }
        if deps.wait_for.is_empty() { Ok(()) } else { self.wait_for(deps.wait_for) }
    }

    /// Records the barriers in front of the next command.
    #[inline]
    pub(super) fn flush(&mut self) {
        self.end_rendering();
        self.scratch_run.stop();
        let Recording { commands, tracker, images, .. } = &mut *self.recording;
        self.barriers.clear();
        self.uses.track(&self.found_textures, tracker, images, &mut self.barriers);
        emit(&self.shared.gpu, *commands, &self.barriers, images);
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
                self.uses.clear();
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
fn structure_reads(shared: &Shared, lane: usize, stages: Stages) -> [(ResourceId, Use); 4] {
    let read = match shared.gpu.caps.software_ray_query() {
        true => Use::structure_walk(stages),
        false => Use::accel_read(stages),
    };
    let tables = (shared.tlas_tables, Use::shader_read(stages));
    [(shared.all_blas, read), (shared.new_blas[lane], read), (shared.all_tlas, read), tables]
}
