//! Creation of contexts: the device list, errors that name what is missing, and devices without ray tracing.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::ffi::OsStr;
use std::path::Path;

use lvk::ash::vk;
use lvk::{
    BlasDesc, BlasGeometry, BufferDesc, BufferUsage, Context, ContextDesc, Error, LoaderReport,
    ManifestOutcome, RayQueryRequest, RayTracingPipelineRequest, ShaderModuleDesc, ShaderSource, ShaderStage,
    TlasDesc, Triangles, ValidationMode,
};
use lvk_tests::compute::words_buffer;
use lvk_tests::device::vulkan;
use lvk_tests::raster::expect_drawing;
use lvk_tests::subprocess::{in_subprocess, on_swiftshader};
use lvk_tests::{device, device_with, without_software};

/// A context with the loader of the tests and nothing else asked for.
fn start<'a>(adjust: impl FnOnce(&mut ContextDesc<'a>)) -> lvk::Result<Context> {
    let mut desc = ContextDesc { vulkan_library: vulkan().flatten(), ..Default::default() };
    adjust(&mut desc);
    Context::new(&desc)
}

#[test]
fn devices_are_listed_with_what_they_can_do() {
    let Some(ctx) = without_software(|_| ()) else { return };
    let devices = Context::devices(vulkan().flatten()).unwrap();
    let own = ctx.capabilities();
    let listed = devices.iter().find(|device| device.device_name == own.device_name).unwrap();
    assert_eq!(listed.ray_query, own.ray_query);
    assert_eq!(listed.ray_tracing_pipeline, own.ray_tracing_pipeline);
    assert!(own.api_version >= (1, 3, 0) && !own.driver_name.is_empty(), "{own:?}");
    assert!(own.limits.max_texture_2d >= 4096 && own.limits.max_push_constant_bytes >= 128);
    assert_eq!(own.ray_tracing_fallback, None);
}

#[test]
fn a_wrong_library_is_no_vulkan() {
    let Some(_) = vulkan() else { return };
    let nowhere = Path::new("/nowhere/libvulkan.so.1");
    for result in [
        start(|desc| desc.vulkan_library = Some(nowhere)).map(drop),
        Context::devices(Some(nowhere)).map(drop),
    ] {
        match result {
            Err(Error::NoVulkan { report }) => {
                assert!(
                    matches!(&report.loader, LoaderReport::NotOpened { path, error }
                        if path == nowhere && error.contains("/nowhere")),
                    "{report}"
                );
            }
            other => unreachable!("{other:?}"),
        }
    }
}

/// Two broken drivers, one after the other in the variable that lists drivers.
#[test]
fn drivers_that_cannot_be_loaded_are_named() {
    let Some(_) = vulkan() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(
        path("a.json"),
        r#"{"file_format_version": "1.0.0", "ICD": {"library_path": "./libtoy.so", "api_version": "1.3.1"}}"#,
    )
    .unwrap();
    std::fs::write(
        path("libtoy.so"),
        "a text in the place of a library, which is longer than the header of ELF",
    )
    .unwrap();
    std::fs::write(path("b.json"), "{").unwrap();
    let listed = std::env::join_paths([path("a.json"), path("b.json")]).unwrap();
    let variables =
        [("VK_DRIVER_FILES", Some(listed.as_os_str())), ("VK_ICD_FILENAMES", None), ("LVK_DRIVER", None)];
    in_subprocess(drivers_that_cannot_be_loaded_are_named, &variables, || {
        let Some(library) = vulkan() else { return };
        let report = match start(|_| ()) {
            Err(Error::NoVulkan { report }) => report,
            other => unreachable!("{other:?}"),
        };
        assert!(
            matches!(&report.loader, LoaderReport::Opened { version: Some(version), .. } if *version >= (1, 3, 0)),
            "{report}"
        );
        let outcomes: Vec<_> = report.manifests.iter().map(|manifest| &manifest.outcome).collect();
        assert!(
            matches!(outcomes[..], [ManifestOutcome::LoadFailed { error }, ManifestOutcome::NotRead { .. }]
                if error.contains("libtoy.so") && error.contains("invalid ELF header")),
            "{report}"
        );
        let text = report.to_string();
        for part in ["a.json", "b.json", "remedy: install the driver of", "remedy: correct or remove"] {
            assert!(text.contains(part) && text.lines().count() == 1, "no '{part}' in {text}");
        }
        let listed = Context::vulkan_report(library);
        assert!(listed.devices.is_empty());
        assert_eq!(listed.drivers.manifests, report.manifests);
        let summary = listed.summary();
        assert!(summary.contains("a.json") && !summary.contains("remedy"), "{summary}");
    });
}

#[test]
fn the_report_lists_the_devices_that_work() {
    let Some(ctx) = device() else { return };
    let report = Context::vulkan_report(vulkan().flatten());
    assert!(matches!(report.drivers.loader, LoaderReport::Opened { .. }), "{report}");
    let own = report.devices.iter().find(|device| device.name == ctx.capabilities().device_name).unwrap();
    assert_eq!((own.api_version, own.missing.len()), (ctx.capabilities().api_version, 0));
    assert!(!report.to_string().contains("remedy"), "{report}");
}

