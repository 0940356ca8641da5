//! The library on a device that another engine created: images, buffers and semaphores are exported and imported, and
//! the library destroys nothing that it does not own.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::ffi::{CStr, c_void};
use std::sync::atomic::{AtomicU32, Ordering};

use lvk::ash::vk::Handle;
use lvk::ash::{self, vk};
use lvk::{
    BufferDesc, BufferHandle, BufferUsage, ColorAttachment, CommandBuffer, ComputePipelineHandle, Context,
    ContextDesc, Dependencies, Error, FeatureSet, Format, Holder, ImportedBuffer, ImportedTexture,
    OptionalFeature, RawContext, RawSignal, RawWait, RenderPassDesc, RenderPipelineDesc, ShaderStage,
    TextureDesc, TextureHandle, TextureUsage, ValidationMode, ValidationSink,
};
use lvk_tests::compute::compute_pipeline;
use lvk_tests::raster::{pixels, run_pass, staged_pipeline};

use super::engine::{ALL, Engine, LOCAL_READ, SIDE};

fn texture_desc() -> TextureDesc<'static> {
    TextureDesc {
        format: Format::R32Uint,
        extent: [SIDE, SIDE],
        mips: 1,
        usage: TextureUsage::SAMPLED,
        debug_name: "the engine's image",
        ..Default::default()
    }
}

const ADD_ONE: &str = "
    layout(local_size_x = 16) in;
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; uint texture; };
    void main() {
        uint i = gl_LocalInvocationIndex;
        words.at[i] = textureBindlessFetchU2D(texture, ivec2(i % 4, i / 4), 0).x + 1 + i;
    }";

/// Imports the engine's image.
fn import_image(ctx: &Context, image: vk::Image) -> Holder<TextureHandle> {
    let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
    let texture = ImportedTexture { image, desc: texture_desc(), layout, concurrent: false };
    // SAFETY: the image is as described, and lives on.
    unsafe { ctx.import_texture(&texture).unwrap() }
}

/// Records a dispatch that reads the texture and writes the words, and the release of the texture to the engine.
fn add_one_and_release(
    ctx: &Context,
    pipeline: ComputePipelineHandle,
    texture: &Holder<TextureHandle>,
    words: BufferHandle,
) -> CommandBuffer {
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(pipeline).unwrap();
    let address = ctx.buffer_address(words).unwrap();
    cmd.push_constants(&[address as u32, (address >> 32) as u32, texture.index()]).unwrap();
    let uses = Dependencies { buffers: &[words], sampled_images: &[**texture], ..Default::default() };
    cmd.dispatch([1, 1, 1], &uses).unwrap();
    cmd.release_texture(**texture, vk::ImageLayout::TRANSFER_SRC_OPTIMAL).unwrap();
    cmd
}

/// The engine clears, the library reads and writes, the engine copies, clears again and gives back, twice.
#[test]
fn images_buffers_and_semaphores_are_exported_and_imported() {
    let Some(engine) = Engine::new() else { return };
    let ((image, image_memory), (buffer, buffer_memory), (copy, copy_memory)) =
        (engine.image(), engine.buffer(), engine.buffer());
    let binary = engine.semaphore(vk::SemaphoreType::BINARY);
    let timeline = engine.semaphore(vk::SemaphoreType::TIMELINE);
    {
        let ctx = engine.context();
        assert!(ctx.capabilities().has(OptionalFeature::FullDrawIndex));
        let has_cube_arrays = ctx.capabilities().has(OptionalFeature::CubeArrays);
        assert!(!has_cube_arrays, "the engine did not list it as enabled");
        let (texture, words) = (import_image(&ctx, image), engine.import(&ctx, buffer));
        let pipeline = compute_pipeline(&ctx, ADD_ONE);
        for (round, word) in [(1, 100), (2, 7000)] {
            ctx.with_raw_queue(|queue| {
                engine.submit(queue, &[], &[(binary, 0)], |commands| engine.clear(commands, image, word));
            });
            if round > 1 {
                // SAFETY: the clear leaves it so.
                unsafe { ctx.acquire_texture(*texture, vk::ImageLayout::TRANSFER_DST_OPTIMAL).unwrap() };
            }
            let cmd = add_one_and_release(&ctx, *pipeline, &texture, *words);
            let wait = RawWait { semaphore: binary, value: 0, stages: ALL };
            let signal = RawSignal { semaphore: timeline, value: 10 * round };
            // SAFETY: the binary semaphore has its signal under way, and the timeline rises.
            let handle = unsafe { ctx.submit_with(cmd, &[wait], &[signal]).unwrap() };
            ctx.with_raw_queue(|queue| {
                let (waits, signals) = ([(timeline, 10 * round)], [(timeline, 10 * round + 1)]);
                engine.submit(queue, &waits, &signals, |commands| engine.copy(commands, image, copy));
            });
            engine.wait(&[(timeline, 10 * round + 1), (ctx.raw_timeline(), handle.raw_value())]);
            assert!(ctx.is_done(handle).unwrap());
            assert_eq!(engine.words(copy_memory), [word; 16]);
            assert_eq!(engine.words(buffer_memory), (0..16).map(|i| word + 1 + i).collect::<Vec<_>>());
            let mut read = [0_u32; 16];
            ctx.download_buffer(*words, 0, bytemuck::cast_slice_mut(&mut read)).unwrap();
            assert_eq!(read[3], word + 4);
        }
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let refused = cmd.release_texture(*texture, vk::ImageLayout::UNDEFINED);
        assert!(matches!(refused, Err(Error::InvalidUsage { .. })));
    }
    // The context is gone, and all of this is alive still.
    engine.submit(engine.queue, &[], &[(timeline, 30)], |commands| engine.clear(commands, image, 1));
    engine.destroy(&[binary, timeline], image, &[buffer, copy], &[image_memory, buffer_memory, copy_memory]);
}

