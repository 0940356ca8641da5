//! Device profiles: hidden features are absent, tightened limits hold, and errors name the profile.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::ffi::CStr;

use lvk::ash::{self, vk};
use lvk::{
    BlasDesc, BlasGeometry, BufferDesc, BufferUsage, Capabilities, Context, ContextDesc, DeviceCandidate,
    DeviceProfile, Error, FeatureSet, Holder, OptionalFeature, RayQueryRequest, RayTracingPipelinePath,
    RayTracingPipelineRequest, ShaderModuleDesc, ShaderSource, ShaderStage, TlasDesc, Triangles,
    UserExtensions,
};
use lvk_tests::accel_backend::requires_device_accel_structs;
use lvk_tests::device::vulkan;
use lvk_tests::raster::expect_drawing;
use lvk_tests::{TestDevice, device, device_with, without_software};

fn under(profile: &DeviceProfile) -> Option<TestDevice> {
    without_software(|desc| desc.profile = Some(profile))
}

#[test]
fn built_in_profiles_leave_what_they_say() {
    let Some(real) = without_software(|_| ()) else { return };
    let real = real.capabilities().clone();
    assert_eq!(real.profile, None);
    for name in DeviceProfile::names() {
        let profile = DeviceProfile::named(name).unwrap();
        let Some(ctx) = under(&profile) else { return };
        let left = ctx.capabilities();
        assert_eq!(left.profile.as_deref(), Some(name));
        assert_eq!(left.ray_tracing_pipeline, real.ray_tracing_pipeline && profile.ray_tracing_pipeline);
        assert_eq!(left.ray_query, real.ray_query && profile.ray_query, "{name}");
        assert_eq!(left.mesh_shader, real.mesh_shader && profile.mesh_shader, "{name}");
        let any = left.ray_tracing_pipeline || left.ray_query;
        assert_eq!(left.position_fetch, real.position_fetch && profile.position_fetch && any, "{name}");
        assert_eq!(ctx.accel_memory().structure_bytes > 0, any, "{name}: the default TLAS");
    }
}

#[test]
fn phone_limits_hold_on_a_laxer_driver() {
    let Some(ctx) = under(&DeviceProfile::mali_g715()) else { return };
    let limits = &ctx.capabilities().limits;
    assert_eq!(limits.scratch_alignment % 256, 0);
    assert!(limits.max_storage_buffer_range <= 256 << 20);
    assert!(limits.max_accel_structure_bytes <= 256 << 20 && limits.max_accel_scratch_bytes <= 256 << 20);
}

/// Extensions are really off: the driver gives no functions of theirs.
#[test]
fn the_device_is_made_without_what_is_hidden() {
    let has = |ctx: &Context, name: &CStr| {
        let device = ctx.raw_device().handle();
        // SAFETY: the device is alive.
        unsafe { ctx.raw_instance().get_device_proc_addr(device, name.as_ptr()) }.is_some()
    };
    let Some(real) = without_software(|_| ()) else { return };
    if !real.capabilities().ray_tracing_pipeline {
        eprintln!("NOT TESTED, {} has no ray tracing pipelines", real.capabilities().device_name);
        return;
    }
    for (profile, pipelines, structures) in [
        (DeviceProfile::default(), true, true),
        (DeviceProfile::no_rt_pipeline(), false, true),
        (DeviceProfile::no_ray_tracing(), false, false),
    ] {
        let Some(ctx) = under(&profile) else { return };
        let real = ctx.capabilities();
        let trace = has(&ctx, c"vkCmdTraceRaysKHR");
        assert_eq!((trace, real.ray_tracing_pipeline), (pipelines, pipelines), "{}", profile.name);
        let build = has(&ctx, c"vkCmdBuildAccelerationStructuresKHR");
        assert_eq!(build, structures && (real.ray_tracing_pipeline || real.ray_query), "{}", profile.name);
    }
}

