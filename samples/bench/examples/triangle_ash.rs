//! Draws a triangle with plain `ash` and writes `triangle.ppm`.
use ash::{Device, Entry, Instance, vk};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

const SIDE: u32 = 256;
const BYTES: u64 = (SIDE * SIDE * 4) as u64;
const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
const EXTENT: vk::Extent3D = vk::Extent3D { width: SIDE, height: SIDE, depth: 1 };
const COLOR: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

fn create_device(instance: &Instance) -> Result<(vk::PhysicalDevice, u32, Device)> {
    // SAFETY: the instance is alive, and the descriptions are valid.
    unsafe {
        let physical = *instance.enumerate_physical_devices()?.first().ok_or("no device")?;
        let families = instance.get_physical_device_queue_family_properties(physical);
        let family = families.iter().position(|family| family.queue_flags.contains(vk::QueueFlags::GRAPHICS));
        let family = family.ok_or("no queue draws")? as u32;
        let queues =
            [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
        let mut features =
            vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true).synchronization2(true);
        let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut features);
        Ok((physical, family, instance.create_device(physical, &info, None)?))
    }
}

fn allocate(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    device: &Device,
    needed: vk::MemoryRequirements,
    wanted: vk::MemoryPropertyFlags,
) -> Result<vk::DeviceMemory> {
    // SAFETY: the physical device is one of the instance.
    let types = unsafe { instance.get_physical_device_memory_properties(physical) };
    let fits = |(number, ty): (usize, &vk::MemoryType)| {
        needed.memory_type_bits & (1 << number) != 0 && ty.property_flags.contains(wanted)
    };
    let mut numbered = types.memory_types_as_slice().iter().enumerate();
    let number = numbered.position(fits).ok_or("no memory type fits")? as u32;
    let info = vk::MemoryAllocateInfo::default().allocation_size(needed.size).memory_type_index(number);
    // SAFETY: the memory type exists.
    Ok(unsafe { device.allocate_memory(&info, None) }?)
}

fn create_module(device: &Device, bytes: &[u8]) -> Result<vk::ShaderModule> {
    let words = ash::util::read_spv(&mut std::io::Cursor::new(bytes))?;
    // SAFETY: the words come from a compiler.
    Ok(unsafe { device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&words), None) }?)
}

fn create_pipeline(device: &Device) -> Result<(vk::PipelineLayout, vk::Pipeline)> {
    let vertex = create_module(device, include_bytes!("triangle.vert.spv"))?;
    let fragment = create_module(device, include_bytes!("triangle.frag.spv"))?;
    let stage = |stage, module| {
        vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main")
    };
    let stages =
        [stage(vk::ShaderStageFlags::VERTEX, vertex), stage(vk::ShaderStageFlags::FRAGMENT, fragment)];
    let vertices = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly =
        vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewports =
        [vk::Viewport { width: SIDE as f32, height: SIDE as f32, max_depth: 1.0, ..Default::default() }];
    let scissors = [area()];
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewports(&viewports).scissors(&scissors);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let samples =
        vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let attachments =
        [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
    let mut formats = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&[FORMAT]);
    // SAFETY: the descriptions are valid, and the modules are used no longer than here.
    unsafe {
        let layout = device.create_pipeline_layout(&vk::PipelineLayoutCreateInfo::default(), None)?;
        let info = [vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertices)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .color_blend_state(&blend)
            .layout(layout)
            .push_next(&mut formats)];
        let made = device.create_graphics_pipelines(vk::PipelineCache::null(), &info, None);
        let pipeline = made.map_err(|(_, result)| result)?[0];
        device.destroy_shader_module(vertex, None);
        device.destroy_shader_module(fragment, None);
        Ok((layout, pipeline))
    }
}

fn area() -> vk::Rect2D {
    vk::Rect2D { extent: vk::Extent2D { width: SIDE, height: SIDE }, ..Default::default() }
}

fn image_barrier(
    device: &Device,
    list: vk::CommandBuffer,
    image: vk::Image,
    from: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout),
    to: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout),
) {
    let barriers = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(from.0)
        .src_access_mask(from.1)
        .old_layout(from.2)
        .dst_stage_mask(to.0)
        .dst_access_mask(to.1)
        .new_layout(to.2)
        .image(image)
        .subresource_range(COLOR)];
    let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
    // SAFETY: the command buffer is being recorded.
    unsafe { device.cmd_pipeline_barrier2(list, &info) };
}

