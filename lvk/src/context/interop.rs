//! The Vulkan objects behind a context and its handles, for engines that mix in calls of their own.

use ash::vk;

use super::Context;
use crate::accel::accel_struct::AccelKind;
use crate::error::Result;
use crate::handle::{
    AccelStructHandle, BufferHandle, ComputePipelineHandle, RayTracingPipelineHandle, RenderPipelineHandle,
    SamplerHandle, TextureHandle,
};
use crate::queue::Queue;
use crate::resource::texture_desc::TextureUsage;

impl Context {
    /// The instance.
    pub fn raw_instance(&self) -> &ash::Instance {
        &self.device_state().gpu.instance.raw
    }

    /// The loader's entry points.
    pub fn raw_entry(&self) -> &ash::Entry {
        &self.device_state().gpu.instance.entry
    }

    /// The device. Destroying what the library owns, or using its queue while it submits, is the caller's fault.
    pub fn raw_device(&self) -> &ash::Device {
        &self.device_state().gpu.device
    }

    /// The physical device.
    pub fn raw_physical_device(&self) -> vk::PhysicalDevice {
        self.device_state().gpu.physical()
    }

    /// Family of the queue for everything.
    pub fn raw_queue_family(&self) -> u32 {
        self.raw_queue_family_of(Queue::Graphics)
    }

    /// Family of the device's queue behind one of the library's.
    pub fn raw_queue_family_of(&self, queue: Queue) -> u32 {
        self.device_state().gpu.queues.family(queue.index())
    }

    /// Runs `call` with the queue for everything locked, so that it may submit. It must neither use the context nor drop
    /// holders or command buffers: these wait for the queue.
    pub fn with_raw_queue<T>(&self, call: impl FnOnce(vk::Queue) -> T) -> T {
        self.with_raw_queue_of(Queue::Graphics, call)
    }

    /// As [`with_raw_queue`](Self::with_raw_queue), with the device's queue behind one of the library's, which others may share.
    pub fn with_raw_queue_of<T>(&self, queue: Queue, call: impl FnOnce(vk::Queue) -> T) -> T {
        call(*self.device_state().gpu.queues.raw(queue.index()))
    }

    /// The layout all pipelines share: the bindless set and the push constants of every stage.
    pub fn raw_pipeline_layout(&self) -> vk::PipelineLayout {
        self.device_state().layout.raw
    }

    /// The bindless set.
    pub fn raw_descriptor_set(&self) -> vk::DescriptorSet {
        self.device_state().bindless.set
    }

    /// The buffer behind a handle.
    pub fn raw_buffer(&self, buffer: BufferHandle) -> Result<vk::Buffer> {
        Ok(self.device_state().store.buffers.get(buffer)?.raw)
    }

    /// The image behind a handle; that of the texture which a view shows.
    pub fn raw_image(&self, texture: TextureHandle) -> Result<vk::Image> {
        Ok(self.device_state().store.textures.get(texture)?.image.raw)
    }

    /// The view shaders sample.
    pub fn raw_image_view(&self, texture: TextureHandle) -> Result<vk::ImageView> {
        self.device_state().store.textures.get(texture)?.sampled_view()
    }

    /// The view that render passes draw to: a layer, or a slice of a volume, of a mip.
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) if the texture is no [`TARGET`](TextureUsage::TARGET) or has no such
    /// mip or layer.
    pub fn raw_target_view(&self, texture: TextureHandle, mip: u32, layer: u32) -> Result<vk::ImageView> {
        let texture = self.device_state().store.textures.get(texture)?;
        texture.check_usage(TextureUsage::TARGET)?;
        texture.check_target(mip, layer, 1)?;
        texture.target_view(mip, layer)
    }

    /// The sampler behind a handle.
    pub fn raw_sampler(&self, sampler: SamplerHandle) -> Result<vk::Sampler> {
        Ok(self.device_state().store.samplers.get(sampler)?.raw)
    }

    /// The graphics pipeline behind a handle.
    pub fn raw_render_pipeline(&self, pipeline: RenderPipelineHandle) -> Result<vk::Pipeline> {
        Ok(self.device_state().store.render_pipelines.get(pipeline)?.raw)
    }

    /// The compute pipeline behind a handle.
    pub fn raw_compute_pipeline(&self, pipeline: ComputePipelineHandle) -> Result<vk::Pipeline> {
        Ok(self.device_state().store.compute_pipelines.get(pipeline)?.raw)
    }

    /// The ray tracing pipeline behind a handle.
    pub fn raw_ray_tracing_pipeline(&self, pipeline: RayTracingPipelineHandle) -> Result<vk::Pipeline> {
        Ok(self.device_state().store.ray_tracing_pipelines.get(pipeline)?.raw)
    }

    /// The acceleration structures behind a handle: one, or the parts of a split mesh. Compaction puts others in
    /// their place, and destroys these once the GPU is done with them.
    pub fn raw_accel_structs(
        &self,
        structure: AccelStructHandle,
    ) -> Result<Vec<vk::AccelerationStructureKHR>> {
        Ok(self.raw_structures(structure)?.into_iter().map(|(raw, _)| raw).collect())
    }

    /// The device addresses of the same, as instances hold them.
    pub fn accel_struct_addresses(&self, structure: AccelStructHandle) -> Result<Vec<u64>> {
        Ok(self.raw_structures(structure)?.into_iter().map(|(_, address)| address).collect())
    }

    fn raw_structures(
        &self,
        structure: AccelStructHandle,
    ) -> Result<Vec<(vk::AccelerationStructureKHR, u64)>> {
        let object = self.device_state().store.accel_structs.get(structure)?;
        Ok(match &object.kind {
            AccelKind::Tlas(tlas) => {
                tlas.structure.iter().map(|structure| (structure.raw, structure.address)).collect()
            }
            AccelKind::Blas(blas) => {
                blas.structures().structures.iter().map(|part| (part.raw, part.address)).collect()
            }
        })
    }
}
