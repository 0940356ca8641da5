//! SPIR-V that other compilers made of Slang and HLSL: it runs, and computes the same as GLSL.
//!
//! The sources and their SPIR-V lie in `tests/shaders/other_languages`, with the script that compiles them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use bytemuck::NoUninit;
use lvk::glam::Vec3;
use lvk::{
    BufferDesc, ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, DeviceProfile, Error,
    Format, GeometryFlags, HLSL_HEADER, HitGroup, Holder, RayQueryRequest, Result, SamplerDesc,
    ShaderModuleDesc, ShaderModuleHandle, ShaderSource, ShaderStage, TextureDesc, TextureHandle,
    TextureRegion, TextureUsage,
};
use lvk_tests::compute::compute_pipeline;
use lvk_tests::pipeline_paths::lowered_devices;
use lvk_tests::ray_scene::RayScene;
use lvk_tests::ray_tracer::{
    CULL_BACK, How, MISSED, Method, NO_OPAQUE, OPAQUE, RayTracer, requires_ray_queries,
};
use lvk_tests::rays::random_rays;
use lvk_tests::{TestDevice, device, device_with};

/// A module of another compiler.
struct Foreign {
    name: &'static str,
    bytes: &'static [u8],
}

/// Returns the module of a file of the folder, without `.spv`.
macro_rules! foreign {
    ($name:literal) => {
        Foreign {
            name: $name,
            bytes: include_bytes!(concat!("../../shaders/other_languages/", $name, ".spv")),
        }
    };
}

/// Blend shaders with the format of the storage image. Slang's image has no format in the shader, DXC's has this one.
const BLEND: [(Foreign, Format); 2] =
    [(foreign!("blend.slang"), Format::Rgba8Unorm), (foreign!("blend.hlsl"), Format::Rgba32Float)];

const QUERY: [Foreign; 2] = [foreign!("query.slang"), foreign!("query.hlsl")];

/// Ray generation, miss and closest hit.
const PIPELINES: [[Foreign; 3]; 2] = [
    [foreign!("pipeline.rgen.slang"), foreign!("pipeline.rmiss.slang"), foreign!("pipeline.rchit.slang")],
    [foreign!("pipeline.rgen.hlsl"), foreign!("pipeline.rmiss.hlsl"), foreign!("pipeline.rchit.hlsl")],
];

/// A fragment shader that uses every name of `lvk.hlsli`.
const HELPERS: [Foreign; 2] = [foreign!("helpers.slang"), foreign!("helpers.hlsl")];

impl Foreign {
    fn module(&self, ctx: &Context, stage: ShaderStage) -> Result<Holder<ShaderModuleHandle>> {
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(self.bytes);
        let source = ShaderSource::Spirv(&words);
        ctx.create_shader_module(&ShaderModuleDesc {
            stage,
            source,
            debug_name: self.name,
            ..Default::default()
        })
    }

    fn pipeline(&self, ctx: &Context) -> Result<Holder<ComputePipelineHandle>> {
        let module = self.module(ctx, ShaderStage::Compute)?;
        let desc = ComputePipelineDesc { module: Some(*module), debug_name: self.name, ..Default::default() };
        ctx.create_compute_pipeline(&desc)
    }
}

/// Returns a tracer of a ray generation, a miss and a closest-hit shader.
fn ray_tracer(ctx: &Context, [ray_gen, miss, closest_hit]: &[Foreign; 3]) -> Result<RayTracer> {
    let ray_gen = ray_gen.module(ctx, ShaderStage::RayGen)?;
    let miss = miss.module(ctx, ShaderStage::Miss)?;
    let closest_hit = closest_hit.module(ctx, ShaderStage::ClosestHit)?;
    let group = HitGroup { closest_hit: Some(*closest_hit), ..Default::default() };
    RayTracer::from_groups(ctx, *ray_gen, *miss, &[group])
}

/// Width and height of the stored image; not a multiple of a workgroup.
const SIZE: [u32; 2] = [21, 13];

/// Index of no texture.
const NO_TEXTURE: u32 = 77;

/// Push constants of `blend`.
#[repr(C)]
#[derive(Clone, Copy, NoUninit)]
struct BlendPush {
    colors: u64,
    tex: u32,
    smp: u32,
    image: u32,
    size: [u32; 2],
    end: u32,
}

/// Objects that `blend` reads. Each has a neighbour of a smaller index, so that an index of 0 is wrong.
struct BlendInputs {
    textures: [Holder<TextureHandle>; 2],
    samplers: [Holder<lvk::SamplerHandle>; 2],
    colors: Holder<lvk::BufferHandle>,
}

