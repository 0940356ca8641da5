//! Descriptor sets of input attachments, for passes of one command buffer that read their own targets.

use ash::vk;

use crate::error::{Error, Result};
use crate::gpu::Gpu;

/// Descriptor sets that live as long as the command buffer. They are written again when it is recorded again.
#[derive(Debug, Default)]
pub(crate) struct InputSets {
    pools: Vec<vk::DescriptorPool>,
    sets: Vec<vk::DescriptorSet>,
    /// Number of sets that the command buffer has taken.
    taken: usize,
}

impl InputSets {
    /// Number of sets that are allocated at once.
    const BATCH: usize = 8;

    /// Returns an unused set of `count` input attachments.
    pub(crate) fn acquire(
        &mut self,
        gpu: &Gpu,
        layout: vk::DescriptorSetLayout,
        count: u32,
    ) -> Result<vk::DescriptorSet> {
        if self.taken == self.sets.len() {
            self.grow(gpu, layout, count)?;
        }
        self.taken += 1;
        Ok(self.sets[self.taken - 1])
    }

    /// Makes all sets available again. The GPU is done with them.
    pub(crate) fn reset(&mut self) {
        self.taken = 0;
    }

    fn grow(&mut self, gpu: &Gpu, layout: vk::DescriptorSetLayout, count: u32) -> Result<()> {
        let sizes = [vk::DescriptorPoolSize::default()
            .ty(vk::DescriptorType::INPUT_ATTACHMENT)
            .descriptor_count(count * Self::BATCH as u32)];
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(Self::BATCH as u32).pool_sizes(&sizes);
        // SAFETY: the description is valid.
        let pool = unsafe { gpu.device.create_descriptor_pool(&info, None) }
            .map_err(Error::vulkan("vkCreateDescriptorPool", "input attachments"))?;
        self.pools.push(pool);
        gpu.name(pool, "input attachments of a command buffer");
        let layouts = [layout; Self::BATCH];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        // SAFETY: the pool is new and has capacity for these sets.
        let sets = unsafe { gpu.device.allocate_descriptor_sets(&info) }
            .map_err(Error::vulkan("vkAllocateDescriptorSets", "input attachments"))?;
        self.sets.extend(sets);
        Ok(())
    }

    /// Destroys all pools. The GPU is done with their sets.
    pub(crate) fn destroy(self, gpu: &Gpu) {
        for pool in self.pools {
            // SAFETY: no running command buffer uses the sets of the pool.
            unsafe { gpu.device.destroy_descriptor_pool(pool, None) };
        }
    }
}
