//! Frames of primary rays.

use bytemuck::NoUninit;
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, ComputePipelineDesc,
    ComputePipelineHandle, Context, Dependencies, HitGroup, Holder, RayTracingPipelineDesc,
    RayTracingPipelineHandle, ShaderStage, TlasDesc, TlasInstance, Triangles,
};

use super::module;
use crate::peers::peer::{Failure, RowRun, Sample};
use crate::peers::ray_scene::{RayScene, RayView, ray_result};
use crate::peers::workload::Workload;

const INPUTS: &str = "
    struct Hit { float t; uint primitive; };
    layout(buffer_reference, scalar) writeonly buffer Hits { Hit at[]; };
    layout(push_constant) uniform Push { vec4 eye, right, down, forward; Hits hits; uint tlas; };
    vec3 pixelDirection(uvec2 pixel, uvec2 size) {
        vec2 place = (vec2(pixel) + 0.5) / vec2(size) * 2.0 - 1.0;
        return normalize(forward.xyz + place.x * right.xyz + place.y * down.xyz);
    }";
const QUERY: &str = "
    #define LVK_OPAQUE_TRIANGLES_ONLY
    #include <lvk/ray_query.glsl>
    #include <inputs.glsl>
    layout(local_size_x = 8, local_size_y = 8) in;
    void main() {
        uvec2 pixel = gl_GlobalInvocationID.xy, size = uvec2(eye.w, right.w);
        if (pixel.x >= size.x || pixel.y >= size.y) return;
        LvkRayQuery rq;
        vec3 direction = pixelDirection(pixel, size);
        lvkRayQueryInitialize(rq, tlas, LVK_RAY_FLAG_OPAQUE, 0xff, eye.xyz, 0.0, direction, 1e30);
        while (lvkRayQueryProceed(rq)) {}
        Hit hit = Hit(-1.0, 0u);
        if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE) {
            hit.t = lvkRayQueryT(rq, LVK_COMMITTED);
            hit.primitive = uint(lvkRayQueryPrimitiveIndex(rq, LVK_COMMITTED, tlas));
        }
        hits.at[pixel.y * size.x + pixel.x] = hit;
    }";
const RAY_GEN: &str = "
    #include <inputs.glsl>
    layout(location = 0) rayPayloadEXT Hit hit;
    void main() {
        uvec2 pixel = gl_LaunchIDEXT.xy, size = gl_LaunchSizeEXT.xy;
        hit = Hit(-1.0, 0u);
        vec3 direction = pixelDirection(pixel, size);
        traceRayEXT(kTLAS[tlas], LVK_RAY_FLAG_OPAQUE, 0xff, 0, 0, 0, eye.xyz, 0.0, direction, 1e30, 0);
        hits.at[pixel.y * size.x + pixel.x] = hit;
    }";
const MISS: &str = "
    #include <inputs.glsl>
    layout(location = 0) rayPayloadInEXT Hit hit;
    void main() { hit.t = -1.0; }";
const CLOSEST_HIT: &str = "
    #include <inputs.glsl>
    layout(location = 0) rayPayloadInEXT Hit hit;
    void main() { hit = Hit(gl_HitTEXT, uint(lvkPrimitiveIndex(tlas))); }";

/// The push constants.
#[repr(C)]
#[derive(Clone, Copy, NoUninit)]
struct Push {
    view: RayView,
    hits: u64,
    tlas: u32,
    _tail: u32,
}

enum Pipeline {
    Query(Holder<ComputePipelineHandle>),
    Tracing(Holder<RayTracingPipelineHandle>),
}

/// A frame of primary rays.
pub(super) struct RayFrame {
    ctx: Context,
    pipeline: Pipeline,
    hits: Holder<BufferHandle>,
    push: Push,
    size: [u32; 2],
    _structures: [Holder<AccelStructHandle>; 2],
    _buffers: [Holder<BufferHandle>; 2],
}

