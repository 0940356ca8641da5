//! All accesses of one command, collected before they go to the tracker, so that a resource used twice counts once.

use std::sync::Arc;

use super::subresource_accesses::{SubresourceAccess, SubresourceAccesses};
use super::transient_steps::TransientSteps;
use crate::barrier::{Barriers, IdMap, ResourceId, Subresources, Tracker, Use};
use crate::error::{Error, Result};
use crate::handle::TextureHandle;
use crate::handle_cache::HandleCache;
use crate::resource::{Buffer, Texture};
use crate::submit::emit_barriers::Images;

/// Up to this length the list is searched linearly, which is faster than a map. Builds of many acceleration structures
/// exceed it.
const LINEAR_SEARCH_MAX: usize = 16;

/// The accesses of one command. The command buffer keeps and clears it, so that recording does not allocate.
#[derive(Default)]
pub(crate) struct CommandAccesses {
    buffers: Vec<(ResourceId, Use)>,
    /// Index of each entry of `buffers`, once the list is longer than `LINEAR_SEARCH_MAX`; empty before.
    index_by_id: IdMap<usize>,
    /// Subresources of images, with the indices of their textures in the cache.
    textures: SubresourceAccesses<usize>,
    writers: Vec<(ResourceId, Use)>,
    /// The steps of transient heaps, which say whether their textures have contents.
    pub(super) transients: TransientSteps,
    /// Number of cached textures whose images are in the [`Images`] of the command buffer.
    known_images: usize,
}

/// The handle cache for the textures that a command buffer uses.
pub(super) type TextureCache = HandleCache<TextureHandle, Texture>;

impl CommandAccesses {
    /// Adds an access to a buffer, or to an id that stands for other resources.
    #[inline]
    pub(crate) fn add_id(&mut self, id: ResourceId, next: Use) {
        match self.index_of(id) {
            // Buffers have no layouts, so their uses always merge.
            Some(index) => {
                let (_, present) = &mut self.buffers[index];
                present.stages |= next.stages;
                present.access |= next.access;
            }
            None => {
                if self.buffers.len() >= LINEAR_SEARCH_MAX {
                    self.index_by_id.insert(id, self.buffers.len());
                }
                self.buffers.push((id, next));
            }
        }
    }

    /// Returns the index of a buffer that the command already uses.
    #[inline]
    fn index_of(&mut self, id: ResourceId) -> Option<usize> {
        if self.buffers.len() < LINEAR_SEARCH_MAX {
            return self.buffers.iter().position(|(known, _)| *known == id);
        }
        if self.index_by_id.is_empty() {
            self.index_by_id
                .extend(self.buffers.iter().enumerate().map(|(index, (known, _))| (*known, index)));
        }
        self.index_by_id.get(&id).copied()
    }

    /// Adds an access to a buffer.
    #[inline]
    pub(crate) fn add_buffer(&mut self, buffer: &Buffer, next: Use) {
        self.add_id(buffer.id, next);
    }

    /// Adds a write of a part of the resource behind `id`. Such writes of different parts need no barriers between each
    /// other.
    pub(crate) fn add_accumulating(&mut self, id: ResourceId, write: Use) {
        if !self.writers.contains(&(id, write)) {
            self.writers.push((id, write));
        }
    }

    /// Adds an access to subresources of the texture at `index` of the cache.
    #[inline(always)]
    pub(super) fn add_texture(
        &mut self,
        cache: &TextureCache,
        index: usize,
        part: Subresources,
        next: Use,
    ) -> Result<()> {
        let image = &cache.object(index).image;
        if let Some(place) = &image.transient_place {
            self.transients.check(place, &cache.object(index).name)?;
        }
        self.textures
            .add(image.id, part, next, index)
            .map_err(|other| access_conflict(cache.object(index), cache.object(other)))
    }

