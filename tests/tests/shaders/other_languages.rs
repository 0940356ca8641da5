//! SPIR-V that other compilers made of Slang and HLSL: it runs, and computes the same as GLSL.
//!
//! The sources and their SPIR-V lie in `tests/shaders/other_languages`, with the script that compiles them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};
use std::process::Command;

use bytemuck::NoUninit;
use lvk::glam::Vec3;
use lvk::{
    BufferDesc, ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, DeviceProfile, Format,
    GeometryFlags, Holder, RayQueryRequest, Result, SamplerDesc, ShaderModuleDesc, ShaderSource, ShaderStage,
    TextureDesc, TextureHandle, TextureRegion, TextureUsage,
};
use lvk_tests::compute::compute_pipeline;
use lvk_tests::ray_scene::RayScene;
use lvk_tests::ray_tracer::{How, MISSED, Method, NO_OPAQUE, OPAQUE, RayTracer};
use lvk_tests::rays::random_rays;
use lvk_tests::{device, device_with};

/// A module of another compiler.
struct Foreign {
    name: &'static str,
    bytes: &'static [u8],
    /// Format of the storage image in `blend`. Slang's image has no format in the shader, DXC's has this one.
    image: Format,
}

const BLEND: [Foreign; 2] = [
    Foreign {
        name: "blend.slang",
        bytes: include_bytes!("../../shaders/other_languages/blend.slang.spv"),
        image: Format::Rgba8Unorm,
    },
    Foreign {
        name: "blend.hlsl",
        bytes: include_bytes!("../../shaders/other_languages/blend.hlsl.spv"),
        image: Format::Rgba32Float,
    },
];

const QUERY: [Foreign; 2] = [
    Foreign {
        name: "query.slang",
        bytes: include_bytes!("../../shaders/other_languages/query.slang.spv"),
        image: Format::Rgba8Unorm,
    },
    Foreign {
        name: "query.hlsl",
        bytes: include_bytes!("../../shaders/other_languages/query.hlsl.spv"),
        image: Format::Rgba8Unorm,
    },
];

impl Foreign {
    fn words(&self) -> Vec<u32> {
        bytemuck::pod_collect_to_vec(self.bytes)
    }

    fn pipeline(&self, ctx: &Context) -> Result<Holder<ComputePipelineHandle>> {
        let module = ctx.create_shader_module(&ShaderModuleDesc {
            stage: ShaderStage::Compute,
            source: ShaderSource::Spirv(&self.words()),
            debug_name: self.name,
            ..Default::default()
        })?;
        let desc = ComputePipelineDesc { module: Some(*module), debug_name: self.name, ..Default::default() };
        ctx.create_compute_pipeline(&desc)
    }
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
    for foreign in &BLEND {
        let expected = inputs.blend(&ctx, *glsl, foreign.image)?;
        assert!(expected.iter().any(|byte| *byte != 0), "{}", foreign.name);
        let found = inputs.blend(&ctx, *foreign.pipeline(&ctx)?, foreign.image)?;
        assert!(found == expected, "{}", foreign.name);
    }
    Ok(())
}

/// Wrong indices are found in SPIR-V of other compilers too.
#[test]
fn indices_are_checked() -> Result<()> {
    for foreign in &BLEND {
        let Some(ctx) = device_with(|desc| desc.check_indices = true) else { return Ok(()) };
        let inputs = BlendInputs::new(&ctx)?;
        let glsl = compute_pipeline(&ctx, include_str!("../../shaders/other_languages/blend.comp.glsl"));
        let pipeline = foreign.pipeline(&ctx)?;
        let expected = inputs.blend(&ctx, *glsl, foreign.image)?;
        assert!(inputs.blend(&ctx, *pipeline, foreign.image)? == expected, "{}", foreign.name);
        assert!(ctx.index_faults()?.is_empty(), "{}", foreign.name);
        inputs.blend_of(NO_TEXTURE, &ctx, *pipeline, foreign.image)?;
        let faults = ctx.index_faults()?;
        let found: Vec<_> = faults.iter().map(|fault| (fault.shader.as_str(), fault.index)).collect();
        assert_eq!(found, [(foreign.name, NO_TEXTURE)]);
    }
    Ok(())
}

/// Rays through many instances; with a profile whose meshes are split, ids of hits go through the hit remap table.
#[test]
fn ray_queries_hit_what_those_of_glsl_hit() -> Result<()> {
    let split = DeviceProfile { max_blas_primitives: 40, ..DeviceProfile::default() };
    let whole = device_with(|desc| desc.ray_query = RayQueryRequest::HardwareIfPresent);
    let split = device_with(|desc| {
        desc.ray_query = RayQueryRequest::HardwareIfPresent;
        desc.profile = Some(&split);
    });
    for ctx in [whole, split].into_iter().flatten() {
        if !ctx.capabilities().ray_query {
            eprintln!("NOT TESTED, {} has no ray queries", ctx.capabilities().device_name);
            continue;
        }
        let scene = RayScene::scattered(GeometryFlags::OPAQUE).upload(&ctx)?;
        let rays = random_rays(25, 500, Vec3::splat(-4.0), Vec3::splat(4.0));
        let glsl = RayTracer::new(&ctx, Method::Query)?;
        for foreign in &QUERY {
            let tracer = RayTracer::from_query(&ctx, foreign.pipeline(&ctx)?);
            for flags in [0, OPAQUE, NO_OPAQUE] {
                let how = How { flags, ..How::default() };
                let expected = glsl.trace(&scene.tlas, &rays, how)?;
                let hits = expected.iter().filter(|record| record.kind != MISSED).count();
                assert!(hits > 50, "{hits} hits");
                assert!(tracer.trace(&scene.tlas, &rays, how)? == expected, "{} {flags}", foreign.name);
            }
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
    for foreign in BLEND.iter().chain(&QUERY) {
        let file = format!("{}.spv", foreign.name);
        let compiled = std::fs::read(out.path().join(&file)).unwrap();
        if std::env::var_os("LVK_UPDATE_KERNELS").is_some() {
            std::fs::write(folder().join(&file), compiled).unwrap();
        } else {
            assert!(compiled == foreign.bytes, "{file}: set LVK_UPDATE_KERNELS=1 once");
        }
    }
}