impl RayFrame {
    pub(super) fn by_query(ctx: Context, work: &Workload) -> Result<Self, Failure> {
        if !ctx.capabilities().ray_query {
            return Err("the device has no ray queries".into());
        }
        let module = stage(&ctx, ShaderStage::Compute, QUERY)?;
        let desc = ComputePipelineDesc { module: Some(*module), ..ComputePipelineDesc::default() };
        let pipeline = Pipeline::Query(ctx.create_compute_pipeline(&desc)?);
        Self::new(ctx, work, pipeline)
    }

    pub(super) fn by_pipeline(ctx: Context, work: &Workload) -> Result<Self, Failure> {
        if !ctx.capabilities().ray_tracing_pipeline {
            return Err("the device has no ray tracing pipelines".into());
        }
        let ray_gen = stage(&ctx, ShaderStage::RayGen, RAY_GEN)?;
        let miss = stage(&ctx, ShaderStage::Miss, MISS)?;
        let closest_hit = stage(&ctx, ShaderStage::ClosestHit, CLOSEST_HIT)?;
        let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &[*ray_gen],
            miss: &[*miss],
            hit_groups: &[HitGroup { closest_hit: Some(*closest_hit), ..HitGroup::default() }],
            ..RayTracingPipelineDesc::default()
        })?;
        Self::new(ctx, work, Pipeline::Tracing(pipeline))
    }

    fn new(ctx: Context, work: &Workload, pipeline: Pipeline) -> Result<Self, Failure> {
        let scene = RayScene::new(work)?;
        let input = |data| {
            let (usage, data) = (BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT, Some(data));
            ctx.create_buffer(&BufferDesc { usage, data, ..BufferDesc::default() })
        };
        let buffers =
            [input(bytemuck::cast_slice(&scene.positions))?, input(bytemuck::cast_slice(&scene.triangles))?];
        let triangles = Triangles::indexed(
            *buffers[0],
            scene.positions.len() as u32,
            *buffers[1],
            scene.triangles.len() as u32,
        );
        let geometries = &[BlasGeometry::Triangles(triangles)];
        let blas = ctx.create_blas(&BlasDesc { geometries, ..BlasDesc::default() })?;
        let instances = &[TlasInstance::new(*blas)];
        let tlas = ctx.create_tlas(&TlasDesc { instances, ..TlasDesc::default() })?;
        let size_bytes = 8 * u64::from(work.image[0]) * u64::from(work.image[1]);
        let hits = ctx.create_buffer(&BufferDesc { size_bytes, ..BufferDesc::default() })?;
        ctx.wait(ctx.flush()?)?;
        let push = Push { view: scene.view, hits: hits.address()?, tlas: tlas.index(), _tail: 0 };
        Ok(Self { ctx, pipeline, hits, push, size: work.image, _structures: [tlas, blas], _buffers: buffers })
    }
}

impl RowRun for RayFrame {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let mut cmd = self.ctx.acquire_command_buffer()?;
            let writes = Dependencies { buffers: &[*self.hits], ..Dependencies::default() };
            let [width, height] = self.size;
            match &self.pipeline {
                Pipeline::Query(pipeline) => {
                    cmd.bind_compute_pipeline(**pipeline)?;
                    cmd.push_constants(&self.push)?;
                    cmd.dispatch([width.div_ceil(8), height.div_ceil(8), 1], &writes)?;
                }
                Pipeline::Tracing(pipeline) => {
                    cmd.bind_ray_tracing_pipeline(**pipeline)?;
                    cmd.push_constants(&self.push)?;
                    cmd.trace_rays([width, height, 1], &writes)?;
                }
            }
            Ok(self.ctx.submit(cmd)?)
        };
        Sample::take(submit, |submission| Ok(self.ctx.wait(submission)?))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let mut bytes = vec![0; 8 * self.size[0] as usize * self.size[1] as usize];
        self.ctx.download_buffer(*self.hits, 0, &mut bytes)?;
        Ok(Some(ray_result(&bytes)))
    }
}

fn stage(ctx: &Context, stage: ShaderStage, text: &str) -> lvk::Result<Holder<lvk::ShaderModuleHandle>> {
    module(ctx, stage, &text.replace("#include <inputs.glsl>", INPUTS))
}