    /// Returns the textures, their subresources and their uses.
    pub(super) fn textures<'a>(
        &'a self,
        cache: &'a TextureCache,
    ) -> impl Iterator<Item = (&'a Texture, Subresources, Use)> {
        self.textures.iter().map(|used| (&**cache.object(used.owner), used.part, used.next))
    }

    /// True if the command needs a barrier after earlier commands of the same command buffer.
    pub(crate) fn needs_barriers(&self, tracker: &Tracker) -> bool {
        let buffer = |(id, next): &(ResourceId, Use)| tracker.needs_barrier_buffer(*id, *next);
        let texture =
            |used: &SubresourceAccess<_>| tracker.needs_barrier_texture(used.id, used.part, used.next);
        self.buffers.iter().any(buffer) || self.textures.iter().any(texture)
    }

    /// Passes the accesses to the tracker, which adds the barriers to `out`.
    #[inline(always)]
    pub(super) fn track(
        &mut self,
        cache: &TextureCache,
        tracker: &mut Tracker,
        images: &mut Images,
        out: &mut Barriers,
    ) {
        if !(self.buffers.is_empty() && self.writers.is_empty()) {
            self.track_buffers(tracker, out);
        }
        if !self.textures.is_empty() {
            self.track_textures(cache, tracker, images, out);
        }
    }

    fn track_buffers(&mut self, tracker: &mut Tracker, out: &mut Barriers) {
        for (id, next) in &self.buffers {
            tracker.use_buffer(*id, *next, out);
        }
        for (id, write) in &self.writers {
            tracker.accumulate_buffer(*id, *write, out);
        }
        self.clear_buffers();
    }

    #[inline(always)]
    fn track_textures(
        &mut self,
        cache: &TextureCache,
        tracker: &mut Tracker,
        images: &mut Images,
        out: &mut Barriers,
    ) {
        if self.known_images < cache.len() {
            self.sync_image_cache(cache, images);
        }
        for SubresourceAccess { id, part, next, owner } in self.textures.iter() {
            tracker.use_texture(*id, cache.object(*owner).image.shape, *part, *next, out);
        }
        self.textures.clear();
    }

    /// Adds the images of textures that were cached since the last call. Not inlined, as most commands add none.
    #[inline(never)]
    fn sync_image_cache(&mut self, cache: &TextureCache, images: &mut Images) {
        for texture in cache.objects_from(self.known_images) {
            images.insert(texture.image.id, texture.image.barrier_image());
        }
        self.known_images = cache.len();
    }

    /// Clears the accesses of a command that failed before it was recorded.
    pub(crate) fn clear(&mut self) {
        self.clear_buffers();
        self.textures.clear();
    }

    /// Clears everything for the next command buffer.
    pub(super) fn reset(&mut self) {
        self.clear();
        self.transients.clear();
        self.known_images = 0;
    }

    fn clear_buffers(&mut self) {
        self.buffers.clear();
        self.writers.clear();
        if !self.index_by_id.is_empty() {
            self.index_by_id.clear();
        }
    }
}

fn access_conflict(texture: &Arc<Texture>, other: &Arc<Texture>) -> Error {
    let message = if Arc::ptr_eq(texture, other) {
        "one command uses the texture in two ways that exclude each other; use a second texture or two commands"
            .to_owned()
    } else {
        format!(
            "it has texels in common with '{}', and one command uses them in two ways that exclude each other; \
             use a second texture or two commands",
            other.name
        )
    };
    Error::usage(&texture.name, message)
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
        /// Cases: few buffers, many buffers, and a second run after a command was cancelled.
        #[test]
        fn a_buffer_used_twice_counts_once(
            commands in prop::collection::vec(prop::collection::vec((0..60_u64, 0..3_usize), 0..120), 1..4)
        ) {
            let mut cache = CommandAccesses::default();
            for command in commands {
                let mut expected: Vec<(ResourceId, Use)> = Vec::new();
                for (id, kind) in command {
                    let (id, next) = (ResourceId(id), uses()[kind]);
                    cache.add_id(id, next);
                    match expected.iter_mut().find(|(known, _)| *known == id) {
                        Some((_, present)) => {
                            present.stages |= next.stages;
                            present.access |= next.access;
                        }
                        None => expected.push((id, next)),
                    }
                }
                prop_assert_eq!(&cache.buffers, &expected);
                cache.clear();
            }
        }
    }
}
