//! Barriers of one place in a command buffer, merged so that one Vulkan call records them all.

use super::access::{Access, Stages};
use super::state::Scopes;
use super::subresource::Subresources;
use super::tracker::ResourceId;

/// A global memory barrier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct MemoryBarrier {
    /// Stages that must have finished.
    pub(crate) src_stages: Stages,
    /// Writes to flush.
    pub(crate) src_access: Access,
    /// Stages that must not start before.
    pub(crate) dst_stages: Stages,
    /// Accesses that must see the writes.
    pub(crate) dst_access: Access,
}

/// A layout transition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ImageBarrier {
    /// The texture.
    pub(crate) id: ResourceId,
    /// Which part of it.
    pub(crate) subresources: Subresources,
    /// Both sides; the layouts differ.
    pub(crate) scopes: Scopes,
}

/// All barriers in front of one command.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Barriers {
    /// Everything that needs no layout transition, of all buffers and textures together.
    pub(crate) memory: Option<MemoryBarrier>,
    /// Layout transitions.
    pub(crate) images: Vec<ImageBarrier>,
}

impl Barriers {
    /// Whether there is nothing to record.
    pub(crate) fn is_empty(&self) -> bool {
        self.memory.is_none() && self.images.is_empty()
    }

    /// Empties the batch but keeps its memory.
    pub(crate) fn clear(&mut self) {
        self.memory = None;
        self.images.clear();
    }

    /// Adds a barrier without a layout transition.
    pub(crate) fn push_memory(&mut self, scopes: &Scopes) {
        let memory = self.memory.get_or_insert_default();
        memory.src_stages |= scopes.src_stages;
        memory.src_access |= scopes.src_access;
        memory.dst_stages |= scopes.dst_stages;
        memory.dst_access |= scopes.dst_access;
    }

    /// Adds a barrier of a part of a texture.
    pub(crate) fn push_image(&mut self, id: ResourceId, subresources: Subresources, scopes: Scopes) {
        if scopes.old_layout == scopes.new_layout {
            self.push_memory(&scopes);
        } else {
            self.images.push(ImageBarrier { id, subresources, scopes });
        }
    }
}
