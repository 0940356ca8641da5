//! The smallest pipeline: a triangle by one ray a pixel, as the sample `triangle` traces it.

use lvk::{
    BlasDesc, BlasGeometry, BufferDesc, BufferUsage, Context, Dependencies, HitGroup, RayTracingPipelineDesc,
    ShaderModuleDesc, ShaderSource, ShaderStage, TextureDesc, TextureUsage, TlasDesc, TlasInstance,
    Triangles,
};

use super::{FrameTimes, Frames};
use crate::error::BenchError;
use crate::measure::Stopwatch;

const SIZE: [u32; 2] = [640, 480];

const RAY_GEN: &str = "
    layout(push_constant) uniform Push { uint tlas; uint image; };
    layout(location = 0) rayPayloadEXT vec3 color;
    void main() {
        vec2 place = 2.0 * (gl_LaunchIDEXT.xy + vec2(0.5)) / gl_LaunchSizeEXT.xy - 1.0;
        traceRayEXT(kTLAS[tlas], gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, vec3(place, -1), 0.0, vec3(0, 0, 1), 9.0, 0);
        imageStore(kImages2D[image], ivec2(gl_LaunchIDEXT.xy), vec4(color, 1));
    }";
const MISS: &str = "
    layout(location = 0) rayPayloadInEXT vec3 color;
    void main() { color = vec3(0.1); }";
const HIT: &str = "
    layout(location = 0) rayPayloadInEXT vec3 color;
    hitAttributeEXT vec2 at;
    void main() { color = vec3(at, 1.0 - at.x - at.y); }";

/// Returns the frames of the triangle, with the time until the GPU is done.
pub(super) fn frames(ctx: &Context) -> Result<Frames, BenchError> {
    let vertices = ctx.create_buffer(&BufferDesc {
        usage: BufferUsage::ACCEL_INPUT,
        data: Some(bytemuck::bytes_of(&[[-0.7_f32, 0.6, 0.0], [0.7, 0.6, 0.0], [0.0, -0.7, 0.0]])),
        ..BufferDesc::default()
    })?;
    let geometries = [BlasGeometry::Triangles(Triangles::packed(*vertices, 3))];
    let blas = ctx.create_blas(&BlasDesc { geometries: &geometries, ..BlasDesc::default() })?;
    let tlas =
        ctx.create_tlas(&TlasDesc { instances: &[TlasInstance::new(*blas)], ..TlasDesc::default() })?;
    let image = ctx.create_texture(&TextureDesc {
        extent: SIZE,
        usage: TextureUsage::STORAGE,
        ..TextureDesc::default()
    })?;
    let shader = |stage, text| {
        let source = ShaderSource::Glsl(text);
        ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..ShaderModuleDesc::default() })
    };
    let ray_gen = shader(ShaderStage::RayGen, RAY_GEN)?;
    let miss = shader(ShaderStage::Miss, MISS)?;
    let hit = shader(ShaderStage::ClosestHit, HIT)?;
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &[HitGroup { closest_hit: Some(*hit), ..HitGroup::default() }],
        ..RayTracingPipelineDesc::default()
    })?;
    let stopwatch = Stopwatch::new(ctx)?;
    Ok(Box::new(move || {
        let _alive = (&vertices, &blas);
        let times = stopwatch.time(|cmd| {
            cmd.bind_ray_tracing_pipeline(*pipeline)?;
            cmd.push_constants(&[tlas.index(), image.index()])?;
            let writes = Dependencies { storage_images: &[*image], ..Dependencies::default() };
            cmd.trace_rays([SIZE[0], SIZE[1], 1], &writes)
        })?;
        Ok(FrameTimes { frame: times.total, rays: times.gpu })
    }))
}
