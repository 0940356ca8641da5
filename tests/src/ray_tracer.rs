//! Traces an array of rays on the GPU and returns a hit record for each: by ray tracing pipeline or by ray query.

use bytemuck::{NoUninit, Pod, Zeroable};
use lvk::{
    AccelStructHandle, BufferDesc, BufferHandle, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle,
    Context, Dependencies, HitGroup, Holder, RayTracingPipelineDesc, RayTracingPipelineHandle, Result,
    ShaderModuleDesc, ShaderModuleHandle, ShaderSource, ShaderStage,
};

use crate::rays::Ray;
use crate::{TestDevice, device};

/// [`HitRecord::kind`] of a ray that hit nothing.
pub const MISSED: u32 = 0;
/// [`HitRecord::kind`] of a hit from the front of a triangle.
pub const FRONT: u32 = 0xfe;
/// [`HitRecord::kind`] of a hit from the back of a triangle.
pub const BACK: u32 = 0xff;

/// Ray flag: every geometry is opaque, so that no any-hit shader runs.
pub const OPAQUE: u32 = 1;
/// Ray flag: no geometry is opaque.
pub const NO_OPAQUE: u32 = 2;
/// Ray flag: the first hit found ends the ray.
pub const TERMINATE_ON_FIRST_HIT: u32 = 4;
/// Ray flag: back faces are culled.
pub const CULL_BACK: u32 = 0x10;
/// Ray flag: front faces are culled.
pub const CULL_FRONT: u32 = 0x20;
/// Ray flag: opaque geometries are culled.
pub const CULL_OPAQUE: u32 = 0x40;
/// Ray flag: geometries that are not opaque are culled.
pub const CULL_NO_OPAQUE: u32 = 0x80;
/// Ray flag: triangles are skipped. Shaders declare `primitive_culling`.
pub const SKIP_TRIANGLES: u32 = 0x100;
/// Ray flag: AABBs are skipped. Shaders declare `primitive_culling`.
pub const SKIP_AABBS: u32 = 0x200;

/// The files that shaders may include; `ray_records.glsl` has the push constants.
pub const INCLUDES: [(&str, &str); 4] = [
    ("any_hit_payload.glsl", include_str!("../shaders/any_hit_payload.glsl")),
    ("ray_query_start.glsl", include_str!("../shaders/ray_query_start.glsl")),
    ("ray_records.glsl", include_str!("../shaders/ray_records.glsl")),
    ("sphere_object.glsl", include_str!("../shaders/sphere_object.glsl")),
];

const THREADS: u32 = 64;
const LAUNCH_WIDTH: u32 = 48;

/// Hit of a ray, as shaders write it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct HitRecord {
    /// Distance as a multiple of the ray's direction.
    pub t: f32,
    /// Weights of a triangle's second and third vertex.
    pub barycentrics: [f32; 2],
    /// [`MISSED`], [`FRONT`], [`BACK`], or what an intersection shader reported.
    pub kind: u32,
    /// Instance number.
    pub instance: u32,
    /// The instance's custom index.
    pub custom_index: u32,
    /// Geometry number.
    pub geometry: u32,
    /// Primitive number.
    pub primitive: u32,
}

/// Vulkan's way to trace rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// A ray tracing pipeline.
    Pipeline,
    /// Ray queries in a compute shader.
    Query,
}

impl Method {
    /// Returns the methods of the device, at least one. Prints which one is not tested.
    ///
    /// # Panics
    /// When the device has neither.
    pub fn available(ctx: &Context) -> Vec<Self> {
        let caps = ctx.capabilities();
        let pairs = [(Self::Pipeline, caps.ray_tracing_pipeline), (Self::Query, caps.ray_query)];
        for (method, _) in pairs.iter().filter(|(_, available)| !available) {
            eprintln!("NOT TESTED, {} has no ray {method:?}", caps.device_name);
        }
        let found: Vec<_> = pairs.iter().filter(|(_, available)| *available).map(|(m, _)| *m).collect();
        assert!(!found.is_empty(), "{} cannot trace rays", caps.device_name);
        found
    }
}

/// True if shaders can query rays. Prints what is not tested if they cannot.
pub fn requires_ray_queries(ctx: &Context) -> bool {
    let has = ctx.capabilities().ray_query;
    if !has {
        eprintln!("NOT TESTED, {} has no ray queries", ctx.capabilities().device_name);
    }
    has
}

/// Parameters of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct How {
    /// Cull mask.
    pub mask: u8,
    /// Ray flags.
    pub flags: u32,
    /// Number of the ray generation shader; queries have none.
    pub ray_gen: u32,
}

impl How {
    /// Returns parameters of shadow rays: only `kind` of the records is valid.
    pub fn shadows() -> Self {
        Self { flags: TERMINATE_ON_FIRST_HIT, ray_gen: 1, ..Self::default() }
    }
}