#[test]
fn a_hidden_feature_cannot_be_required() {
    let Some(ctx) = without_software(|_| ()) else { return };
    let real: Capabilities = ctx.capabilities().clone();
    for (profile, pipeline, query, had, lack) in [
        (
            DeviceProfile::mali_g715(),
            RayTracingPipelineRequest::Hardware,
            RayQueryRequest::HardwareIfPresent,
            real.ray_tracing_pipeline,
            "lacks ray tracing pipelines (hidden by the device profile 'mali-g715')",
        ),
        (
            DeviceProfile::no_ray_query(),
            RayTracingPipelineRequest::HardwareIfPresent,
            RayQueryRequest::Hardware,
            real.ray_query,
            "lacks ray queries (hidden by the device profile 'no-ray-query')",
        ),
    ] {
        let desc = ContextDesc {
            vulkan_library: vulkan().flatten(),
            device: Some(&real.device_name),
            profile: Some(&profile),
            ray_tracing_pipeline: pipeline,
            ray_query: query,
            ..Default::default()
        };
        match Context::new(&desc) {
            Err(Error::NoDevice { candidates, .. }) => {
                let is_real = |device: &&DeviceCandidate| device.name == real.device_name;
                let device = candidates.iter().find(is_real).unwrap().to_string();
                assert_eq!(device.contains(lack), had, "{device}");
            }
            other => unreachable!("{:?}", other.map(|ctx| ctx.capabilities().clone())),
        }
    }
}

fn vertices(ctx: &Context, triangles: u32) -> Holder<lvk::BufferHandle> {
    let corner = |index: u32| [(index % 97) as f32, (index % 89) as f32 * 0.5, (index % 83) as f32];
    let positions: Vec<[f32; 3]> = (0..triangles * 3).map(corner).collect();
    let data = Some(bytemuck::cast_slice(&positions));
    ctx.create_buffer(&BufferDesc { usage: BufferUsage::ACCEL_INPUT, data, ..Default::default() }).unwrap()
}

/// The driver's own size for one build is smaller: the size of the phone counts.
#[test]
fn sizes_are_those_of_the_phone_where_it_needs_more() {
    const TRIANGLES: u64 = 1_000;
    let sizes = |ctx: &Context| {
        let buffer = vertices(ctx, TRIANGLES as u32);
        let geometries = [BlasGeometry::Triangles(Triangles::packed(*buffer, 3 * TRIANGLES as u32))];
        ctx.blas_sizes(&BlasDesc { geometries: &geometries, ..Default::default() }).unwrap()
    };
    let Some(real) = without_software(|_| ()) else { return };
    if !requires_device_accel_structs(&real, "sizes that a profile raises") {
        return;
    }
    let own = sizes(&real);
    let profile = DeviceProfile { ray_tracing_pipeline: true, ..DeviceProfile::mali_g715() };
    let Some(ctx) = under(&profile) else { return };
    let mali = sizes(&ctx);
    assert_eq!(mali.build_scratch_bytes, own.build_scratch_bytes.max(2_805 * TRIANGLES));
    assert_eq!(mali.structure_bytes, own.structure_bytes.max(219 * TRIANGLES));
}

/// A TLAS cannot be split: it is refused by name, whichever of its sizes is over.
#[test]
fn a_profile_limits_top_levels() {
    const INSTANCES: u32 = 20_000;
    let desc = TlasDesc { capacity: INSTANCES, debug_name: "the world", ..Default::default() };
    let Some(real) = without_software(|_| ()) else { return };
    if !requires_device_accel_structs(&real, "limits of a profile") {
        return;
    }
    let sizes = real.accel_struct_sizes(*real.create_tlas(&desc).unwrap()).unwrap();
    let (structure, scratch) = (sizes.structure_bytes, sizes.build_scratch_bytes);
    let alignment = u64::from(real.capabilities().limits.scratch_alignment);
    let any = DeviceProfile { name: "phone".into(), ..DeviceProfile::default() };
    let range = |max_storage_buffer_range| DeviceProfile { max_storage_buffer_range, ..any.clone() };
    for (profile, what) in [
        (DeviceProfile { max_accel_structure_bytes: structure - 1, ..any.clone() }, Some("size of the TLAS")),
        (DeviceProfile { max_accel_scratch_bytes: scratch - 1, ..any.clone() }, Some("scratch of a build")),
        (range(structure.max(scratch) - 1), Some("in bytes")),
        (range(structure.max(scratch + alignment)), None),
    ] {
        let Some(ctx) = under(&profile) else { return };
        match (ctx.create_tlas(&desc), what) {
            (Ok(_), None) => {}
            (Err(Error::LimitExceeded { object, what: found, requested, limit, .. }), Some(what)) => {
                assert!(
                    object == "the world" && found.contains(what) && requested > limit,
                    "{object}: {found}"
                );
            }
            (other, _) => unreachable!("{what:?}: {:?}", other.map(drop)),
        }
    }
}