fn record(
    device: &Device,
    list: vk::CommandBuffer,
    pipeline: vk::Pipeline,
    image: vk::Image,
    view: vk::ImageView,
    readback: vk::Buffer,
) {
    let none = (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE, vk::ImageLayout::UNDEFINED);
    let target = (
        vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
        vk::AccessFlags2::COLOR_ATTACHMENT_WRITE,
        vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
    );
    let source = (
        vk::PipelineStageFlags2::COPY,
        vk::AccessFlags2::TRANSFER_READ,
        vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
    );
    let black = vk::ClearValue { color: vk::ClearColorValue { float32: [0.0, 0.0, 0.0, 1.0] } };
    let color = [vk::RenderingAttachmentInfo::default()
        .image_view(view)
        .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(black)];
    let pass = vk::RenderingInfo::default().render_area(area()).layer_count(1).color_attachments(&color);
    let layers = vk::ImageSubresourceLayers {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        layer_count: 1,
        ..Default::default()
    };
    let region = [vk::BufferImageCopy::default().image_subresource(layers).image_extent(EXTENT)];
    image_barrier(device, list, image, none, target);
    // SAFETY: everything named is alive, and the image has the layouts.
    unsafe {
        device.cmd_begin_rendering(list, &pass);
        device.cmd_bind_pipeline(list, vk::PipelineBindPoint::GRAPHICS, pipeline);
        device.cmd_draw(list, 3, 1, 0, 0);
        device.cmd_end_rendering(list);
        image_barrier(device, list, image, target, source);
        device.cmd_copy_image_to_buffer(list, image, source.2, readback, &region);
    }
    let barriers = [vk::MemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::COPY)
        .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::HOST)
        .dst_access_mask(vk::AccessFlags2::HOST_READ)];
    // SAFETY: the command buffer is being recorded.
    unsafe {
        device.cmd_pipeline_barrier2(list, &vk::DependencyInfo::default().memory_barriers(&barriers));
    }
}

/// Returns the pixels, four bytes each.
pub(crate) fn draw() -> Result<Vec<u8>> {
    // SAFETY: objects live until the end of the function, in the order of their use; the fence says when the GPU is done.
    unsafe {
        let entry = Entry::load()?;
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        let instance = entry.create_instance(&info, None)?;
        let (physical, family, device) = create_device(&instance)?;
        let queue = device.get_device_queue(family, 0);

        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(FORMAT)
            .extent(EXTENT)
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC);
        let image = device.create_image(&info, None)?;
        let needed = device.get_image_memory_requirements(image);
        let local = vk::MemoryPropertyFlags::DEVICE_LOCAL;
        let image_memory = allocate(&instance, physical, &device, needed, local)?;
        device.bind_image_memory(image, image_memory, 0)?;
        let info = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(FORMAT)
            .subresource_range(COLOR);
        let view = device.create_image_view(&info, None)?;

        let info = vk::BufferCreateInfo::default().size(BYTES).usage(vk::BufferUsageFlags::TRANSFER_DST);
        let readback = device.create_buffer(&info, None)?;
        let needed = device.get_buffer_memory_requirements(readback);
        let visible = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let buffer_memory = allocate(&instance, physical, &device, needed, visible)?;
        device.bind_buffer_memory(readback, buffer_memory, 0)?;

        let (layout, pipeline) = create_pipeline(&device)?;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(family);
        let pool = device.create_command_pool(&info, None)?;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        let lists = device.allocate_command_buffers(&info)?;
        let once = vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT;
        device.begin_command_buffer(lists[0], &vk::CommandBufferBeginInfo::default().flags(once))?;
        record(&device, lists[0], pipeline, image, view, readback);
        device.end_command_buffer(lists[0])?;
        let fence = device.create_fence(&vk::FenceCreateInfo::default(), None)?;
        device.queue_submit(queue, &[vk::SubmitInfo::default().command_buffers(&lists)], fence)?;
        device.wait_for_fences(&[fence], true, u64::MAX)?;

        let mapped = device.map_memory(buffer_memory, 0, BYTES, vk::MemoryMapFlags::empty())?;
        let pixels = std::slice::from_raw_parts(mapped.cast::<u8>(), BYTES as usize).to_vec();
        device.destroy_fence(fence, None);
        device.destroy_command_pool(pool, None);
        device.destroy_pipeline(pipeline, None);
        device.destroy_pipeline_layout(layout, None);
        device.destroy_buffer(readback, None);
        device.free_memory(buffer_memory, None);
        device.destroy_image_view(view, None);
        device.destroy_image(image, None);
        device.free_memory(image_memory, None);
        device.destroy_device(None);
        instance.destroy_instance(None);
        Ok(pixels)
    }
}

pub(crate) fn main() -> Result<()> {
    let rgb: Vec<_> = draw()?.chunks(4).flat_map(|texel| &texel[..3]).copied().collect();
    let header = format!("P6 {SIDE} {SIDE} 255\n");
    Ok(std::fs::write("triangle.ppm", [header.as_bytes(), &rgb].concat())?)
}
