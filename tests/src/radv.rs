//! Pipelines compiled by RADV, the driver of AMD GPUs, without such a GPU in the machine. They are created by plain
//! Vulkan, as a device without memory supports no context.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::collections::BTreeMap;

use lvk::ash::{self, vk};
use lvk::{Capabilities, Context, Format, compile_glsl};
use lvk_samples::pipelines::{SamplePipeline, SampleStage};

use crate::device::vulkan;

/// Bindings of the library's one descriptor set: number, type, count.
const BINDINGS: [(u32, vk::DescriptorType, u32); 6] = [
    (0, vk::DescriptorType::SAMPLED_IMAGE, 16_384),
    (1, vk::DescriptorType::SAMPLER, 1_024),
    (2, vk::DescriptorType::STORAGE_IMAGE, 16_384),
    (3, vk::DescriptorType::COMBINED_IMAGE_SAMPLER, 28),
    (4, vk::DescriptorType::ACCELERATION_STRUCTURE_KHR, 256),
    (5, vk::DescriptorType::STORAGE_BUFFER, 1),
];
/// Bindings of the set of input attachments behind it.
const INPUTS: u32 = 10;
/// Bytes of push constants that the library's one pipeline layout has for all stages.
const PUSH_BYTES: u32 = 256;

const EXTENSIONS: [&std::ffi::CStr; 7] = [
    ash::ext::mesh_shader::NAME,
    ash::khr::acceleration_structure::NAME,
    ash::khr::deferred_host_operations::NAME,
    ash::khr::ray_tracing_pipeline::NAME,
    ash::khr::ray_query::NAME,
    ash::khr::ray_tracing_position_fetch::NAME,
    ash::khr::pipeline_executable_properties::NAME,
];

/// Compiles for the chip that `RADV_FORCE_FAMILY` names.
pub struct Radv {
    /// Capabilities of the chip.
    pub capabilities: Capabilities,
    layout: vk::PipelineLayout,
    set_layouts: [vk::DescriptorSetLayout; 2],
    device: ash::Device,
    instance: ash::Instance,
    _entry: ash::Entry,
}

/// Instruction count of each program of a pipeline, by the driver's name for it.
pub type Programs = BTreeMap<String, u64>;

impl Radv {
    /// Opens the null device of the driver. Its libraries must be open.
    ///
    /// # Panics
    /// When the driver offers no such device.
    pub fn open() -> Self {
        let library = vulkan().flatten();
        let capabilities = Context::devices(library).unwrap().remove(0);
        // SAFETY: the loader is a well-known library; everything below is destroyed in reverse order by drop.
        unsafe {
            let entry = match library {
                Some(path) => ash::Entry::load_from(path).unwrap(),
                None => ash::Entry::load().unwrap(),
            };
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let info = vk::InstanceCreateInfo::default().application_info(&application);
            let instance = entry.create_instance(&info, None).unwrap();
            let physical = instance.enumerate_physical_devices().unwrap()[0];
            let device = open_device(&instance, physical);
            let set_layouts = [set_layout(&device), input_layout(&device)];
            let layout = pipeline_layout(&device, &set_layouts);
            Self { capabilities, layout, set_layouts, device, instance, _entry: entry }
        }
    }

    /// Compiles a pipeline and returns its programs.
    ///
    /// # Panics
    /// When the compiler of the library or that of the driver refuses.
    pub fn compile(&self, pipeline: &SamplePipeline) -> Programs {
        let modules: Vec<_> = pipeline.stages.iter().map(|stage| self.module(stage)).collect();
        let stages: Vec<_> = pipeline
            .stages
            .iter()
            .zip(&modules)
            .map(|(stage, module)| {
                vk::PipelineShaderStageCreateInfo::default()
                    .stage(stage.stage.raw())
                    .module(*module)
                    .name(c"main")
            })
            .collect();
        let made = match stages[0].stage {
            vk::ShaderStageFlags::COMPUTE => self.compute(stages[0]),
            vk::ShaderStageFlags::RAYGEN_KHR => self.ray_tracing(&stages),
            _ => self.graphics(pipeline, &stages),
        };
        let raw = made.unwrap_or_else(|result| panic!("{}: {result}", pipeline.name));
        let programs = self.programs(raw);
        // SAFETY: nothing uses pipeline and modules.
        unsafe {
            self.device.destroy_pipeline(raw, None);
            modules.iter().for_each(|module| self.device.destroy_shader_module(*module, None));
        }
        programs
    }