#[test]
fn a_profile_of_ones_own_is_made_from_a_built_in_one() {
    let profile = DeviceProfile { name: "tiny".into(), max_blas_primitives: 100, ..DeviceProfile::default() };
    let Some(ctx) = under(&profile) else { return };
    assert_eq!(ctx.capabilities().profile.as_deref(), Some("tiny"));
    assert!(ctx.capabilities().limits.max_blas_primitives <= 100);
}

#[test]
fn limits_of_mesh_shaders_are_there_with_them_only() {
    let Some(ctx) = device() else { return };
    let limits = |ctx: &Context| ctx.capabilities().limits.mesh;
    let has = ctx.capabilities().mesh_shader;
    assert_eq!(limits(&ctx) != Default::default(), has);
    assert!(!has || limits(&ctx).max_mesh_workgroups_total >= 1 << 22, "{:?}", limits(&ctx));
    let Some(ctx) = under(&DeviceProfile { mesh_shader: false, ..DeviceProfile::default() }) else { return };
    assert_eq!(limits(&ctx), Default::default());
    let device = ctx.raw_device().handle();
    let name = ash::ext::mesh_shader::NAME;
    // SAFETY: the device is alive.
    let draw: vk::PFN_vkVoidFunction =
        unsafe { ctx.raw_instance().get_device_proc_addr(device, c"vkCmdDrawMeshTasksEXT".as_ptr()) };
    assert!(draw.is_none(), "{name:?}");
}

#[test]
fn optional_features_are_those_of_the_device() {
    let Some(ctx) = device() else { return };
    let has = |ctx: &Context, name: &CStr| {
        let device = ctx.raw_device().handle();
        // SAFETY: the device is alive.
        unsafe { ctx.raw_instance().get_device_proc_addr(device, name.as_ptr()) }.is_some()
    };
    for (feature, command) in [
        (OptionalFeature::LocalRead, c"vkCmdSetRenderingInputAttachmentIndicesKHR"),
        (OptionalFeature::PipelineShadingRate, c"vkCmdSetFragmentShadingRateKHR"),
        (OptionalFeature::HostImageCopy, c"vkCopyMemoryToImageEXT"),
        (OptionalFeature::DeviceFault, c"vkGetDeviceFaultInfoEXT"),
        (OptionalFeature::CalibratedTimestamps, c"vkGetCalibratedTimestampsEXT"),
    ] {
        let there = ctx.capabilities().has(feature);
        assert!(!has(&ctx, command) || there, "{feature:?}");
        assert!(
            has(&ctx, command) || !there || feature == OptionalFeature::CalibratedTimestamps,
            "{feature:?}"
        );
        // Other features of the same extension stay enabled.
        let others = match feature {
            OptionalFeature::PipelineShadingRate => {
                &[OptionalFeature::PrimitiveShadingRate, OptionalFeature::AttachmentShadingRate][..]
            }
            _ => &[],
        };
        let hidden = others.iter().fold(FeatureSet::NONE.with(feature), |set, other| set.with(*other));
        let profile = DeviceProfile { hidden, ..DeviceProfile::default() };
        let Some(ctx) = under(&profile) else { return };
        assert!(!ctx.capabilities().has(feature) && !has(&ctx, command), "{feature:?}");
    }
    assert!(!ctx.capabilities().has(OptionalFeature::Swapchain), "no window was asked for");
}

/// The whole path of a small program, with nothing optional.
#[test]
fn core_only_devices_draw_and_compute() {
    let Some(ctx) = under(&DeviceProfile::core_only()) else { return };
    let caps = ctx.capabilities();
    assert_eq!(caps.optional, FeatureSet::PORTABILITY);
    assert!(!(caps.cube_arrays || caps.multi_draw_indirect || caps.shader_int64 || caps.mesh_shader));
    assert!((caps.max_anisotropy - 1.0).abs() < f32::EPSILON);
    expect_drawing(&ctx);
}