impl BlendInputs {
    fn new(ctx: &Context) -> Result<Self> {
        let texture = |seed: u8| {
            let data: Vec<u8> = (0..5 * 3 * 4).map(|byte: u8| byte.wrapping_mul(37) ^ seed).collect();
            let (extent, data) = ([5, 3], Some(data.as_slice()));
            ctx.create_texture(&TextureDesc {
                extent,
                data,
                format: Format::Rgba8Unorm,
                ..Default::default()
            })
        };
        let sampler = || ctx.create_sampler(&SamplerDesc::default());
        let colors: Vec<f32> = (0..SIZE[0] * 4).map(|index| (index % 17) as f32 / 16.0).collect();
        let colors = BufferDesc { data: Some(bytemuck::cast_slice(&colors)), ..Default::default() };
        Ok(Self {
            textures: [texture(0)?, texture(0xff)?],
            samplers: [sampler()?, sampler()?],
            colors: ctx.create_buffer(&colors)?,
        })
    }

    /// Returns the bytes of the image that a pipeline stores.
    fn blend(&self, ctx: &Context, pipeline: ComputePipelineHandle, format: Format) -> Result<Vec<u8>> {
        self.blend_of(self.textures[1].index(), ctx, pipeline, format)
    }

    /// As [`blend`](Self::blend), of the texture with any index.
    fn blend_of(
        &self,
        tex: u32,
        ctx: &Context,
        pipeline: ComputePipelineHandle,
        format: Format,
    ) -> Result<Vec<u8>> {
        let usage = TextureUsage::STORAGE | TextureUsage::SAMPLED;
        let image = ctx.create_texture(&TextureDesc { extent: SIZE, format, usage, ..Default::default() })?;
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.bind_compute_pipeline(pipeline)?;
        cmd.push_constants(&BlendPush {
            colors: ctx.buffer_address(*self.colors)?,
            tex,
            smp: self.samplers[1].index(),
            image: image.index(),
            size: SIZE,
            end: 0,
        })?;
        let dependencies = Dependencies {
            buffers: &[*self.colors],
            sampled_images: &[*self.textures[1]],
            storage_images: &[*image],
            ..Default::default()
        };
        cmd.dispatch([SIZE[0].div_ceil(8), SIZE[1].div_ceil(8), 1], &dependencies)?;
        ctx.submit(cmd)?;
        ctx.download_texture(*image, &TextureRegion::default())
    }
}

#[test]
fn textures_buffers_and_storage_images_are_those_of_glsl() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let inputs = BlendInputs::new(&ctx)?;
    let glsl = compute_pipeline(&ctx, include_str!("../../shaders/other_languages/blend.comp.glsl"));
    for (foreign, format) in &BLEND {
        let expected = inputs.blend(&ctx, *glsl, *format)?;
        assert!(expected.iter().any(|byte| *byte != 0), "{}", foreign.name);
        let found = inputs.blend(&ctx, *foreign.pipeline(&ctx)?, *format)?;
        assert!(found == expected, "{}", foreign.name);
    }
    Ok(())
}

/// Wrong indices are found in SPIR-V of other compilers too.
#[test]
fn indices_are_checked() -> Result<()> {
    for (foreign, format) in &BLEND {
        let Some(ctx) = device_with(|desc| desc.check_indices = true) else { return Ok(()) };
        let inputs = BlendInputs::new(&ctx)?;
        let glsl = compute_pipeline(&ctx, include_str!("../../shaders/other_languages/blend.comp.glsl"));
        let pipeline = foreign.pipeline(&ctx)?;
        let expected = inputs.blend(&ctx, *glsl, *format)?;
        assert!(inputs.blend(&ctx, *pipeline, *format)? == expected, "{}", foreign.name);
        assert!(ctx.index_faults()?.is_empty(), "{}", foreign.name);
        inputs.blend_of(NO_TEXTURE, &ctx, *pipeline, *format)?;
        let faults = ctx.index_faults()?;
        let found: Vec<_> = faults.iter().map(|fault| (fault.shader.as_str(), fault.index)).collect();
        assert_eq!(found, [(foreign.name, NO_TEXTURE)]);
    }
    Ok(())
}

/// The validation layer takes the code of each name of the header, with and without index checks.
#[test]
fn every_name_of_the_header_makes_valid_code() -> Result<()> {
    let text = include_str!("../../shaders/other_languages/helpers.hlsl");
    let words = HLSL_HEADER.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    let starts = ["textureBindless", "lvkMap", "kTextures", "kSamplers", "kImages", "kTLAS", "LVK_"];
    let names: BTreeSet<_> =
        words.filter(|word| starts.iter().any(|start| word.starts_with(start))).collect();
    let unused: Vec<_> = names.iter().filter(|name| !text.contains(**name)).collect();
    assert!(names.len() > 25 && unused == [&"LVK_HLSLI", &"LVK_INPUT_AT"], "{unused:?} of {names:?}");
    for check_indices in [false, true] {
        let Some(ctx) = device_with(|desc| desc.check_indices = check_indices) else { return Ok(()) };
        if requires_ray_queries(&ctx) {
            for foreign in &HELPERS {
                drop(foreign.module(&ctx, ShaderStage::Fragment)?);
            }
        }
    }
    Ok(())
}

