//! Shaders that use a device feature: they work where the device has it, and are refused with the feature's name
//! where it has not.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::ash::vk;
use lvk::{
    ColorAttachment, ComputePipelineDesc, Context, Dependencies, Error, Format, Holder, RenderPassDesc,
    RenderPipelineDesc, ShaderModuleDesc, ShaderModuleHandle, ShaderSource, ShaderStage,
};
use lvk_tests::compute::{module, read_words, words_buffer};
use lvk_tests::device;
use lvk_tests::raster::{pixels, target};
use lvk_tests::subprocess::on_swiftshader;

/// A device feature by name, and whether it was found.
type Feature = (&'static str, fn(&SupportedFeatures) -> vk::Bool32);

/// Features of the device.
#[derive(Default)]
struct SupportedFeatures {
    core: vk::PhysicalDeviceFeatures,
    v11: vk::PhysicalDeviceVulkan11Features<'static>,
    v12: vk::PhysicalDeviceVulkan12Features<'static>,
    float_atomics: vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT<'static>,
    subgroups: vk::PhysicalDeviceVulkan11Properties<'static>,
}

impl SupportedFeatures {
    fn query(ctx: &Context) -> Self {
        let mut found = Self::default();
        let (instance, device) = (ctx.raw_instance(), ctx.raw_physical_device());
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut found.subgroups);
        let mut all =
            vk::PhysicalDeviceFeatures2::default().push_next(&mut found.v11).push_next(&mut found.v12);
        let float_atomics = lvk::ash::ext::shader_atomic_float::NAME;
        // SAFETY: the device belongs to the instance; the chains live until the calls return.
        unsafe {
            let extensions = instance.enumerate_device_extension_properties(device).unwrap();
            if extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(float_atomics)) {
                all = all.push_next(&mut found.float_atomics);
            }
            instance.get_physical_device_properties2(device, &mut properties);
            instance.get_physical_device_features2(device, &mut all);
        }
        found.core = all.features;
        found
    }
}

/// Returns those of `features` that the device lacks.
fn missing(found: &SupportedFeatures, features: &[Feature]) -> Vec<&'static str> {
    features.iter().filter(|(_, is_on)| is_on(found) == vk::FALSE).map(|(name, _)| *name).collect()
}

/// A compute shader that turns the zero in `result.at` into `expected`.
struct Use {
    needs: &'static [Feature],
    body: &'static str,
    expected: u32,
}

const INT8: Feature = ("shaderInt8", |f| f.v12.shader_int8);
const INT16: Feature = ("shaderInt16", |f| f.core.shader_int16);
const INT64: Feature = ("shaderInt64", |f| f.core.shader_int64);

const USES: [Use; 12] = [
    Use {
        needs: &[INT64],
        body: "uint64_t big = uint64_t(result.at + 3u) << 40; result.at = uint(big >> 40);",
        expected: 3,
    },
    Use {
        needs: &[("shaderFloat64", |f| f.core.shader_float64)],
        body: "result.at = uint(double(result.at) + 16777217.0lf);",
        expected: 16_777_217,
    },
    Use {
        needs: &[("shaderFloat16", |f| f.v12.shader_float16)],
        body: "result.at = uint(float16_t(result.at) + float16_t(1024.0));",
        expected: 1024,
    },
    Use { needs: &[INT8], body: "result.at = uint(uint8_t(result.at + 255u) + uint8_t(2));", expected: 1 },
    Use {
        needs: &[INT16],
        body: "result.at = uint(uint16_t(result.at + 65535u) + uint16_t(2));",
        expected: 1,
    },
    Use {
        needs: &[INT8, ("storageBuffer8BitAccess", |f| f.v12.storage_buffer8_bit_access)],
        body: "Bytes(result).at[1] = uint8_t(1);",
        expected: 0x100,
    },
    Use {
        needs: &[INT16, ("storageBuffer16BitAccess", |f| f.v11.storage_buffer16_bit_access)],
        body: "Halves(result).at[1] = uint16_t(1);",
        expected: 0x1_0000,
    },
    Use {
        needs: &[INT64, ("shaderBufferInt64Atomics", |f| f.v12.shader_buffer_int64_atomics)],
        body: "atomicAdd(Long(result).at, 7ul);",
        expected: 7,
    },
    Use {
        needs: &[INT64, ("shaderSharedInt64Atomics", |f| f.v12.shader_shared_int64_atomics)],
        body: "sharedLong = 0ul; barrier(); atomicAdd(sharedLong, 7ul); barrier(); result.at = uint(sharedLong);",
        expected: 7,
    },
    Use {
        needs: &[("shaderBufferFloat32AtomicAdd", |f| f.float_atomics.shader_buffer_float32_atomic_add)],
        body: "atomicAdd(Float(result).at, 1.0);",
        expected: 0x3F80_0000,
    },
    Use {
        needs: &[("shaderBufferFloat32Atomics", |f| f.float_atomics.shader_buffer_float32_atomics)],
        body: "atomicExchange(Float(result).at, 1.0);",
        expected: 0x3F80_0000,
    },
    Use {
        needs: &[("ARITHMETIC", |f| {
            let operations = f.subgroups.subgroup_supported_operations;
            operations.contains(vk::SubgroupFeatureFlags::ARITHMETIC).into()
        })],
        body: "result.at = subgroupAdd(result.at + 5u);",
        expected: 5,
    },
];

