//! Traces the primary rays of an image, and a shadow ray and a bounce ray from each hit, by ray tracing pipeline or by ray query.

use bytemuck::{NoUninit, Pod, Zeroable};
use glam::Vec3;
use lvk::{
    BufferDesc, BufferHandle, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context,
    Dependencies, HitGroup, Holder, RayTracingPipelineDesc, RayTracingPipelineHandle, ShaderModuleDesc,
    ShaderModuleHandle, ShaderSource,
};

use crate::mesh::Mesh;
use crate::pipelines::{SAMPLE, query_stage, stages};
use crate::tree_rays::{Ray, bounce, camera_rays};
use lvk_samples::hybrid::RayPath;
use lvk_samples::pipelines::SampleStage;
use lvk_samples::shaders::bench as texts;

/// Side of a workgroup in pixels (`shaders/bench/rays.comp.glsl`).
const WORKGROUP_SIDE: u32 = 8;

/// Kind of rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RayKind {
    /// One ray per pixel from the camera.
    Primary,
    /// One ray from each hit to the light.
    Shadow,
    /// One ray from each hit in a direction around its surface, as of diffuse light.
    Bounce,
}

impl RayKind {
    /// All kinds, in tracing order.
    pub(super) const ALL: [Self; 3] = [Self::Primary, Self::Shadow, Self::Bounce];
    /// The kinds that need nothing but an image.
    pub(super) const BOTH: [Self; 2] = [Self::Primary, Self::Shadow];

    /// Returns the name for tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary rays",
            Self::Shadow => "shadow rays",
            Self::Bounce => "bounce rays",
        }
    }
}

/// The hit of a primary ray (`Hit` in `shaders/bench/view.glsl`).
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct Hit {
    /// Distance from the eye; negative for a miss.
    pub(super) t: f32,
    /// Index of the triangle.
    pub(super) primitive: u32,
}

/// The push constants (`shaders/bench/view.glsl`).
#[repr(C)]
#[derive(Debug, Clone, Copy, NoUninit)]
pub(super) struct View {
    hits: u64,
    lit: u64,
    bounce_rays: u64,
    bounce_hits: u64,
    tlas: u32,
    size: [u32; 2],
    eye: [f32; 3],
    right: [f32; 3],
    down: [f32; 3],
    forward: [f32; 3],
    light: [f32; 3],
}

/// Result buffers of an image, and the push constants that refer to them.
pub(super) struct TracedImage {
    ctx: Context,
    hits: Holder<BufferHandle>,
    lit: Holder<BufferHandle>,
    bounces: Option<Bounces>,
    pub(super) size: [u32; 2],
    pub(super) view: View,
}

/// Bounce rays and their hits.
struct Bounces {
    rays: Holder<BufferHandle>,
    hits: Holder<BufferHandle>,
}

/// The pipelines of one ray tracing path.
pub(super) struct MeshTracer {
    pipelines: Pipelines,
}

enum Pipelines {
    Tracing(Holder<RayTracingPipelineHandle>),
    /// For each of [`RayKind::ALL`].
    Compute([Holder<ComputePipelineHandle>; 3]),
}

impl TracedImage {
    /// Creates buffers for an image of `size` pixels by the mesh's camera. `tlas` is the TLAS index in shaders.
    pub(super) fn new(ctx: &Context, mesh: &Mesh, size: [u32; 2], tlas: u32) -> lvk::Result<Self> {
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let buffer = |size_bytes, debug_name| {
            ctx.create_buffer(&BufferDesc { size_bytes, debug_name, ..BufferDesc::default() })
        };
        let hits = buffer(pixels * size_of::<Hit>() as u64, "hits")?;
        let lit = buffer(pixels * size_of::<u32>() as u64, "lit pixels")?;
        let addresses = [ctx.buffer_address(*hits)?, ctx.buffer_address(*lit)?];
        let view = View::new(mesh, addresses, size, tlas);
        Ok(Self { ctx: ctx.clone(), hits, lit, bounces: None, size, view })
    }

    /// Sets the bounce ray of each pixel. A direction of 0 is none.
    pub(super) fn set_bounce_rays(&mut self, rays: &[Ray]) -> lvk::Result<()> {
        let words: Vec<_> = rays.iter().flat_map(|ray| [ray.origin, ray.direction]).collect();
        let rays = self.ctx.create_buffer(&BufferDesc {
            data: Some(bytemuck::cast_slice(&words)),
            debug_name: "bounce rays",
            ..BufferDesc::default()
        })?;
        let size_bytes = (words.len() / 2 * size_of::<Hit>()) as u64;
        let hits = self.ctx.create_buffer(&BufferDesc {
            size_bytes,
            debug_name: "hits of bounce rays",
            ..BufferDesc::default()
        })?;
        self.view.bounce_rays = self.ctx.buffer_address(*rays)?;
        self.view.bounce_hits = self.ctx.buffer_address(*hits)?;
        self.bounces = Some(Bounces { rays, hits });
        Ok(())
    }

    /// Returns a bounce ray for each pixel whose primary ray hit the mesh, and a direction of 0 for the others.
    pub(super) fn bounce_rays(&self, mesh: &Mesh) -> lvk::Result<Vec<Ray>> {
        let rays = camera_rays(&mesh.camera, self.size);
        let bounced =
            |(number, (ray, hit)): (usize, (Ray, Hit))| match mesh.triangles.get(hit.primitive as usize) {
                Some(corners) if hit.t >= 0.0 => {
                    let triangle = corners.map(|corner| Vec3::from(mesh.positions[corner as usize]));
                    let ray = Ray { direction: ray.direction.normalize(), ..ray };
                    bounce(number, &ray, hit.t, triangle)
                }
                _ => Ray { origin: Vec3::ZERO, direction: Vec3::ZERO },
            };
        Ok(rays.into_iter().zip(self.hits()?).enumerate().map(bounced).collect())
    }