impl Default for How {
    fn default() -> Self {
        Self { mask: 0xff, flags: 0, ray_gen: 0 }
    }
}

/// A pipeline that traces rays by one method.
pub struct RayTracer {
    ctx: Context,
    pipeline: AnyPipeline,
}

enum AnyPipeline {
    RayTracing(Holder<RayTracingPipelineHandle>),
    Compute(Holder<ComputePipelineHandle>),
}

/// Rays on the GPU, and the buffer of their hit records.
pub struct TraceBuffers {
    rays: Holder<BufferHandle>,
    hits: Holder<BufferHandle>,
    count: u32,
}

#[repr(C)]
#[derive(Clone, Copy, NoUninit)]
struct Push {
    rays: u64,
    hits: u64,
    tlas: u32,
    count: u32,
    mask: u32,
    flags: u32,
}

impl RayTracer {
    /// Creates a tracer whose opacity is that of geometry and ray.
    pub fn new(ctx: &Context, method: Method) -> Result<Self> {
        Self::with_shaders(ctx, method, false)
    }

    /// Creates a tracer that ignores triangles with odd numbers, unless they are opaque.
    pub fn with_even_primitives(ctx: &Context, method: Method) -> Result<Self> {
        Self::with_shaders(ctx, method, true)
    }

    /// Creates a tracer by query, in a module without candidates: all triangles are opaque.
    pub fn for_opaque_triangles(ctx: &Context) -> Result<Self> {
        let pipeline = AnyPipeline::Compute(compute(ctx, &[("LVK_OPAQUE_TRIANGLES_ONLY", "")])?);
        Ok(Self { ctx: ctx.clone(), pipeline })
    }

    /// Creates a tracer with a given pipeline, whose ray generation shaders have the push constants of
    /// `ray_records.glsl`.
    pub fn from_pipeline(ctx: &Context, pipeline: Holder<RayTracingPipelineHandle>) -> Self {
        Self { ctx: ctx.clone(), pipeline: AnyPipeline::RayTracing(pipeline) }
    }

    /// As [`from_pipeline`](Self::from_pipeline), with a compute shader of 64 invocations that traces by query.
    pub fn from_query(ctx: &Context, pipeline: Holder<ComputePipelineHandle>) -> Self {
        Self { ctx: ctx.clone(), pipeline: AnyPipeline::Compute(pipeline) }
    }

    /// As [`from_query`](Self::from_query), of GLSL text with macros.
    pub fn from_query_text(ctx: &Context, text: &str, defines: &[(&str, &str)]) -> Result<Self> {
        let module = shader_with(ctx, ShaderStage::Compute, text, defines)?;
        let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
        Ok(Self::from_query(ctx, ctx.create_compute_pipeline(&desc)?))
    }