/// Features of the engine's device are used if the description lists them, and refused if not.
#[test]
fn targets_are_read_in_their_own_pass_on_another_engines_device() {
    let Some(engine) = Engine::new() else { return };
    let usage = TextureUsage::TARGET | TextureUsage::INPUT;
    let read = TextureDesc { format: Format::Rgba32Float, extent: [SIDE, SIDE], usage, ..Default::default() };
    let unsaid = engine.context();
    assert!(
        matches!(unsaid.create_texture(&read), Err(Error::Unsupported { .. })),
        "the engine did not list it as enabled"
    );
    drop(unsaid);
    if !engine.local_read {
        return eprintln!("NOT TESTED, the engine's device lacks dynamicRenderingLocalRead");
    }
    let features = engine.raw().features.with(OptionalFeature::LocalRead);
    let raw = RawContext { features, device_extensions: &LOCAL_READ, ..engine.raw() };
    // SAFETY: as of `Engine::context`, and the extension is on with its feature.
    let ctx = unsafe { Context::from_raw(raw, &ContextDesc::default()).unwrap() };
    let usage = TextureUsage::TARGET | TextureUsage::SAMPLED;
    let (read, drawn) = (ctx.create_texture(&read), ctx.create_texture(&TextureDesc { usage, ..read }));
    let (read, drawn) = (read.unwrap(), drawn.unwrap());
    let color = [Format::Rgba32Float.into(); 2];
    let desc = RenderPipelineDesc { color: &color, ..Default::default() };
    let [first, second] = [
        "layout(location = 0) out vec4 result; void main() { result = vec4(gl_FragCoord.xy, 3, 4); }",
        "LVK_INPUT(0, subpassInput, gRead); layout(location = 1) out vec4 result;
         void main() { result = subpassLoad(gRead) * 2.0; }",
    ]
    .map(|fragment| {
        let vertex = "void main() {
            gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0, 1); }";
        let stages = [(ShaderStage::Vertex, vertex), (ShaderStage::Fragment, fragment)];
        staged_pipeline(&ctx, &stages, &desc).unwrap()
    });
    let color = [*read, *drawn].map(|texture| ColorAttachment::clear(texture, [0.0; 4]));
    run_pass(&ctx, &RenderPassDesc { color: &color, local_read: true, ..Default::default() }, |pass| {
        for pipeline in [*first, *second] {
            pass.bind_render_pipeline(pipeline)?;
            pass.draw(0..3, 0..1)?;
        }
        Ok(())
    });
    for (at, pixel) in pixels::<[f32; 4]>(&ctx, *drawn).iter().enumerate() {
        let (x, y) = (at as u32 % SIDE, at as u32 / SIDE);
        assert_eq!(*pixel, [2.0 * x as f32 + 1.0, 2.0 * y as f32 + 1.0, 6.0, 8.0]);
    }
}