/// Returns devices with these ray queries: one as it is, and one whose meshes are split, so that ids of hits go through
/// the hit remap table.
fn whole_and_split(ray_query: RayQueryRequest) -> Vec<TestDevice> {
    let split = DeviceProfile { max_blas_primitives: 40, ..DeviceProfile::default() };
    let whole = device_with(|desc| desc.ray_query = ray_query);
    let split = device_with(|desc| {
        desc.ray_query = ray_query;
        desc.profile = Some(&split);
    });
    whole.into_iter().chain(split).collect()
}

/// Both tracers find the same hits, among instances that overlap.
fn assert_same_hits(ctx: &Context, tracer: &RayTracer, glsl: &RayTracer, name: &str) -> Result<()> {
    let scene = RayScene::scattered(GeometryFlags::OPAQUE).upload(ctx)?;
    let rays = random_rays(25, 500, Vec3::splat(-4.0), Vec3::splat(4.0));
    for flags in [0, OPAQUE, NO_OPAQUE, CULL_BACK] {
        let how = How { flags, ..How::default() };
        let expected = glsl.trace(&scene.tlas, &rays, how)?;
        let hits = expected.iter().filter(|record| record.kind != MISSED).count();
        assert!(hits > 50, "{hits} hits");
        assert!(tracer.trace(&scene.tlas, &rays, how)? == expected, "{name}, flags {flags}");
    }
    Ok(())
}

#[test]
fn ray_queries_hit_what_those_of_glsl_hit() -> Result<()> {
    for ctx in whole_and_split(RayQueryRequest::HardwareIfPresent) {
        if !requires_ray_queries(&ctx) {
            continue;
        }
        let glsl = RayTracer::new(&ctx, Method::Query)?;
        for foreign in &QUERY {
            let tracer = RayTracer::from_query(&ctx, foreign.pipeline(&ctx)?);
            assert_same_hits(&ctx, &tracer, &glsl, foreign.name)?;
        }
    }
    Ok(())
}

/// Devices without ray queries trace too: DXC declares the capability of queries in every ray generation shader.
#[test]
fn ray_tracing_pipelines_hit_what_those_of_glsl_hit() -> Result<()> {
    let own =
        [RayQueryRequest::HardwareIfPresent, RayQueryRequest::Off].into_iter().flat_map(whole_and_split);
    let lowered = lowered_devices().into_iter().map(|(_, ctx)| ctx);
    for ctx in own.chain(lowered) {
        if !Method::available(&ctx).contains(&Method::Pipeline) {
            continue;
        }
        let glsl = RayTracer::new(&ctx, Method::Pipeline)?;
        for shaders in &PIPELINES {
            assert_same_hits(&ctx, &ray_tracer(&ctx, shaders)?, &glsl, shaders[0].name)?;
        }
    }
    Ok(())
}

/// The library's own traversal is GLSL: other languages query by the device, or not at all.
#[test]
fn queries_of_the_device_are_refused_where_the_library_traverses() {
    let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Software) else { return };
    for foreign in &QUERY {
        let error = foreign.pipeline(&ctx).map(drop).unwrap_err();
        assert!(matches!(error, Error::InvalidUsage { .. }), "{error}");
        let text = error.to_string();
        assert!(text.contains(foreign.name) && text.contains("ray queries"), "{text}");
    }
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders/other_languages")
}

/// Needs the Python packages of `compile.sh`: `cargo test --test shaders other_languages -- --ignored`. With
/// `LVK_UPDATE_KERNELS=1` the script's output replaces the words.
#[test]
#[ignore = "fetches compilers of Slang and HLSL"]
fn the_words_are_those_of_the_sources() {
    let out = tempfile::tempdir().unwrap();
    let run = Command::new("bash").arg(folder().join("compile.sh")).arg(out.path()).status().unwrap();
    assert!(run.success());
    let blend = BLEND.iter().map(|(foreign, _)| foreign);
    for foreign in blend.chain(&QUERY).chain(&HELPERS).chain(PIPELINES.iter().flatten()) {
        let file = format!("{}.spv", foreign.name);
        let compiled = std::fs::read(out.path().join(&file)).unwrap();
        if std::env::var_os("LVK_UPDATE_KERNELS").is_some() {
            std::fs::write(folder().join(&file), compiled).unwrap();
        } else {
            assert!(compiled == foreign.bytes, "{file}: set LVK_UPDATE_KERNELS=1 once");
        }
    }
}
