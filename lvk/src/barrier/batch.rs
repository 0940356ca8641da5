//! The barriers in front of one command, merged so that one Vulkan call records them all.

use super::access::{Access, Stages};
use super::resource_id::ResourceId;
use super::resource_state::BarrierScopes;
use super::subresource::Subresources;

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

impl MemoryBarrier {
    /// Returns the same barrier, split so that no part names traversal together with shader stages outside
    /// ray tracing pipelines. Vulkan forbids that combination if ray queries are disabled.
    pub(crate) fn without_ray_queries(self) -> impl Iterator<Item = Self> {
        let traversing = self.dst_stages & (Stages::RAY_TRACING | Stages::ACCEL_BUILD);
        if self.dst_stages == traversing || !self.dst_access.contains(Access::ACCEL_READ) {
            return [Some(self), None].into_iter().flatten();
        }
        let rest = Self { dst_access: self.dst_access - Access::ACCEL_READ, ..self };
        let traversal = Self { dst_stages: traversing, dst_access: Access::ACCEL_READ, ..self };
        [Some(rest), (!traversing.is_empty()).then_some(traversal)].into_iter().flatten()
    }
}

/// A layout transition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ImageBarrier {
    /// The texture.
    pub(crate) id: ResourceId,
    /// The affected part of the texture.
    pub(crate) subresources: Subresources,
    /// Scopes of both sides; the layouts differ.
    pub(crate) scopes: BarrierScopes,
}

/// All barriers in front of one command.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Barriers {
    /// The barrier without layout transitions, for all buffers and textures together.
    pub(crate) memory: Option<MemoryBarrier>,
    /// Layout transitions.
    pub(crate) images: Vec<ImageBarrier>,
}

impl Barriers {
    /// True if there is nothing to record.
    #[inline]
    pub(crate) fn is_empty(&self) -> bool {
        self.memory.is_none() && self.images.is_empty()
    }

    /// Empties the batch but keeps its memory.
    #[inline]
    pub(crate) fn clear(&mut self) {
        self.memory = None;
        self.images.clear();
    }

    /// Adds a barrier without a layout transition.
    #[inline]
    pub(crate) fn push_memory(&mut self, scopes: &BarrierScopes) {
        let memory = self.memory.get_or_insert_default();
        memory.src_stages |= scopes.src_stages;
        memory.src_access |= scopes.src_access;
        memory.dst_stages |= scopes.dst_stages;
        memory.dst_access |= scopes.dst_access;
    }

    /// Adds a barrier for a part of a texture.
    #[inline]
    pub(crate) fn push_image(&mut self, id: ResourceId, subresources: Subresources, scopes: &BarrierScopes) {
        if scopes.old_layout == scopes.new_layout {
            self.push_memory(scopes);
        } else {
            self.images.push(ImageBarrier { id, subresources, scopes: *scopes });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn traversal_is_kept_from_the_shaders_that_cannot_traverse() {
        let merged = MemoryBarrier {
            src_stages: Stages::ACCEL_BUILD,
            src_access: Access::ACCEL_WRITE,
            dst_stages: Stages::COMPUTE | Stages::RAY_TRACING,
            dst_access: Access::SHADER_READ | Access::ACCEL_READ,
        };
        let parts: Vec<_> = merged.without_ray_queries().collect();
        let rest = MemoryBarrier { dst_access: Access::SHADER_READ, ..merged };
        let traversal =
            MemoryBarrier { dst_stages: Stages::RAY_TRACING, dst_access: Access::ACCEL_READ, ..merged };
        assert_eq!(parts, [rest, traversal]);
        for whole in [rest, traversal] {
            assert_eq!(whole.without_ray_queries().collect::<Vec<_>>(), [whole]);
        }
        let compute = MemoryBarrier { dst_stages: Stages::COMPUTE, ..merged };
        assert_eq!(compute.without_ray_queries().count(), 1);
    }
}
