//! Traces the primary rays of a picture, and a shadow ray from where each hit: by pipeline or by query.

use bytemuck::{NoUninit, Pod, Zeroable};
use glam::Vec3;
use lvk::{
    BufferDesc, BufferHandle, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context,
    Dependencies, HitGroup, Holder, RayTracingPipelineDesc, RayTracingPipelineHandle, ShaderModuleDesc,
    ShaderModuleHandle, ShaderSource,
};

use super::mesh::Mesh;
use super::pipelines::{SAMPLE, query_stage, stages};
use lvk_samples::hybrid::RayPath;
use lvk_samples::pipelines::SampleStage;
use lvk_samples::shaders::bench as texts;

/// Side of a work group in pixels (`shaders/bench/rays.comp.glsl`).
const GROUP: u32 = 8;

/// Which rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rays {
    /// From the camera, one a pixel.
    Primary,
    /// From where those hit to the light.
    Shadow,
}

impl Rays {
    /// In the order they must be traced.
    pub(super) const BOTH: [Self; 2] = [Self::Primary, Self::Shadow];

    /// For tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary rays",
            Self::Shadow => "shadow rays",
        }
    }
}

/// What a primary ray hit (`Hit` in `shaders/bench/view.glsl`).
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct Hit {
    /// Distance from the eye; negative where the ray left the scene.
    pub(super) t: f32,
    /// Place in the list of triangles.
    pub(super) primitive: u32,
}

/// The push constants (`shaders/bench/view.glsl`).
#[repr(C)]
#[derive(Debug, Clone, Copy, NoUninit)]
pub(super) struct View {
    hits: u64,
    lit: u64,
    tlas: u32,
    size: [u32; 2],
    eye: [f32; 3],
    right: [f32; 3],
    down: [f32; 3],
    forward: [f32; 3],
    light: [f32; 3],
}

/// Results of a picture, and the push constants that name them.
pub(super) struct Picture {
    ctx: Context,
    hits: Holder<BufferHandle>,
    lit: Holder<BufferHandle>,
    pub(super) size: [u32; 2],
    pub(super) view: View,
}

/// Pipelines of one path.
pub(super) struct Tracer {
    pipelines: Pipelines,
}

enum Pipelines {
    Tracing(Holder<RayTracingPipelineHandle>),
    Compute { primary: Holder<ComputePipelineHandle>, shadow: Holder<ComputePipelineHandle> },
}

impl Picture {
    /// A picture of `size` pixels by the mesh's camera. `tlas` is the number of the structure in shaders.
    pub(super) fn new(ctx: &Context, mesh: &Mesh, size: [u32; 2], tlas: u32) -> lvk::Result<Self> {
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let buffer = |size_bytes, debug_name| {
            ctx.create_buffer(&BufferDesc { size_bytes, debug_name, ..BufferDesc::default() })
        };
        let hits = buffer(pixels * size_of::<Hit>() as u64, "hits")?;
        let lit = buffer(pixels * size_of::<u32>() as u64, "lit pixels")?;
        let addresses = [ctx.buffer_address(*hits)?, ctx.buffer_address(*lit)?];
        let view = View::new(mesh, addresses, size, tlas);
        Ok(Self { ctx: ctx.clone(), hits, lit, size, view })
    }

    /// What the primary rays hit. Waits.
    pub(super) fn hits(&self) -> lvk::Result<Vec<Hit>> {
        let mut hits = vec![Hit::zeroed(); (self.size[0] * self.size[1]) as usize];
        self.ctx.download_buffer(*self.hits, 0, bytemuck::cast_slice_mut(&mut hits))?;
        Ok(hits)
    }

    /// For each pixel, 1 where its shadow ray reached the light, else 0. Waits.
    pub(super) fn lit(&self) -> lvk::Result<Vec<u32>> {
        let mut lit = vec![0; (self.size[0] * self.size[1]) as usize];
        self.ctx.download_buffer(*self.lit, 0, bytemuck::cast_slice_mut(&mut lit))?;
        Ok(lit)
    }

    /// How many rays it takes. Waits; shadow rays are known once the primary ones are traced.
    pub(super) fn ray_count(&self, rays: Rays) -> lvk::Result<usize> {
        let hits = self.hits()?;
        Ok(match rays {
            Rays::Primary => hits.len(),
            Rays::Shadow => hits.iter().filter(|hit| hit.t >= 0.0).count(),
        })
    }