/// A context receives the messages of the engine's layer if it asks for them.
#[test]
fn a_guest_receives_the_messages_of_the_layer() {
    let Some(engine) = Engine::new() else { return };
    if !engine.raw().instance_extensions.contains(&ash::ext::debug_utils::NAME) {
        return eprintln!("NOT TESTED without the validation layer");
    }
    let sink = ValidationSink::default();
    let validation_sink = Some(sink.clone());
    let desc =
        ContextDesc { validation: ValidationMode::Standard, validation_sink, ..ContextDesc::default() };
    let (ctx, silent) = (engine.context_with(&desc), engine.context());
    let ext = ash::ext::debug_utils::Instance::new(&engine.instance.entry, &engine.instance.raw);
    let data = vk::DebugUtilsMessengerCallbackDataEXT::default().message(c"spoken by the engine");
    let (severity, kind) =
        (vk::DebugUtilsMessageSeverityFlagsEXT::ERROR, vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION);
    // SAFETY: the instance has the extension on, and the text lives during the call.
    unsafe { ext.submit_debug_utils_message(severity, kind, &data) };
    let texts: Vec<_> = ctx.validation().messages().into_iter().map(|message| message.text).collect();
    assert_eq!(texts, ["spoken by the engine"]);
    assert_eq!(engine.instance.take_messages(), texts, "the engine's own messenger stays");
    assert!(silent.validation().is_empty(), "it did not ask for messages");
    drop(ctx);
    assert_eq!(sink.take().len(), 1);
    // SAFETY: an error comes before anything is made.
    let unlisted =
        unsafe { Context::from_raw(RawContext { instance_extensions: &[], ..engine.raw() }, &desc) };
    let Err(Error::InvalidUsage { object, message }) = unlisted else { unreachable!("{unlisted:?}") };
    assert_eq!(object, "RawContext::instance_extensions");
    assert!(message.contains("VK_EXT_debug_utils"), "{message}");
}

/// The engine's device has no ray queries enabled, even if the driver has them.
#[test]
fn the_reason_for_the_ray_query_path_is_the_engines_device() {
    let Some(engine) = Engine::new() else { return };
    let reason = engine.context().capabilities().ray_query_reason;
    assert_eq!(reason, "the engine's device has no ray queries enabled");
}

/// An engine uses its other queues while a context ends, and a wait for the device would need all of them.
#[test]
fn a_context_waits_for_its_own_queues_only() {
    static DEVICE_WAITS: AtomicU32 = AtomicU32::new(0);
    unsafe extern "system" fn count_wait(_: vk::Device) -> vk::Result {
        DEVICE_WAITS.fetch_add(1, Ordering::Relaxed);
        vk::Result::SUCCESS
    }
    let Some(engine) = Engine::new() else { return };
    let handle = engine.device.handle();
    let find = |name: &CStr| {
        if name == c"vkDeviceWaitIdle" {
            return count_wait as *const c_void;
        }
        // SAFETY: the device is alive.
        let found = unsafe { engine.instance.raw.get_device_proc_addr(handle, name.as_ptr()) };
        found.map_or(std::ptr::null(), |function| function as *const c_void)
    };
    // SAFETY: the functions are those of the device, and one of the same signature.
    let device = unsafe { ash::Device::load_with(find, handle) };
    // SAFETY: as in `Engine::context`.
    let ctx =
        unsafe { Context::from_raw(RawContext { device, ..engine.raw() }, &ContextDesc::default()).unwrap() };
    let desc = BufferDesc { data: Some(&[7; 64]), ..Default::default() };
    let buffer = ctx.create_buffer(&desc).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.fill_buffer(*buffer, 0, 64, 8).unwrap();
    ctx.submit(cmd).unwrap();
    drop((buffer, ctx));
    assert_eq!(DEVICE_WAITS.load(Ordering::Relaxed), 0);
}

/// The driver says of itself that it has Vulkan 1.2.
#[test]
fn a_device_of_an_older_vulkan_is_refused() {
    unsafe extern "system" fn older(_: vk::PhysicalDevice, properties: *mut vk::PhysicalDeviceProperties) {
        let api_version = vk::API_VERSION_1_2;
        // SAFETY: the caller gives a structure to write to.
        unsafe { properties.write(vk::PhysicalDeviceProperties { api_version, ..Default::default() }) };
    }
    let Some(engine) = Engine::new() else { return };
    let handle = engine.instance.raw.handle();
    let find = |name: &CStr| {
        if name == c"vkGetPhysicalDeviceProperties" {
            return older as *const c_void;
        }
        // SAFETY: the instance is alive.
        let found = unsafe { engine.instance.entry.get_instance_proc_addr(handle, name.as_ptr()) };
        found.map_or(std::ptr::null(), |function| function as *const c_void)
    };
    // SAFETY: the functions are those of the instance, and one of the same signature.
    let instance = unsafe { ash::Instance::load_with(find, handle) };
    let raw = RawContext { instance, ..engine.raw() };
    // SAFETY: the device is refused before anything is made.
    match unsafe { Context::from_raw(raw, &ContextDesc::default()) } {
        Err(Error::NoDevice { candidates, .. }) => assert_eq!(candidates[0].missing, ["Vulkan 1.3"]),
        other => unreachable!("{other:?}"),
    }
}