/// A shader that needs a hidden feature is refused by its name.
#[test]
fn a_hidden_feature_refuses_its_shaders() {
    let source = "layout(local_size_x = 1) in; layout(push_constant) uniform P { uint a; };
        void main() { if (uint64_t(a) * 5 == 5) { memoryBarrier(); } }";
    let module = |ctx: &Context| {
        ctx.create_shader_module(&ShaderModuleDesc {
            stage: ShaderStage::Compute,
            source: ShaderSource::Glsl(source),
            debug_name: "wide",
            ..Default::default()
        })
    };
    let Some(real) = device() else { return };
    assert_eq!(module(&real).is_ok(), real.capabilities().has(OptionalFeature::Int64));
    let hidden = FeatureSet::NONE.with(OptionalFeature::Int64);
    let Some(ctx) = under(&DeviceProfile { hidden, ..DeviceProfile::default() }) else { return };
    match module(&ctx) {
        Err(error @ Error::Unsupported { .. }) => {
            let text = error.to_string();
            assert!(text.contains("'wide'") && text.contains("shaderInt64"), "{text}");
        }
        other => unreachable!("{:?}", other.map(drop)),
    }
}

#[test]
fn required_features_choose_the_device() {
    let Some(real) = device() else { return };
    let name = real.capabilities().device_name.clone();
    let hidden = FeatureSet::NONE.with(OptionalFeature::ClipDistance);
    let profile = DeviceProfile { name: "no clipping".into(), hidden, ..DeviceProfile::default() };
    let start = |profile, required: &[OptionalFeature]| {
        let desc = ContextDesc {
            vulkan_library: vulkan().flatten(),
            device: Some(&name),
            profile,
            required_features: required,
            ..Default::default()
        };
        Context::new(&desc)
    };
    assert!(start(None, &[OptionalFeature::ClipDistance]).is_ok());
    assert!(start(Some(&profile), &[OptionalFeature::SamplerAnisotropy]).is_ok());
    match start(Some(&profile), &[OptionalFeature::SamplerAnisotropy, OptionalFeature::ClipDistance]) {
        Err(Error::NoDevice { candidates, .. }) => {
            let device = candidates.iter().find(|device| device.name == name).unwrap();
            assert_eq!(device.missing, ["shaderClipDistance (hidden by the device profile 'no clipping')"]);
        }
        other => unreachable!("{:?}", other.map(drop)),
    }
}

/// Pipelines of a CPU are lowered, and have no features of the device's own, unless one is required.
#[test]
fn a_required_feature_of_pipelines_keeps_the_pipelines_of_the_device() {
    let Some(real) = device_with(|desc| {
        desc.ray_tracing_pipeline = RayTracingPipelineRequest::HardwareIfPresent;
    }) else {
        return;
    };
    let feature = OptionalFeature::RayTracingMaintenance1;
    if !real.capabilities().has(feature) {
        eprintln!("NOT TESTED, the device lacks {}", feature.vulkan_name());
        return;
    }
    let name = real.capabilities().device_name.clone();
    let start = |request, required: &[OptionalFeature]| {
        Context::new(&ContextDesc {
            vulkan_library: vulkan().flatten(),
            device: Some(&name),
            ray_tracing_pipeline: request,
            required_features: required,
            ..Default::default()
        })
    };
    let ctx = start(RayTracingPipelineRequest::Auto, &[feature]).unwrap();
    assert!(ctx.capabilities().has(feature), "{}", ctx.capabilities().ray_tracing_pipeline_reason);
    assert_eq!(ctx.capabilities().ray_tracing_pipeline_path, RayTracingPipelinePath::Hardware);
    for (request, reason) in [
        (RayTracingPipelineRequest::Software, "software was asked for"),
        (RayTracingPipelineRequest::Off, "ray tracing pipelines are turned off"),
    ] {
        assert!(start(request, &[]).is_ok());
        let Err(Error::NoDevice { candidates, .. }) = start(request, &[feature]) else {
            unreachable!("{request:?} has {}", feature.vulkan_name())
        };
        let device = candidates.iter().find(|device| device.name == name).unwrap();
        let [missing] = &*device.missing else { unreachable!("{:?}", device.missing) };
        assert!(missing.starts_with(feature.vulkan_name()) && missing.contains(reason), "{missing}");
    }
}