fn create(
    ctx: &Context,
    stage: ShaderStage,
    source: ShaderSource<'_>,
) -> lvk::Result<Holder<ShaderModuleHandle>> {
    let desc = ShaderModuleDesc { stage, source, debug_name: "feature user", ..Default::default() };
    ctx.create_shader_module(&desc)
}

/// The words of the refusal; anything else fails the test.
fn unsupported<T: std::fmt::Debug>(result: lvk::Result<T>) -> String {
    match result {
        Err(error @ Error::Unsupported { .. }) => {
            let text = error.to_string();
            assert!(text.contains("'feature user'"), "{text}");
            text
        }
        other => unreachable!("{other:?}"),
    }
}

/// The module, or nothing where the device lacks one of `needs`, which the refusal must name.
fn created(
    ctx: &Context,
    stage: ShaderStage,
    text: &str,
    needs: &[Feature],
) -> Option<Holder<ShaderModuleHandle>> {
    let module = create(ctx, stage, ShaderSource::Glsl(text));
    let missing = missing(&SupportedFeatures::query(ctx), needs);
    if missing.is_empty() {
        return Some(module.unwrap());
    }
    let why = unsupported(module);
    assert!(missing.iter().any(|feature| why.contains(feature)), "{missing:?}: {why}");
    None
}

fn expect_use(ctx: &Context, shader: &Use) {
    let text = format!(
        "layout(local_size_x = 1) in;
         layout(buffer_reference, scalar) buffer Result {{ uint at; }};
         layout(buffer_reference, scalar) buffer Bytes {{ uint8_t at[]; }};
         layout(buffer_reference, scalar) buffer Halves {{ uint16_t at[]; }};
         layout(buffer_reference, scalar) buffer Float {{ float at; }};
         {}
         layout(push_constant, scalar) uniform Push {{ Result result; }};
         void main() {{ {} }}",
        if shader.needs[0].0 == INT64.0 {
            "layout(buffer_reference, scalar) buffer Long { uint64_t at; }; shared uint64_t sharedLong;"
        } else {
            ""
        },
        shader.body
    );
    let Some(module) = created(ctx, ShaderStage::Compute, &text, shader.needs) else { return };
    let pipeline = ComputePipelineDesc { module: Some(*module), ..Default::default() };
    let pipeline = ctx.create_compute_pipeline(&pipeline).unwrap();
    let result = words_buffer(ctx, &[0, 0]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.push_constants(&ctx.buffer_address(*result).unwrap()).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*result], ..Default::default() }).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(read_words(ctx, *result, 1), [shader.expected], "{}", shader.body);
}

/// Covers the target with the number of the first instance.
const BASE_INSTANCE: &str = "
    layout(location = 0) out float number;
    void main() {
        gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0.0, 1.0);
        number = float(gl_BaseInstance);
    }";

