//! Traces two triangles that share a closest-hit shader and differ by their shader records, and writes `records.ppm`.
use lvk::*;

const RAY_GEN: &str = r"
    layout(push_constant) uniform Push { uint tlas, image; };
    layout(location = 0) rayPayloadEXT vec3 color;
    void main() {
        vec2 point = (gl_LaunchIDEXT.xy + 0.5) / vec2(gl_LaunchSizeEXT.xy) * 2.0 - 1.0;
        traceRayEXT(kTLAS[tlas], LVK_RAY_FLAG_OPAQUE, 0xFF, 0, 0, 0, vec3(point, -1), 0.0, vec3(0, 0, 1), 9.0, 0);
        imageStore(kImages2D[image], ivec2(gl_LaunchIDEXT.xy), vec4(color, 1));
    }";
const MISS: &str = r"
    layout(location = 0) rayPayloadInEXT vec3 color;
    layout(shaderRecordEXT, scalar) buffer Record { vec3 sky; };
    void main() { color = sky; }";
const CLOSEST_HIT: &str = r"
    layout(location = 0) rayPayloadInEXT vec3 color;
    layout(shaderRecordEXT, scalar) buffer Record { vec3 surface; float stripes; };
    hitAttributeEXT vec2 barycentrics;
    void main() {
        bool bright = fract(barycentrics.y * stripes) < 0.5;
        color = surface * (bright ? 1.0 : 0.5);
    }";
const SIZE: [u32; 2] = [512, 512];

/// The record of a hit group, as the closest-hit shader reads it.
#[derive(Clone, Copy, bytemuck::NoUninit)]
#[repr(C)]
struct Surface {
    color: [f32; 3],
    stripes: f32,
}

fn create_pipeline(ctx: &Context) -> Result<Holder<RayTracingPipelineHandle>> {
    let module = |stage, text, debug_name| {
        let source = ShaderSource::Glsl(text);
        ctx.create_shader_module(&ShaderModuleDesc { stage, source, debug_name, ..Default::default() })
    };
    let ray_gen = module(ShaderStage::RayGen, RAY_GEN, "camera.rgen")?;
    let miss = module(ShaderStage::Miss, MISS, "sky.rmiss")?;
    let closest_hit = module(ShaderStage::ClosestHit, CLOSEST_HIT, "stripes.rchit")?;
    let group = |surface| HitGroup {
        closest_hit: Some(*closest_hit),
        record: record_bytes(surface),
        ..Default::default()
    };
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        miss_records: &[record_bytes(&[0.1_f32, 0.1, 0.2])],
        hit_groups: &[
            group(&Surface { color: [1.0, 0.2, 0.2], stripes: 1.0 }),
            group(&Surface { color: [0.2, 0.6, 1.0], stripes: 8.0 }),
        ],
        debug_name: "stripes",
        ..Default::default()
    })
}

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ctx = Context::new(&ContextDesc::default())?;
    let pipeline = create_pipeline(&ctx)?;
    let positions = [[-0.4_f32, 0.4, 0.0], [0.4, 0.4, 0.0], [0.0, -0.4, 0.0]];
    let vertices = ctx.create_buffer(&BufferDesc {
        usage: BufferUsage::ACCEL_INPUT,
        data: Some(bytemuck::bytes_of(&positions)),
        debug_name: "positions",
        ..Default::default()
    })?;
    let geometries = &[BlasGeometry::Triangles(Triangles::packed(*vertices, 3))];
    let blas = ctx.create_blas(&BlasDesc { geometries, debug_name: "triangle", ..Default::default() })?;
    // The rows of the transform; the hit group of an instance is that of its offset.
    let instance = |x, hit_group_offset| TlasInstance {
        transform: [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        hit_group_offset,
        ..TlasInstance::new(*blas)
    };
    let instances = &[instance(-0.5, 0), instance(0.5, 1)];
    let tlas = ctx.create_tlas(&TlasDesc { instances, debug_name: "scene", ..Default::default() })?;
    let (extent, usage) = (SIZE, TextureUsage::STORAGE);
    let image = ctx.create_texture(&TextureDesc { extent, usage, ..Default::default() })?;

    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_ray_tracing_pipeline(*pipeline)?;
    cmd.push_constants(&[tlas.index(), image.index()])?;
    let writes = Dependencies { storage_images: &[*image], ..Default::default() };
    cmd.trace_rays([SIZE[0], SIZE[1], 1], &writes)?;
    ctx.submit(cmd)?;

    let rgba = ctx.download_texture(*image, &TextureRegion::default())?;
    let rgb: Vec<_> = rgba.chunks(4).flat_map(|texel| &texel[..3]).copied().collect();
    Ok(std::fs::write("records.ppm", [b"P6 512 512 255\n", &rgb[..]].concat())?)
}