    /// Downloads the hits of the primary rays.
    pub(super) fn hits(&self) -> lvk::Result<Vec<Hit>> {
        let mut hits = vec![Hit::zeroed(); (self.size[0] * self.size[1]) as usize];
        self.ctx.download_buffer(*self.hits, 0, bytemuck::cast_slice_mut(&mut hits))?;
        Ok(hits)
    }

    /// Downloads one number per pixel: 1 if the shadow ray reached the light, else 0.
    pub(super) fn lit(&self) -> lvk::Result<Vec<u32>> {
        let mut lit = vec![0; (self.size[0] * self.size[1]) as usize];
        self.ctx.download_buffer(*self.lit, 0, bytemuck::cast_slice_mut(&mut lit))?;
        Ok(lit)
    }

    /// Returns the number of rays. Downloads the hits; trace the primary rays first.
    pub(super) fn ray_count(&self, rays: RayKind) -> lvk::Result<usize> {
        let hits = self.hits()?;
        Ok(match rays {
            RayKind::Primary => hits.len(),
            RayKind::Shadow | RayKind::Bounce => hits.iter().filter(|hit| hit.t >= 0.0).count(),
        })
    }

    /// Counts the pixels whose distances (by more than 1e-5, relative), triangles or shadows differ.
    pub(super) fn count_differing_pixels(&self, other: &Self) -> lvk::Result<usize> {
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
            bounce_rays: 0,
            bounce_hits: 0,
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

impl MeshTracer {
    pub(super) fn new(ctx: &Context, path: RayPath) -> lvk::Result<Self> {
        let pipelines = match path {
            RayPath::Pipeline => {
                let modules: lvk::Result<Vec<_>> =
                    stages(&[]).iter().map(|stage| stage.create(ctx, SAMPLE)).collect();
                Pipelines::Tracing(tracing_pipeline(ctx, &modules?)?)
            }
            RayPath::Query => Pipelines::Compute([
                compute_pipeline(ctx, &[])?,
                compute_pipeline(ctx, texts::SHADOW_RAYS)?,
                compute_pipeline(ctx, texts::BOUNCE_RAYS)?,
            ]),
        };
        Ok(Self { pipelines })
    }

    /// Creates a ray tracing pipeline from compiled SPIR-V, one module for each of [`stages`].
    pub(super) fn from_spirv(
        ctx: &Context,
        stages: &[SampleStage; 6],
        words: &[Vec<u32>],
    ) -> lvk::Result<Self> {
        let module = |(stage, words): (&SampleStage, &Vec<u32>)| {
            let source = ShaderSource::Spirv(words);
            ctx.create_shader_module(&ShaderModuleDesc { source, ..stage.module() })
        };
        let modules: lvk::Result<Vec<_>> = stages.iter().zip(words).map(module).collect();
        Ok(Self { pipelines: Pipelines::Tracing(tracing_pipeline(ctx, &modules?)?) })
    }

    /// Records a trace of the image. Trace the primary rays before the shadow rays, and set bounce rays before they are traced.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        image: &TracedImage,
        rays: RayKind,
    ) -> lvk::Result<()> {
        let [width, height] = image.size;
        let writes = [*image.hits, *image.lit];
        let bounces: Vec<_> =
            image.bounces.iter().flat_map(|bounces| [*bounces.rays, *bounces.hits]).collect();
        let (bounce_rays, bounce_hits) = bounces.split_at(bounces.len() / 2);
        let dependencies = match rays {
            RayKind::Bounce => {
                Dependencies { read_buffers: bounce_rays, buffers: bounce_hits, ..Dependencies::default() }
            }
            RayKind::Primary => Dependencies { buffers: &writes[..1], ..Dependencies::default() },
            RayKind::Shadow => {
                Dependencies { read_buffers: &writes[..1], buffers: &writes[1..], ..Dependencies::default() }
            }
        };
        match &self.pipelines {
            Pipelines::Tracing(pipeline) => {
                cmd.bind_ray_tracing_pipeline(**pipeline)?;
                cmd.push_constants(&image.view)?;
                cmd.trace_rays_with(rays as u32, [width, height, 1], &dependencies)
            }
            Pipelines::Compute(pipelines) => {
                cmd.bind_compute_pipeline(*pipelines[rays as usize])?;
                cmd.push_constants(&image.view)?;
                cmd.dispatch(
                    [width.div_ceil(WORKGROUP_SIDE), height.div_ceil(WORKGROUP_SIDE), 1],
                    &dependencies,
                )
            }
        }
    }
}

/// Creates a pipeline from modules in the order of [`stages`].
fn tracing_pipeline(
    ctx: &Context,
    modules: &[Holder<ShaderModuleHandle>],
) -> lvk::Result<Holder<RayTracingPipelineHandle>> {
    let handles = |range: std::ops::Range<usize>| -> Vec<ShaderModuleHandle> {
        modules[range].iter().map(Holder::handle).collect()
    };
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &handles(0..3),
        miss: &handles(3..5),
        hit_groups: &[HitGroup { closest_hit: Some(modules[5].handle()), ..HitGroup::default() }],
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
