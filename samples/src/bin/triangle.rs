//! The smallest ray traced triangle: `cargo run --bin triangle` writes `triangle.png`.
use lvk::*;
use lvk_dev_driver::{DriverRequest, prepare};

const RAY_GEN: &str = r"
    layout(push_constant) uniform Push { uint tlas; uint image; };
    layout(location = 0) rayPayloadEXT vec3 color;
    void main() {
        vec2 point = (vec2(gl_LaunchIDEXT.xy) + 0.5) / vec2(gl_LaunchSizeEXT.xy) * 2.0 - 1.0;
        traceRayEXT(kTLAS[tlas], gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, vec3(point, -1), 0.0, vec3(0, 0, 1), 9.0, 0);
        imageStore(kImages2D[image], ivec2(gl_LaunchIDEXT.xy), vec4(color, 1));
    }";
const MISS: &str = r"
    layout(location = 0) rayPayloadInEXT vec3 color;
    void main() { color = vec3(0.02, 0.03, 0.05); }";
const HIT: &str = r"
    layout(location = 0) rayPayloadInEXT vec3 color;
    hitAttributeEXT vec2 bary;
    void main() { color = vec3(1.0 - bary.x - bary.y, bary); }";
const SIZE: [u32; 2] = [640, 480];

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let driver = prepare(&DriverRequest::default())?;
    let ctx = Context::new(&ContextDesc { vulkan_library: driver.loader.as_deref(), ..Default::default() })?;
    let vertices = ctx.create_buffer(&BufferDesc {
        usage: BufferUsage::ACCEL_INPUT,
        data: Some(bytemuck::bytes_of(&[[-0.7_f32, 0.6, 0.0], [0.7, 0.6, 0.0], [0.0, -0.7, 0.0]])),
        ..Default::default()
    })?;
    let blas = ctx.create_blas(&BlasDesc {
        geometries: &[BlasGeometry::Triangles(Triangles::packed(*vertices, 3))],
        ..Default::default()
    })?;
    let instances = [TlasInstance::new(*blas)];
    let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() })?;
    let image = ctx.create_texture(&TextureDesc {
        extent: SIZE,
        usage: TextureUsage::STORAGE,
        ..Default::default()
    })?;
    let shader = |stage, text| {
        let source = ShaderSource::Glsl(text);
        ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..Default::default() })
    };
    let ray_gen = shader(ShaderStage::RayGen, RAY_GEN)?;
    let miss = shader(ShaderStage::Miss, MISS)?;
    let hit = shader(ShaderStage::ClosestHit, HIT)?;
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &[HitGroup { closest_hit: Some(*hit), ..Default::default() }],
        ..Default::default()
    })?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_ray_tracing_pipeline(*pipeline)?;
    cmd.push_constants(&[tlas.index(), image.index()])?;
    let writes = Dependencies { storage_images: &[*image], ..Default::default() };
    cmd.trace_rays([SIZE[0], SIZE[1], 1], &writes)?;
    ctx.submit(cmd)?;
    let pixels = ctx.download_texture(*image, &TextureRegion::default())?;
    image::save_buffer("triangle.png", &pixels, SIZE[0], SIZE[1], image::ColorType::Rgba8)?;
    Ok(())
}