#[test]
fn the_device_can_be_chosen_by_number_and_name() {
    in_subprocess(the_device_can_be_chosen_by_number_and_name, &[("LVK_DEVICE", None)], || {
        let Some(ctx) = device() else { return };
        let name = ctx.capabilities().device_name.clone();
        let chosen = start(|desc| desc.device = Some("0")).unwrap();
        let first = Context::devices(vulkan().flatten()).unwrap().remove(0);
        assert_eq!(chosen.capabilities().device_name, first.device_name);
        let upper = name.to_uppercase();
        match start(|desc| desc.device = Some(&upper)) {
            Ok(chosen) => assert_eq!(chosen.capabilities().device_name, name),
            Err(Error::NoDevice { problem, .. }) => assert!(problem.unwrap().contains("several")),
            Err(other) => unreachable!("{other}"),
        }
        match start(|desc| desc.device = Some("no such device")) {
            Err(Error::NoDevice { problem, candidates, drivers }) => {
                assert_eq!(problem.as_deref(), Some("'no such device' names no device"));
                assert!(candidates.iter().any(|device| device.name == name), "{candidates:?}");
                let drivers = drivers.unwrap();
                assert!(matches!(drivers.loader, LoaderReport::Opened { .. }), "{drivers}");
                assert!(
                    drivers.manifests.iter().any(|it| it.outcome == ManifestOutcome::Loaded),
                    "{drivers}"
                );
            }
            other => unreachable!("{other:?}"),
        }
    });
}

#[test]
fn the_environment_overrides_the_description() {
    let Some(_) = vulkan() else { return };
    let wish = Some(OsStr::new("somewhere else"));
    in_subprocess(the_environment_overrides_the_description, &[("LVK_DEVICE", wish)], || {
        match start(|desc| desc.device = Some("0")) {
            Err(Error::NoDevice { problem, .. }) => assert!(problem.unwrap().contains("'somewhere else'")),
            other => unreachable!("{other:?}"),
        }
    });
}

fn ray_query_shader(ctx: &Context) -> lvk::Result<()> {
    let text = "
        #include <lvk/ray_query.glsl>
        layout(local_size_x = 1) in;
        layout(push_constant, scalar) uniform Push { uint tlas; };
        void main() {
            LvkRayQuery query;
            lvkRayQueryInitialize(query, tlas, LVK_RAY_FLAG_OPAQUE, 0xffu, vec3(0), 0.0, vec3(0, 0, 1), 1.0);
        }";
    let source = ShaderSource::Glsl(text);
    ctx.create_shader_module(&ShaderModuleDesc { stage: ShaderStage::Compute, source, ..Default::default() })
        .map(drop)
}

fn ray_gen_shader(ctx: &Context) -> lvk::Result<()> {
    let source = ShaderSource::Glsl("void main() {}");
    ctx.create_shader_module(&ShaderModuleDesc { stage: ShaderStage::RayGen, source, ..Default::default() })
        .map(drop)
}

fn unsupported<T: std::fmt::Debug>(result: lvk::Result<T>) {
    assert!(matches!(result, Err(Error::Unsupported { .. })), "{result:?}");
}

#[test]
fn features_turned_off_are_missing() {
    let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Off) else { return };
    assert!(!ctx.capabilities().ray_query);
    unsupported(ray_query_shader(&ctx));
    assert_eq!(ray_gen_shader(&ctx).is_ok(), ctx.capabilities().ray_tracing_pipeline);
    drop(ctx);
    let Some(ctx) = device_with(|desc| desc.ray_tracing_pipeline = RayTracingPipelineRequest::Off) else {
        return;
    };
    assert!(!ctx.capabilities().ray_tracing_pipeline);
    unsupported(ray_gen_shader(&ctx));
    assert_eq!(ray_query_shader(&ctx).is_ok(), ctx.capabilities().ray_query);
}

/// Asserts the errors of every context without ray tracing.
fn expect_no_ray_tracing(ctx: &Context) {
    assert!(!ctx.capabilities().ray_query && !ctx.capabilities().ray_tracing_pipeline);
    unsupported(ray_query_shader(ctx));
    unsupported(ray_gen_shader(ctx));
    let input = BufferDesc { size_bytes: 36, usage: BufferUsage::ACCEL_INPUT, ..Default::default() };
    unsupported(ctx.create_buffer(&input));
    unsupported(ctx.create_tlas(&TlasDesc::default()));
    let vertices = words_buffer(ctx, &[0; 9]);
    let geometries = [BlasGeometry::Triangles(Triangles::packed(*vertices, 3))];
    unsupported(ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() }));
}

#[test]
fn everything_else_works_with_ray_tracing_turned_off() {
    let Some(ctx) = device_with(|desc| {
        desc.ray_query = RayQueryRequest::Off;
        desc.ray_tracing_pipeline = RayTracingPipelineRequest::Off;
    }) else {
        return;
    };
    expect_no_ray_tracing(&ctx);
    expect_drawing(&ctx);
}