    /// Number of pixels in which two pictures show different distances (by more than 1e-5 of them), triangles or light.
    pub(super) fn differing(&self, other: &Self) -> lvk::Result<usize> {
        let (hits, others) = (self.hits()?, other.hits()?);
        let (lit, other_lit) = (self.lit()?, other.lit()?);
        let same = |(a, b): (&Hit, &Hit)| a.primitive == b.primitive && (a.t - b.t).abs() <= 1e-5 * a.t.abs();
        let pixels = hits.iter().zip(&others).zip(lit.iter().zip(&other_lit));
        Ok(pixels.filter(|(hits, (a, b))| a != b || !same(*hits)).count())
    }
}

impl View {
    fn new(mesh: &Mesh, [hits, lit]: [u64; 2], size: [u32; 2], tlas: u32) -> Self {
        let [right, up, forward] = mesh.camera.frame().map(Vec3::from);
        let half_height = (0.5 * mesh.camera.vertical_fov_degrees.to_radians()).tan();
        let half_width = half_height * size[0] as f32 / size[1] as f32;
        Self {
            hits,
            lit,
            tlas,
            size,
            eye: mesh.camera.eye,
            right: (right * half_width).to_array(),
            down: (-up * half_height).to_array(),
            forward: forward.to_array(),
            light: mesh.light,
        }
    }
}

impl Tracer {
    pub(super) fn new(ctx: &Context, path: RayPath) -> lvk::Result<Self> {
        let pipelines = match path {
            RayPath::Pipeline => {
                let modules: lvk::Result<Vec<_>> =
                    stages(&[]).iter().map(|stage| stage.create(ctx, SAMPLE)).collect();
                Pipelines::Tracing(tracing_pipeline(ctx, &modules?)?)
            }
            RayPath::Query => Pipelines::Compute {
                primary: compute_pipeline(ctx, &[])?,
                shadow: compute_pipeline(ctx, texts::SHADOW_RAYS)?,
            },
        };
        Ok(Self { pipelines })
    }

    /// A tracer by pipeline of words that were compiled before, one for each of [`stages`].
    pub(super) fn of_words(
        ctx: &Context,
        stages: &[SampleStage; 5],
        words: &[Vec<u32>],
    ) -> lvk::Result<Self> {
        let module = |(stage, words): (&SampleStage, &Vec<u32>)| {
            let source = ShaderSource::Spirv(words);
            ctx.create_shader_module(&ShaderModuleDesc { source, ..stage.module() })
        };
        let modules: lvk::Result<Vec<_>> = stages.iter().zip(words).map(module).collect();
        Ok(Self { pipelines: Pipelines::Tracing(tracing_pipeline(ctx, &modules?)?) })
    }

    /// Records a trace of the picture. Shadow rays need the primary ones before them, in any submission.
    pub(super) fn record(&self, cmd: &mut CommandBuffer, picture: &Picture, rays: Rays) -> lvk::Result<()> {
        let [width, height] = picture.size;
        let writes = [*picture.hits, *picture.lit];
        let dependencies = match rays {
            Rays::Primary => Dependencies { buffers: &writes[..1], ..Dependencies::default() },
            Rays::Shadow => {
                Dependencies { read_buffers: &writes[..1], buffers: &writes[1..], ..Dependencies::default() }
            }
        };
        match &self.pipelines {
            Pipelines::Tracing(pipeline) => {
                cmd.bind_ray_tracing_pipeline(**pipeline)?;
                cmd.push_constants(&picture.view)?;
                cmd.trace_rays_with(rays as u32, [width, height, 1], &dependencies)
            }
            Pipelines::Compute { primary, shadow } => {
                cmd.bind_compute_pipeline(if rays == Rays::Primary { **primary } else { **shadow })?;
                cmd.push_constants(&picture.view)?;
                cmd.dispatch([width.div_ceil(GROUP), height.div_ceil(GROUP), 1], &dependencies)
            }
        }
    }
}

/// A pipeline of modules in the order of [`stages`].
fn tracing_pipeline(
    ctx: &Context,
    modules: &[Holder<ShaderModuleHandle>],
) -> lvk::Result<Holder<RayTracingPipelineHandle>> {
    let of = |places: std::ops::Range<usize>| -> Vec<ShaderModuleHandle> {
        modules[places].iter().map(Holder::handle).collect()
    };
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &of(0..2),
        miss: &of(2..4),
        hit_groups: &[HitGroup { closest_hit: Some(modules[4].handle()), ..HitGroup::default() }],
        debug_name: "bench rays",
        ..RayTracingPipelineDesc::default()
    })
}

fn compute_pipeline(
    ctx: &Context,
    defines: &'static [(&'static str, &'static str)],
) -> lvk::Result<Holder<ComputePipelineHandle>> {
    let module = query_stage(defines).create(ctx, SAMPLE)?;
    let module = Some(*module);
    ctx.create_compute_pipeline(&ComputePipelineDesc {
        module,
        debug_name: "bench rays",
        ..Default::default()
    })
}
