//! The Vulkan objects behind a context and its handles, for engines that make Vulkan calls of their own.

use ash::vk;

use super::Context;
use crate::accel::accel_struct::AccelKind;
use crate::error::{Error, Result};
use crate::handle::{
    AccelStructHandle, BufferHandle, ComputePipelineHandle, RayTracingPipelineHandle, RenderPipelineHandle,
    SamplerHandle, TextureHandle,
};
use crate::pipeline::ray_tracing::PipelineCode;
use crate::queue::Queue;
use crate::resource::texture_desc::TextureUsage;

impl Context {
    /// Returns the Vulkan instance.
    pub fn raw_instance(&self) -> &ash::Instance {
        &self.device_state().gpu.instance.raw
    }

    /// Returns the entry points of the Vulkan loader.
    pub fn raw_entry(&self) -> &ash::Entry {
        &self.device_state().gpu.instance.entry
    }

    /// Returns the Vulkan device. The caller must not destroy objects of the library, or use a queue while the library
    /// submits to it.
    pub fn raw_device(&self) -> &ash::Device {
        &self.device_state().gpu.device
    }

    /// Returns the physical device.
    pub fn raw_physical_device(&self) -> vk::PhysicalDevice {
        self.device_state().gpu.physical()
    }

    /// Returns the family of the graphics queue.
    pub fn raw_queue_family(&self) -> u32 {
        self.raw_queue_family_of(Queue::Graphics)
    }

    /// Returns the family of the device queue behind a queue of the library.
    pub fn raw_queue_family_of(&self, queue: Queue) -> u32 {
        self.device_state().gpu.queues.family(queue.index())
    }

    /// Calls `call` with the graphics queue locked, so that it may submit. `call` must neither use the context nor drop
    /// holders or command buffers: these wait for the lock of the queue, so that the thread waits for itself.
    ///
    /// # Panics
    /// In debug builds, in place of that wait.
    pub fn with_raw_queue<T>(&self, call: impl FnOnce(vk::Queue) -> T) -> T {
        self.with_raw_queue_of(Queue::Graphics, call)
    }

    /// Calls `call` with the device queue behind a queue of the library locked, like
    /// [`with_raw_queue`](Self::with_raw_queue). Several queues of the library may share that device queue.
    pub fn with_raw_queue_of<T>(&self, queue: Queue, call: impl FnOnce(vk::Queue) -> T) -> T {
        call(*self.device_state().gpu.queues.raw(queue.index()))
    }

    /// Returns the layout that all pipelines share: the bindless set and the push constants of every stage.
    pub fn raw_pipeline_layout(&self) -> vk::PipelineLayout {
        self.device_state().layout.raw
    }

    /// Returns the bindless descriptor set.
    pub fn raw_descriptor_set(&self) -> vk::DescriptorSet {
        self.device_state().bindless.set
    }

    /// Returns the buffer behind a handle.
    pub fn raw_buffer(&self, buffer: BufferHandle) -> Result<vk::Buffer> {
        Ok(self.device_state().store.buffers.get(buffer)?.raw)
    }

    /// Returns the image behind a handle. For a view this is the image of the viewed texture.
    pub fn raw_image(&self, texture: TextureHandle) -> Result<vk::Image> {
        Ok(self.device_state().store.textures.get(texture)?.image.raw)
    }

    /// Returns the view that shaders sample. The texture needs the usage [`TextureUsage::SAMPLED`].
    pub fn raw_image_view(&self, texture: TextureHandle) -> Result<vk::ImageView> {
        let texture = self.device_state().store.textures.get(texture)?;
        texture.check_usage(TextureUsage::SAMPLED)?;
        texture.sampled_view()
    }

    /// Returns the view that render passes draw to: one layer, or one slice of a volume, of a mip.
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) if the texture lacks the usage [`TARGET`](TextureUsage::TARGET) or
    /// has no such mip or layer.
    pub fn raw_target_view(&self, texture: TextureHandle, mip: u32, layer: u32) -> Result<vk::ImageView> {
        let texture = self.device_state().store.textures.get(texture)?;
        texture.check_usage(TextureUsage::TARGET)?;
        texture.check_target(mip, layer, 1)?;
        texture.target_view(mip, layer)
    }

    /// Returns the sampler behind a handle.
    pub fn raw_sampler(&self, sampler: SamplerHandle) -> Result<vk::Sampler> {
        Ok(self.device_state().store.samplers.get(sampler)?.raw)
    }

    /// Returns the graphics pipeline behind a handle.
    pub fn raw_render_pipeline(&self, pipeline: RenderPipelineHandle) -> Result<vk::Pipeline> {
        Ok(self.device_state().store.render_pipelines.get(pipeline)?.raw)
    }

    /// Returns the compute pipeline behind a handle.
    pub fn raw_compute_pipeline(&self, pipeline: ComputePipelineHandle) -> Result<vk::Pipeline> {
        Ok(self.device_state().store.compute_pipelines.get(pipeline)?.raw)
    }

    /// Returns the ray tracing pipeline behind a handle.
    ///
    /// # Errors
    /// [`Unsupported`](Error::Unsupported) for a pipeline that is lowered to compute shaders.
    pub fn raw_ray_tracing_pipeline(&self, pipeline: RayTracingPipelineHandle) -> Result<vk::Pipeline> {
        let pipeline = self.device_state().store.ray_tracing_pipelines.get(pipeline)?;
        match &pipeline.code {
            PipelineCode::Hardware(hardware) => Ok(hardware.raw),
            PipelineCode::Lowered(_) => {
                let what = format!("the Vulkan pipeline of '{}'", pipeline.name);
                let why = "it is lowered to compute shaders; request RayTracingPipelineRequest::Hardware";
                Err(Error::unsupported(what, why))
            }
        }
    }

    /// Returns the Vulkan acceleration structures behind a handle: one, or the parts of a split mesh. Compaction
    /// replaces them, and destroys the old ones once the GPU is done with them.
    pub fn raw_accel_structs(
        &self,
        structure: AccelStructHandle,
    ) -> Result<Vec<vk::AccelerationStructureKHR>> {
        Ok(self.raw_structures(structure)?.into_iter().map(|(raw, _)| raw).collect())
    }

    /// Returns the device addresses of the Vulkan acceleration structures behind a handle, as instances hold them.
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