#[test]
fn a_device_without_ray_tracing_does_everything_else() {
    on_swiftshader(a_device_without_ray_tracing_does_everything_else, || {
        let Some(ctx) = without_software(|_| ()) else { return };
        assert!(ctx.capabilities().device_name.contains("SwiftShader"), "{:?}", ctx.capabilities());
        expect_no_ray_tracing(&ctx);
        expect_drawing(&ctx);
        for (pipeline, query, lack) in [
            (
                RayTracingPipelineRequest::Hardware,
                RayQueryRequest::HardwareIfPresent,
                "lacks ray tracing pipelines",
            ),
            (RayTracingPipelineRequest::Off, RayQueryRequest::Hardware, "lacks ray queries"),
        ] {
            let required = start(|desc| (desc.ray_tracing_pipeline, desc.ray_query) = (pipeline, query));
            match required {
                Err(Error::NoDevice { candidates, .. }) => {
                    let device = candidates[0].to_string();
                    assert!(device.contains("SwiftShader") && device.contains(lack), "{device}");
                }
                other => unreachable!("{other:?}"),
            }
        }
    });
}

/// Without this the silence of the other tests would mean nothing.
#[test]
fn validation_hears_a_missing_barrier_and_a_wrong_call() {
    let Some(ctx) = device() else { return };
    let buffer = words_buffer(&ctx, &[0; 16]);
    ctx.wait_idle().unwrap();
    let raw = ctx.raw_buffer(*buffer).unwrap();
    let cmd = ctx.acquire_command_buffer().unwrap();
    for value in [1, 2] {
        // SAFETY: the command buffer is being recorded and the buffer is alive; that nothing orders the fills is the
        // point.
        unsafe { ctx.raw_device().cmd_fill_buffer(cmd.raw(), raw, 0, vk::WHOLE_SIZE, value) };
    }
    ctx.submit(cmd).unwrap();
    ctx.wait_idle().unwrap();
    let messages = ctx.take_messages();
    assert!(
        messages.iter().any(|message| message.error && message.id.contains("SYNC-HAZARD")),
        "{messages:?}"
    );
    let info = vk::BufferCreateInfo::default().size(0).usage(vk::BufferUsageFlags::TRANSFER_SRC);
    // SAFETY: the driver takes any size; the layer complains.
    if let Ok(odd) = unsafe { ctx.raw_device().create_buffer(&info, None) } {
        // SAFETY: created above and not used.
        unsafe { ctx.raw_device().destroy_buffer(odd, None) };
    }
    let messages = ctx.take_messages();
    assert!(
        messages.iter().any(|message| message.id.contains("VUID-VkBufferCreateInfo-size")),
        "{messages:?}"
    );
}

/// Two submissions by hand: the library asks how far the device is, which a fast device answers with "done".
#[test]
fn validation_hears_a_missing_barrier_between_submissions() {
    let Some(ctx) = device() else { return };
    let buffer = words_buffer(&ctx, &[0; 16]);
    ctx.wait_idle().unwrap();
    let (device, raw) = (ctx.raw_device(), ctx.raw_buffer(*buffer).unwrap());
    let info = vk::CommandPoolCreateInfo::default().queue_family_index(ctx.raw_queue_family());
    // SAFETY: the pool and its command buffers are this test's own and go when the device is idle; that nothing orders
    // the fills is the point.
    unsafe {
        let pool = device.create_command_pool(&info, None).unwrap();
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(2);
        let commands = device.allocate_command_buffers(&info).unwrap();
        for (commands, value) in commands.into_iter().zip([1, 2]) {
            device.begin_command_buffer(commands, &vk::CommandBufferBeginInfo::default()).unwrap();
            device.cmd_fill_buffer(commands, raw, 0, vk::WHOLE_SIZE, value);
            device.end_command_buffer(commands).unwrap();
            let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
            let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
            ctx.with_raw_queue(|queue| device.queue_submit2(queue, &submit, vk::Fence::null())).unwrap();
        }
        device.device_wait_idle().unwrap();
        device.destroy_command_pool(pool, None);
    }
    let messages = ctx.take_messages();
    assert!(messages.iter().any(|message| message.id.contains("SYNC-HAZARD")), "{messages:?}");
}

#[test]
fn a_context_without_validation_is_silent() {
    let Some(_) = vulkan() else { return };
    let ctx = start(|desc| desc.validation = ValidationMode::Off).unwrap();
    expect_drawing(&ctx);
    assert!(ctx.validation().is_empty());
}

/// For each name, the loader searches the devices of all instances of the process.
#[test]
fn objects_are_named_while_other_contexts_come_and_go() {
    let Some(ctx) = device() else { return };
    let desc = BufferDesc { size_bytes: 256, debug_name: "named", ..Default::default() };
    std::thread::scope(|scope| {
        let others = scope.spawn(|| (0..20).for_each(|_| drop(start(|_| ()).unwrap())));
        while !others.is_finished() {
            drop(ctx.create_buffer(&desc).unwrap());
        }
    });
}