    /// As [`from_pipeline`](Self::from_pipeline), of a pipeline with these hit groups.
    pub fn from_groups(
        ctx: &Context,
        ray_gen: ShaderModuleHandle,
        miss: ShaderModuleHandle,
        hit_groups: &[HitGroup<'_>],
    ) -> Result<Self> {
        let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &[ray_gen],
            miss: &[miss],
            hit_groups,
            ..Default::default()
        })?;
        Ok(Self::from_pipeline(ctx, pipeline))
    }

    fn with_shaders(ctx: &Context, method: Method, keep_even: bool) -> Result<Self> {
        let pipeline = match method {
            Method::Pipeline => AnyPipeline::RayTracing(ray_tracing(ctx, keep_even)?),
            Method::Query => {
                AnyPipeline::Compute(compute(ctx, if keep_even { &[("KEEP_EVEN", "")] } else { &[] })?)
            }
        };
        Ok(Self { ctx: ctx.clone(), pipeline })
    }

    /// Returns the context.
    pub fn context(&self) -> &Context {
        &self.ctx
    }

    /// Uploads rays.
    pub fn buffers(&self, rays: &[Ray]) -> Result<TraceBuffers> {
        let buffer = |size_bytes, data, debug_name| {
            self.ctx.create_buffer(&BufferDesc { size_bytes, data, debug_name, ..Default::default() })
        };
        Ok(TraceBuffers {
            rays: buffer(0, Some(bytemuck::cast_slice(rays)), "rays")?,
            hits: buffer((rays.len() * size_of::<HitRecord>()) as u64, None, "hit records")?,
            count: rays.len() as u32,
        })
    }

    /// Records a trace.
    pub fn record(
        &self,
        cmd: &mut CommandBuffer,
        tlas: &Holder<AccelStructHandle>,
        trace_buffers: &TraceBuffers,
        how: How,
    ) -> Result<()> {
        self.record_at(cmd, tlas.index(), trace_buffers, how)
    }

    /// As [`record`](Self::record), for the TLAS of a bindless index.
    pub fn record_at(
        &self,
        cmd: &mut CommandBuffer,
        tlas: u32,
        trace_buffers: &TraceBuffers,
        how: How,
    ) -> Result<()> {
        let push = Push {
            rays: self.ctx.buffer_address(*trace_buffers.rays)?,
            hits: self.ctx.buffer_address(*trace_buffers.hits)?,
            tlas,
            count: trace_buffers.count,
            mask: how.mask.into(),
            flags: how.flags,
        };
        let writes = Dependencies { buffers: &[*trace_buffers.hits], ..Default::default() };
        match &self.pipeline {
            AnyPipeline::RayTracing(pipeline) => {
                cmd.bind_ray_tracing_pipeline(**pipeline)?;
                cmd.push_constants(&push)?;
                let size = [LAUNCH_WIDTH, trace_buffers.count.div_ceil(LAUNCH_WIDTH), 1];
                cmd.trace_rays_with(how.ray_gen, size, &writes)
            }
            AnyPipeline::Compute(pipeline) => {
                cmd.bind_compute_pipeline(**pipeline)?;
                cmd.push_constants(&push)?;
                cmd.dispatch([trace_buffers.count.div_ceil(THREADS), 1, 1], &writes)
            }
        }
    }

    /// Waits for a submitted trace and reads its records.
    pub fn read(&self, trace_buffers: &TraceBuffers) -> Result<Vec<HitRecord>> {
        let mut records = vec![HitRecord::zeroed(); trace_buffers.count as usize];
        self.ctx.download_buffer(*trace_buffers.hits, 0, bytemuck::cast_slice_mut(&mut records))?;
        Ok(records)
    }

    /// Traces rays, waits, and reads the records.
    pub fn trace(&self, tlas: &Holder<AccelStructHandle>, rays: &[Ray], how: How) -> Result<Vec<HitRecord>> {
        let trace_buffers = self.buffers(rays)?;
        let mut cmd = self.ctx.acquire_command_buffer()?;
        self.record(&mut cmd, tlas, &trace_buffers, how)?;
        self.ctx.submit(cmd)?;
        self.read(&trace_buffers)
    }
}

/// Runs a test on the usual device by each of its methods, with a tracer of closest hits.
///
/// # Errors
/// Those of the test and of the tracer.
pub fn for_each_method(mut test: impl FnMut(&TestDevice, Method, &RayTracer) -> Result<()>) -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    for method in Method::available(&ctx) {
        test(&ctx, method, &RayTracer::new(&ctx, method)?)?;
    }
    Ok(())
}

/// Compiles a shader that may include [`INCLUDES`].
pub fn shader(ctx: &Context, stage: ShaderStage, text: &str) -> Result<Holder<ShaderModuleHandle>> {
    shader_with(ctx, stage, text, &[])
}

/// As [`shader`], with macros.
pub fn shader_with(
    ctx: &Context,
    stage: ShaderStage,
    text: &str,
    defines: &[(&str, &str)],
) -> Result<Holder<ShaderModuleHandle>> {
    let includes = &INCLUDES;
    let source = ShaderSource::Glsl(text);
    ctx.create_shader_module(&ShaderModuleDesc { stage, source, includes, defines, ..Default::default() })
}

fn ray_tracing(ctx: &Context, keep_even: bool) -> Result<Holder<RayTracingPipelineHandle>> {
    let closest = shader(ctx, ShaderStage::RayGen, include_str!("../shaders/closest.rgen.glsl"))?;
    let occluded = shader(ctx, ShaderStage::RayGen, include_str!("../shaders/occluded.rgen.glsl"))?;
    let missed = shader(ctx, ShaderStage::Miss, include_str!("../shaders/record.rmiss.glsl"))?;
    let seen = shader(ctx, ShaderStage::Miss, include_str!("../shaders/unoccluded.rmiss.glsl"))?;
    let hit = shader(ctx, ShaderStage::ClosestHit, include_str!("../shaders/record.rchit.glsl"))?;
    let any_hit = shader(ctx, ShaderStage::AnyHit, include_str!("../shaders/keep_even.rahit.glsl"))?;
    let any_hit = keep_even.then_some(*any_hit);
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*closest, *occluded],
        miss: &[*missed, *seen],
        hit_groups: &[HitGroup { closest_hit: Some(*hit), any_hit, ..Default::default() }],
        debug_name: "hit records by pipeline",
        ..Default::default()
    })
}

fn compute(ctx: &Context, defines: &[(&str, &str)]) -> Result<Holder<ComputePipelineHandle>> {
    let text = include_str!("../shaders/query.comp.glsl");
    let module = shader_with(ctx, ShaderStage::Compute, text, defines)?;
    ctx.create_compute_pipeline(&ComputePipelineDesc {
        module: Some(*module),
        debug_name: "hit records by query",
        ..Default::default()
    })
}