    fn module(&self, stage: &SampleStage) -> vk::ShaderModule {
        let words = compile_glsl(&stage.module(), &self.capabilities).unwrap();
        // SAFETY: the words are a whole module.
        unsafe { self.device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&words), None) }
            .unwrap()
    }

    fn compute(&self, stage: vk::PipelineShaderStageCreateInfo<'_>) -> Result<vk::Pipeline, vk::Result> {
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(self.layout).flags(FLAGS);
        // SAFETY: stage and layout are alive.
        let made = unsafe {
            self.device.create_compute_pipelines(vk::PipelineCache::null(), std::slice::from_ref(&info), None)
        };
        made.map(|made| made[0]).map_err(|(_, result)| result)
    }

    fn ray_tracing(
        &self,
        stages: &[vk::PipelineShaderStageCreateInfo<'_>],
    ) -> Result<vk::Pipeline, vk::Result> {
        let groups = groups(stages);
        let info = vk::RayTracingPipelineCreateInfoKHR::default()
            .flags(FLAGS)
            .stages(stages)
            .groups(&groups)
            .max_pipeline_ray_recursion_depth(1)
            .layout(self.layout);
        let extension = ash::khr::ray_tracing_pipeline::Device::new(&self.instance, &self.device);
        // SAFETY: stages and layout are alive.
        let made = unsafe {
            extension.create_ray_tracing_pipelines(
                vk::DeferredOperationKHR::null(),
                vk::PipelineCache::null(),
                std::slice::from_ref(&info),
                None,
            )
        };
        made.map(|made| made[0]).map_err(|(_, result)| result)
    }

    fn graphics(
        &self,
        pipeline: &SamplePipeline,
        stages: &[vk::PipelineShaderStageCreateInfo<'_>],
    ) -> Result<vk::Pipeline, vk::Result> {
        let formats: Vec<_> = pipeline.color.iter().map(|format| raw(*format)).collect();
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&formats)
            .depth_attachment_format(pipeline.depth.map_or(vk::Format::UNDEFINED, raw));
        let blend =
            vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
        let blends = vec![blend; formats.len()];
        let blends = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let states = [vk::DynamicState::VIEWPORT_WITH_COUNT, vk::DynamicState::SCISSOR_WITH_COUNT];
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(pipeline.depth.is_some())
            .depth_write_enable(pipeline.depth.is_some())
            .depth_compare_op(vk::CompareOp::GREATER);
        let states = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&states);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let (vertices, viewport) = (Default::default(), Default::default());
        let info = vk::GraphicsPipelineCreateInfo::default()
            .flags(FLAGS)
            .stages(stages)
            .vertex_input_state(&vertices)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .dynamic_state(&states)
            .depth_stencil_state(&depth)
            .color_blend_state(&blends)
            .push_next(&mut rendering)
            .layout(self.layout);
        // SAFETY: stages and layout are alive.
        let made = unsafe {
            self.device.create_graphics_pipelines(
                vk::PipelineCache::null(),
                std::slice::from_ref(&info),
                None,
            )
        };
        made.map(|made| made[0]).map_err(|(_, result)| result)
    }

    fn programs(&self, pipeline: vk::Pipeline) -> Programs {
        let extension = ash::khr::pipeline_executable_properties::Device::new(&self.instance, &self.device);
        let info = vk::PipelineInfoKHR::default().pipeline(pipeline);
        // SAFETY: the pipeline is alive and was made to answer.
        let found = unsafe { extension.get_pipeline_executable_properties(&info) }.unwrap();
        let instructions = |index: usize| {
            let info =
                vk::PipelineExecutableInfoKHR::default().pipeline(pipeline).executable_index(index as u32);
            // SAFETY: as above, and the index is one of those found.
            let statistics = unsafe { extension.get_pipeline_executable_statistics(&info) }.unwrap();
            let of_name =
                statistics.iter().find(|known| known.name_as_c_str() == Ok(c"Instructions")).unwrap();
            assert_eq!(of_name.format, vk::PipelineExecutableStatisticFormatKHR::UINT64);
            // SAFETY: the format says which member counts.
            unsafe { of_name.value.u64 }
        };
        let name = |index: usize| {
            format!("{index} {}", found[index].name_as_c_str().unwrap_or_default().to_string_lossy())
        };
        (0..found.len()).map(|index| (name(index), instructions(index))).collect()
    }
}

