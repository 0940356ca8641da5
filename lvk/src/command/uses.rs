//! Everything one command uses, gathered before the tracker is asked, so that a resource used twice counts once.

use std::sync::Arc;

use crate::barrier::{Barriers, IdMap, ResourceId, Subresources, Tracker, Use};
use crate::error::{Error, Result};
use crate::resource::{Buffer, Texture};
use crate::submit::emit::Images;

/// So many are searched one by one, which is faster than a map. Builds of many structures use more.
const FEW: usize = 16;

/// The uses of one command. Kept in the command buffer and emptied, so that recording does not allocate.
#[derive(Default)]
pub(crate) struct Uses {
    buffers: Vec<(ResourceId, Use)>,
    /// Where each of `buffers` is, once they are more than a few; empty before.
    places: IdMap<usize>,
    textures: Vec<(Arc<Texture>, Subresources, Use)>,
    writers: Vec<(ResourceId, Use)>,
}

impl Uses {
    /// The command uses a buffer, or what stands for one.
    pub(crate) fn id(&mut self, id: ResourceId, next: Use) {
        match self.place(id) {
            // Layouts mean nothing to buffers, so their uses always merge.
            Some(place) => {
                let (_, present) = &mut self.buffers[place];
                present.stages |= next.stages;
                present.access |= next.access;
            }
            None => {
                if self.buffers.len() >= FEW {
                    self.places.insert(id, self.buffers.len());
                }
                self.buffers.push((id, next));
            }
        }
    }

    /// Where a buffer that the command uses already is in the list.
    fn place(&mut self, id: ResourceId) -> Option<usize> {
        if self.buffers.len() < FEW {
            return self.buffers.iter().position(|(known, _)| *known == id);
        }
        if self.places.is_empty() {
            self.places.extend(self.buffers.iter().enumerate().map(|(place, (known, _))| (*known, place)));
        }
        self.places.get(&id).copied()
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
        self.places.clear();
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
        self.places.clear();
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::barrier::Stages;

    fn uses() -> [Use; 3] {
        [Use::shader_read(Stages::COMPUTE), Use::transfer_write(), Use::accel_build_input()]
    }

    proptest! {
        /// Few and many, and again after a command was given up.
        #[test]
        fn a_buffer_used_twice_counts_once(
            commands in prop::collection::vec(prop::collection::vec((0..60_u64, 0..3_usize), 0..120), 1..4)
        ) {
            let mut found = Uses::default();
            for command in commands {
                let mut expected: Vec<(ResourceId, Use)> = Vec::new();
                for (id, kind) in command {
                    let (id, next) = (ResourceId(id), uses()[kind]);
                    found.id(id, next);
                    match expected.iter_mut().find(|(known, _)| *known == id) {
                        Some((_, present)) => {
                            present.stages |= next.stages;
                            present.access |= next.access;
                        }
                        None => expected.push((id, next)),
                    }
                }
                prop_assert_eq!(&found.buffers, &expected);
                found.clear();
            }
        }
    }
}
