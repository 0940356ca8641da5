//! Traces a triangle with ray queries in a compute shader and writes `triangle.ppm`.
use lvk::*;

const SHADER: &str = r"
    #include <lvk/ray_query.glsl>
    layout(local_size_x = 8, local_size_y = 8) in;
    layout(push_constant) uniform Push { uint tlas, image; };
    void main() {
        vec2 point = (gl_GlobalInvocationID.xy + 0.5) / 256.0 - 1.0;
        LvkRayQuery rq;
        lvkRayQueryInitialize(rq, tlas, LVK_RAY_FLAG_OPAQUE, 0xFF, vec3(point, -1), 0.0, vec3(0, 0, 1), 2.0);
        while (lvkRayQueryProceed(rq)) {}
        bool hit = lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE;
        vec4 color = hit ? vec4(lvkRayQueryBarycentrics(rq, LVK_COMMITTED), 0.5, 1) : vec4(0.1);
        imageStore(kImages2D[image], ivec2(gl_GlobalInvocationID.xy), color);
    }";

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ctx = Context::new(&ContextDesc::default())?;
    let positions = [-0.7_f32, 0.6, 0.0, 0.7, 0.6, 0.0, 0.0, -0.7, 0.0].map(f32::to_ne_bytes);
    let (usage, data) = (BufferUsage::ACCEL_INPUT, Some(positions.as_flattened()));
    let vertices = ctx.create_buffer(&BufferDesc { usage, data, ..Default::default() })?;
    let geometries = &[BlasGeometry::Triangles(Triangles::packed(*vertices, 3))];
    let blas = ctx.create_blas(&BlasDesc { geometries, ..Default::default() })?;
    let instances = &[TlasInstance::new(*blas)];
    let tlas = ctx.create_tlas(&TlasDesc { instances, ..Default::default() })?;
    let (extent, usage) = ([512, 512], TextureUsage::STORAGE);
    let image = ctx.create_texture(&TextureDesc { extent, usage, ..Default::default() })?;
    let (stage, source) = (ShaderStage::Compute, ShaderSource::Glsl(SHADER));
    let module = ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..Default::default() })?;
    let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
    let pipeline = ctx.create_compute_pipeline(&desc)?;

    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_compute_pipeline(*pipeline)?;
    cmd.push_constants(&[tlas.index(), image.index()])?;
    let writes = Dependencies { storage_images: &[*image], ..Default::default() };
    cmd.dispatch([64, 64, 1], &writes)?;
    ctx.submit(cmd)?;
    let rgba = ctx.download_texture(*image, &TextureRegion::default())?;
    let rgb: Vec<_> = rgba.chunks(4).flat_map(|texel| &texel[..3]).copied().collect();
    Ok(std::fs::write("triangle.ppm", [b"P6 512 512 255\n", &rgb[..]].concat())?)
}