fn expect_draw_parameters(ctx: &Context) {
    let needs: [Feature; 1] = [("shaderDrawParameters", |f| f.v11.shader_draw_parameters)];
    let Some(vertex) = created(ctx, ShaderStage::Vertex, BASE_INSTANCE, &needs) else { return };
    let text = "layout(location = 0) in float number; layout(location = 0) out vec4 result;
                void main() { if (gl_FragCoord.x > 1.0) discard; result = vec4(number / 255.0); }";
    let fragment = module(ctx, ShaderStage::Fragment, text);
    let color = [Format::Rgba8Unorm.into()];
    let desc = RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*fragment),
        color: &color,
        ..Default::default()
    };
    let pipeline = ctx.create_render_pipeline(&desc).unwrap();
    let drawn = target(ctx, Format::Rgba8Unorm, [2, 1]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
    pass.bind_render_pipeline(*pipeline).unwrap();
    pass.draw(0..3, 7..8).unwrap();
    drop(pass);
    ctx.submit(cmd).unwrap();
    assert_eq!(pixels::<[u8; 4]>(ctx, *drawn), [[7; 4], [0; 4]]);
}

fn expect_all(ctx: &Context) {
    for shader in &USES {
        expect_use(ctx, shader);
    }
    expect_draw_parameters(ctx);
}

#[test]
fn features_work_or_are_refused_by_name() {
    let Some(ctx) = device() else { return };
    expect_all(&ctx);
}

/// SwiftShader lacks several of the features.
#[test]
fn features_that_are_missing_are_refused_by_name() {
    on_swiftshader(features_that_are_missing_are_refused_by_name, || {
        let Some(ctx) = device() else { return };
        let found = SupportedFeatures::query(&ctx);
        let lacks = |shader: &&Use| !missing(&found, shader.needs).is_empty();
        assert!(USES.iter().filter(lacks).count() >= 3, "the device has nearly everything");
        expect_all(&ctx);
    });
}

/// SwiftShader has no mesh shaders.
#[test]
fn mesh_and_task_stages_are_refused_where_there_are_none() {
    on_swiftshader(mesh_and_task_stages_are_refused_where_there_are_none, || {
        let Some(ctx) = device() else { return };
        assert!(!ctx.capabilities().mesh_shader);
        let mesh = "layout(local_size_x = 1) in; layout(triangles, max_vertices = 3, max_primitives = 1) out;
                    void main() { SetMeshOutputsEXT(0u, 0u); }";
        let task = "layout(local_size_x = 1) in; void main() { EmitMeshTasksEXT(1u, 1u, 1u); }";
        for (stage, text) in [(ShaderStage::Mesh, mesh), (ShaderStage::Task, task)] {
            let why = unsupported(create(&ctx, stage, ShaderSource::Glsl(text)));
            assert!(why.contains("meshShader"), "{why}");
        }
    });
}

#[test]
fn capabilities_beyond_the_device_are_refused() {
    const KERNEL: u32 = 6;
    let Some(ctx) = device() else { return };
    let words = |capability: u32| {
        let op = |words: u32, code: u32| words << 16 | code;
        let main = u32::from_le_bytes(*b"main");
        [
            [0x0723_0203, 0x0001_0300, 0, 5, 0].as_slice(),
            &[op(2, 17), 1, op(2, 17), capability, op(3, 14), 0, 1],
            &[op(5, 15), 5, 1, main, 0, op(6, 16), 1, 17, 1, 1, 1],
            &[op(2, 19), 2, op(3, 33), 3, 2, op(5, 54), 2, 1, 0, 3, op(2, 248), 4, op(1, 253), op(1, 56)],
        ]
        .concat()
    };
    let refuse = |capability| {
        let words = words(capability);
        unsupported(create(&ctx, ShaderStage::Compute, ShaderSource::Spirv(&words)))
    };
    assert!(refuse(KERNEL).contains("capability Kernel"));
    assert!(refuse(99_999).contains("capability number 99999"));
    drop(create(&ctx, ShaderStage::Compute, ShaderSource::Spirv(&words(1))).unwrap());
}