impl Drop for Radv {
    fn drop(&mut self) {
        // SAFETY: everything else made from the device is gone.
        unsafe {
            self.device.destroy_pipeline_layout(self.layout, None);
            for layout in self.set_layouts {
                self.device.destroy_descriptor_set_layout(layout, None);
            }
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

const FLAGS: vk::PipelineCreateFlags = vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR;

/// Returns a group for each stage. An any-hit stage belongs to the hit group before it.
fn groups(
    stages: &[vk::PipelineShaderStageCreateInfo<'_>],
) -> Vec<vk::RayTracingShaderGroupCreateInfoKHR<'static>> {
    use vk::{RayTracingShaderGroupTypeKHR as Group, ShaderStageFlags as Stage};
    let mut groups: Vec<vk::RayTracingShaderGroupCreateInfoKHR<'_>> = Vec::new();
    for (index, stage) in (0_u32..).zip(stages) {
        let unused = vk::RayTracingShaderGroupCreateInfoKHR::default()
            .general_shader(vk::SHADER_UNUSED_KHR)
            .closest_hit_shader(vk::SHADER_UNUSED_KHR)
            .any_hit_shader(vk::SHADER_UNUSED_KHR)
            .intersection_shader(vk::SHADER_UNUSED_KHR);
        let group = match stage.stage {
            Stage::CLOSEST_HIT_KHR => unused.ty(Group::TRIANGLES_HIT_GROUP).closest_hit_shader(index),
            Stage::INTERSECTION_KHR => unused.ty(Group::PROCEDURAL_HIT_GROUP).intersection_shader(index),
            Stage::ANY_HIT_KHR => match groups.pop_if(|before| before.ty != Group::GENERAL) {
                Some(before) => before.any_hit_shader(index),
                None => unused.ty(Group::TRIANGLES_HIT_GROUP).any_hit_shader(index),
            },
            _ => unused.ty(Group::GENERAL).general_shader(index),
        };
        groups.push(group);
    }
    groups
}

fn raw(format: Format) -> vk::Format {
    match format {
        Format::Rgba8Unorm => vk::Format::R8G8B8A8_UNORM,
        Format::Rgba8Srgb => vk::Format::R8G8B8A8_SRGB,
        Format::Rgba16Float => vk::Format::R16G16B16A16_SFLOAT,
        Format::Rgba32Float => vk::Format::R32G32B32A32_SFLOAT,
        Format::Rgba32Uint => vk::Format::R32G32B32A32_UINT,
        Format::D32Float => vk::Format::D32_SFLOAT,
        Format::R32Uint => vk::Format::R32_UINT,
        other => panic!("{other:?}: add its Vulkan format here"),
    }
}

/// Creates a device with every feature that the shaders may need and the chip has.
fn open_device(instance: &ash::Instance, physical: vk::PhysicalDevice) -> ash::Device {
    let mut v11 = vk::PhysicalDeviceVulkan11Features::default();
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
    let mut accel = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default();
    let mut pipeline = vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default();
    let mut query = vk::PhysicalDeviceRayQueryFeaturesKHR::default();
    let mut positions = vk::PhysicalDeviceRayTracingPositionFetchFeaturesKHR::default();
    let mut executables = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default();
    let mut all = vk::PhysicalDeviceFeatures2::default()
        .push_next(&mut v11)
        .push_next(&mut v12)
        .push_next(&mut v13)
        .push_next(&mut accel)
        .push_next(&mut pipeline)
        .push_next(&mut query)
        .push_next(&mut positions)
        .push_next(&mut executables);
    // SAFETY: the driver knows all acceleration structures of the chain, which lives until the end of the function.
    unsafe { instance.get_physical_device_features2(physical, &mut all) };
    let mut mesh = vk::PhysicalDeviceMeshShaderFeaturesEXT::default().task_shader(true).mesh_shader(true);
    let names = EXTENSIONS.map(std::ffi::CStr::as_ptr);
    let queue = vk::DeviceQueueCreateInfo::default().queue_family_index(0).queue_priorities(&[1.0]);
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(std::slice::from_ref(&queue))
        .enabled_extension_names(&names)
        .push_next(&mut mesh)
        .push_next(&mut all);
    // SAFETY: as above.
    unsafe { instance.create_device(physical, &info, None) }.unwrap()
}

fn set_layout(device: &ash::Device) -> vk::DescriptorSetLayout {
    let bindings =
        BINDINGS.map(|(binding, ty, count)| layout_binding(binding, ty, count, vk::ShaderStageFlags::ALL));
    use vk::DescriptorBindingFlags as Flags;
    let mut flags = [Flags::PARTIALLY_BOUND | Flags::UPDATE_AFTER_BIND; BINDINGS.len()];
    flags[5] = Flags::PARTIALLY_BOUND;
    let mut flags = vk::DescriptorSetLayoutBindingFlagsCreateInfo::default().binding_flags(&flags);
    let info = vk::DescriptorSetLayoutCreateInfo::default()
        .flags(vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL)
        .bindings(&bindings)
        .push_next(&mut flags);
    // SAFETY: the chip's limits are far above these counts.
    unsafe { device.create_descriptor_set_layout(&info, None) }.unwrap()
}

fn layout_binding(
    binding: u32,
    ty: vk::DescriptorType,
    count: u32,
    stages: vk::ShaderStageFlags,
) -> vk::DescriptorSetLayoutBinding<'static> {
    let layout = vk::DescriptorSetLayoutBinding::default().binding(binding).stage_flags(stages);
    layout.descriptor_type(ty).descriptor_count(count)
}

fn input_layout(device: &ash::Device) -> vk::DescriptorSetLayout {
    let (ty, stages) = (vk::DescriptorType::INPUT_ATTACHMENT, vk::ShaderStageFlags::FRAGMENT);
    let bindings: Vec<_> = (0..INPUTS).map(|binding| layout_binding(binding, ty, 1, stages)).collect();
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    // SAFETY: the chip's limits are far above these counts.
    unsafe { device.create_descriptor_set_layout(&info, None) }.unwrap()
}

fn pipeline_layout(device: &ash::Device, sets: &[vk::DescriptorSetLayout]) -> vk::PipelineLayout {
    let push = vk::PushConstantRange { stage_flags: vk::ShaderStageFlags::ALL, offset: 0, size: PUSH_BYTES };
    let ranges = [push];
    let info = vk::PipelineLayoutCreateInfo::default().set_layouts(sets).push_constant_ranges(&ranges);
    // SAFETY: the set layouts are alive.
    unsafe { device.create_pipeline_layout(&info, None) }.unwrap()
}