#[test]
fn wrong_descriptions_are_refused() {
    let Some(engine) = Engine::new() else { return };
    let refuse = |raw: RawContext<'_>, field: &str, words: &str| {
        // SAFETY: what is wrong is found before anything is made.
        match unsafe { Context::from_raw(raw, &ContextDesc::default()) } {
            Err(Error::InvalidUsage { object, message }) => {
                assert_eq!(object, format!("RawContext::{field}"), "{message}");
                assert!(message.contains(words), "{message}");
            }
            other => unreachable!("{words}: {other:?}"),
        }
    };
    refuse(RawContext { queue_family: 77, ..engine.raw() }, "queue_family", "no queue family 77");
    let other = Some((vk::Queue::from_raw(8), 78));
    refuse(RawContext { compute_queue: other, ..engine.raw() }, "compute_queue", "no queue family 78");
    refuse(RawContext { transfer_queue: other, ..engine.raw() }, "transfer_queue", "no queue family 78");
    refuse(RawContext { queue: vk::Queue::null(), ..engine.raw() }, "queue", "null");
    let stranger = vk::PhysicalDevice::from_raw(8);
    refuse(RawContext { physical_device: stranger, ..engine.raw() }, "physical_device", "does not list");
    let mesh = RawContext { mesh_shader: true, ..engine.raw() };
    refuse(mesh, "device_extensions", "VK_EXT_mesh_shader is missing; `mesh_shader`");
    let query = RawContext { ray_query: true, ..engine.raw() };
    match engine.has_extension(ash::khr::ray_query::NAME) {
        true => refuse(query, "device_extensions", "VK_KHR_acceleration_structure is missing; `ray_query`"),
        false => refuse(query, "ray_query", "the device does not have the feature"),
    }
    let astc = FeatureSet::NONE.with(OptionalFeature::TextureCompressionAstcHdr);
    let astc = RawContext { features: astc, ..engine.raw() };
    refuse(astc, "features", "textureCompressionASTC_HDR cannot be on");

    let ctx = engine.context();
    let (image, memory) = engine.image();
    let layout = vk::ImageLayout::GENERAL;
    let import = |image: vk::Image, desc: TextureDesc<'_>, layout: vk::ImageLayout, words: &str| {
        // SAFETY: what is wrong is found before the image is used.
        match unsafe { ctx.import_texture(&ImportedTexture { image, desc, layout, concurrent: false }) } {
            Err(Error::InvalidUsage { message, .. }) => assert!(message.contains(words), "{message}"),
            other => unreachable!("{words}: {other:?}"),
        }
    };
    for _ in 0..3 {
        import(vk::Image::null(), texture_desc(), layout, "is null");
        import(image, texture_desc(), vk::ImageLayout::PREINITIALIZED, "cannot be exchanged");
        import(image, TextureDesc { data: Some(&[0; 64]), ..texture_desc() }, layout, "has its contents");
        import(image, TextureDesc { extent: [0, 4], ..texture_desc() }, layout, "needs texels");
    }
    let refused = |desc: TextureDesc<'_>| {
        // SAFETY: as above.
        let made = unsafe { ctx.import_texture(&ImportedTexture { image, desc, layout, concurrent: false }) };
        made.map(drop).unwrap_err()
    };
    let error = refused(TextureDesc { extent: [u32::MAX, 4], ..texture_desc() });
    assert!(matches!(error, Error::LimitExceeded { .. }), "{error}");
    // The description of the device lists no `LocalRead`.
    let usage = TextureUsage::TARGET | TextureUsage::INPUT;
    let error = refused(TextureDesc { format: Format::Rgba32Float, usage, ..texture_desc() });
    assert!(matches!(error, Error::Unsupported { .. }), "{error}");
    let empty = ImportedBuffer {
        buffer: vk::Buffer::null(),
        size_bytes: 4,
        usage: BufferUsage::STORAGE,
        concurrent: false,
        debug_name: "none",
    };
    // SAFETY: as above.
    let refused = unsafe { ctx.import_buffer(&empty) };
    assert!(matches!(&refused, Err(Error::InvalidUsage { object, .. }) if object == "none"));
    drop(refused);
    drop(ctx);
    // SAFETY: the engine's own.
    unsafe {
        engine.device.destroy_image(image, None);
        engine.device.free_memory(memory, None);
    }
}
