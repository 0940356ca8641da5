//! Everything one command uses, gathered before the tracker is asked, so that a resource used twice counts once.

use std::sync::Arc;

use crate::barrier::{Barriers, ResourceId, Subresources, Tracker, Use};
use crate::error::{Error, Result};
use crate::resource::{Buffer, Texture};
use crate::submit::emit::Images;

/// The uses of one command. Kept in the command buffer and emptied, so that recording does not allocate.
#[derive(Default)]
pub(crate) struct Uses {
    buffers: Vec<(ResourceId, Use)>,
    textures: Vec<(Arc<Texture>, Subresources, Use)>,
    writers: Vec<(ResourceId, Use)>,
}

impl Uses {
    /// The command uses a buffer, or what stands for one.
    pub(crate) fn id(&mut self, id: ResourceId, next: Use) {
        match self.buffers.iter_mut().find(|(known, _)| *known == id) {
            // Layouts mean nothing to buffers, so their uses always merge.
            Some((_, present)) => {
                present.stages |= next.stages;
                present.access |= next.access;
            }
            None => self.buffers.push((id, next)),
        }
    }

    /// The command uses a buffer.
    pub(crate) fn buffer(&mut self, buffer: &Buffer, next: Use) {
        self.id(buffer.id, next);
    }

    /// The command adds to what `id` stands for, next to other writers.
    pub(crate) fn accumulate(&mut self, id: ResourceId, write: Use) {
        if !self.writers.contains(&(id, write)) {
            self.writers.push((id, write));
        }
    }

    /// The command uses part of a texture.
    pub(crate) fn texture(&mut self, texture: Arc<Texture>, part: Subresources, next: Use) -> Result<()> {
        let overlapping = |(known, other, _): &&mut (Arc<Texture>, Subresources, Use)| {
            known.id == texture.id && overlap(part, *other)
        };
        match self.textures.iter_mut().find(overlapping) {
            Some((_, other, present)) => match present.merge(next) {
                Some(merged) if *other == part => *present = merged,
                _ => return Err(conflict(&texture)),
            },
            None => self.textures.push((texture, part, next)),
        }
        Ok(())
    }

    /// Whether the command needs a barrier behind earlier commands of the same command buffer.
    pub(crate) fn need_barriers(&self, tracker: &Tracker) -> bool {
        let buffer = |(id, next): &(ResourceId, Use)| tracker.needs_barrier_buffer(*id, *next);
        let texture = |(texture, part, next): &(Arc<Texture>, Subresources, Use)| {
            tracker.needs_barrier_texture(texture.id, *part, *next)
        };
        self.buffers.iter().any(buffer) || self.textures.iter().any(texture)
    }

    /// Tells the tracker, which adds the barriers to `out`.
    pub(crate) fn track(&mut self, tracker: &mut Tracker, images: &mut Images, out: &mut Barriers) {
        for (id, next) in self.buffers.drain(..) {
            tracker.use_buffer(id, next, out);
        }
        for (id, write) in self.writers.drain(..) {
            tracker.accumulate_buffer(id, write, out);
        }
        for (texture, part, next) in self.textures.drain(..) {
            images.insert(texture.id, (texture.raw, texture.format.aspects()));
            tracker.use_texture(texture.id, texture.shape, part, next, out);
        }
    }

    /// Forgets a command that failed before it was recorded.
    pub(crate) fn clear(&mut self) {
        self.buffers.clear();
        self.textures.clear();
        self.writers.clear();
    }
}

fn overlap(a: Subresources, b: Subresources) -> bool {
    let crosses =
        |first: u32, count: u32, other: u32, others: u32| first < other + others && other < first + count;
    crosses(a.base_mip, a.mip_count, b.base_mip, b.mip_count)
        && crosses(a.base_layer, a.layer_count, b.base_layer, b.layer_count)
}

fn conflict(texture: &Texture) -> Error {
    Error::usage(
        &texture.name,
        "one command uses the texture in two ways that exclude each other; use a second texture or two commands",
    )
}