/// The extension is on with its features, and its shaders are taken.
#[test]
fn extensions_of_the_callers_own_are_on() {
    let Some(plain) = device() else { return };
    let source = "
        #extension GL_ARB_fragment_shader_interlock : require
        layout(pixel_interlock_ordered) in;
        layout(location = 0) out vec4 result;
        void main() {
            beginInvocationInterlockARB();
            result = vec4(1.0);
            endInvocationInterlockARB();
        }";
    let module = |ctx: &Context| {
        ctx.create_shader_module(&ShaderModuleDesc {
            stage: ShaderStage::Fragment,
            source: ShaderSource::Glsl(source),
            ..Default::default()
        })
    };
    let refused = module(&plain).map(drop).unwrap_err().to_string();
    assert!(refused.contains("FragmentShaderPixelInterlockEXT"), "{refused}");
    let name = ash::ext::fragment_shader_interlock::NAME;
    if !has_extension(&plain, name) {
        eprintln!("NOT TESTED, the device lacks {name:?}");
        return;
    }
    let features =
        vk::PhysicalDeviceFragmentShaderInterlockFeaturesEXT::default().fragment_shader_pixel_interlock(true);
    const PIXEL_INTERLOCK: u32 = 5378;
    let extensions = [name, ash::khr::external_memory_fd::NAME, ash::khr::external_memory_fd::NAME];
    // SAFETY: the chain is one structure of an extension that the device has, which allows this capability; devices
    // that have the extension have the feature.
    let extra = unsafe { UserExtensions::new(&[], &extensions, Some(&features), &[PIXEL_INTERLOCK]) };
    let Some(ctx) = device_with(|desc| desc.user_extensions = extra) else { return };
    assert!(module(&ctx).is_ok());
    let device = ctx.raw_device().handle();
    // SAFETY: the device is alive.
    let found = unsafe { ctx.raw_instance().get_device_proc_addr(device, c"vkGetMemoryFdKHR".as_ptr()) };
    assert!(found.is_some());
}

/// The loader maps the bytes of an immutable static without write access.
#[test]
fn the_callers_features_may_lie_in_memory_that_cannot_be_written() {
    static FEATURES: vk::PhysicalDeviceDepthClipEnableFeaturesEXT<'static> =
        vk::PhysicalDeviceDepthClipEnableFeaturesEXT {
            s_type: vk::StructureType::PHYSICAL_DEVICE_DEPTH_CLIP_ENABLE_FEATURES_EXT,
            p_next: std::ptr::null_mut(),
            depth_clip_enable: vk::TRUE,
            _marker: std::marker::PhantomData,
        };
    let Some(plain) = device() else { return };
    let name = ash::ext::depth_clip_enable::NAME;
    if !has_extension(&plain, name) {
        eprintln!("NOT TESTED, the device lacks {name:?}");
        return;
    }
    let extensions = [name];
    // SAFETY: the chain is one structure of an extension that the device has; devices that have it have the feature.
    let extra = unsafe { UserExtensions::new(&[], &extensions, Some(&FEATURES), &[]) };
    drop(device_with(|desc| desc.user_extensions = extra));
}

fn has_extension(ctx: &Context, name: &CStr) -> bool {
    // SAFETY: the physical device belongs to the instance.
    let there =
        unsafe { ctx.raw_instance().enumerate_device_extension_properties(ctx.raw_physical_device()) };
    there.unwrap().iter().any(|found| found.extension_name_as_c_str() == Ok(name))
}

#[test]
fn unknown_extensions_are_named() {
    let Some(_) = device() else { return };
    let nowhere = [c"VK_LVK_nowhere"];
    for (instance, device) in [(true, false), (false, true)] {
        let list = |on: bool| if on { &nowhere[..] } else { &[] };
        // SAFETY: there is no chain and there are no capabilities.
        let extra = unsafe { UserExtensions::new(list(instance), list(device), None, &[]) };
        let desc =
            ContextDesc { vulkan_library: vulkan().flatten(), user_extensions: extra, ..Default::default() };
        let error = Context::new(&desc).map(drop).unwrap_err();
        assert_eq!(matches!(error, Error::Unsupported { .. }), instance, "{error}");
        assert_eq!(matches!(error, Error::NoDevice { .. }), device, "{error}");
        assert!(error.to_string().contains("VK_LVK_nowhere"), "{error}");
    }
}

#[test]
fn an_unknown_name_of_a_profile_is_an_error_with_the_known_ones() {
    match DeviceProfile::named("Mali-G715") {
        Err(Error::InvalidUsage { object, message }) => {
            assert!(object.contains("'Mali-G715'"), "{object}");
            assert!(DeviceProfile::names().all(|name| message.contains(name)), "{message}");
        }
        other => unreachable!("{other:?}"),
    }
}
