//! Draws a triangle above a floor, with shadows by ray queries in the fragment shader, and writes `shadow.ppm`.
use lvk::*;

const VERTEX: &str = r"
    layout(buffer_reference, scalar) readonly buffer Positions { vec3 at[]; };
    layout(push_constant, scalar) uniform Push { Positions positions; uint tlas; };
    layout(location = 0) out vec3 world;
    void main() {
        world = positions.at[gl_VertexIndex];
        gl_Position = vec4(world.xy, 0.5, 1);
    }";
const FRAGMENT: &str = r"
    #include <lvk/ray_query.glsl>
    layout(push_constant, scalar) uniform Push { uvec2 positions; uint tlas; };
    layout(location = 0) in vec3 world;
    layout(location = 0) out vec4 color;
    const vec3 TO_LIGHT = vec3(0.5, 0.5, 1);
    void main() {
        LvkRayQuery rq;
        uint flags = LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT;
        lvkRayQueryInitialize(rq, tlas, flags, 0xFF, world, 0.001, TO_LIGHT, 100.0);
        while (lvkRayQueryProceed(rq)) {}
        bool lit = lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_NONE;
        vec3 surface = world.z > 0.0 ? vec3(1, 0.5, 0) : vec3(0.8);
        color = vec4(surface * (lit ? 1.0 : 0.25), 1);
    }";
const SIZE: [u32; 2] = [512, 512];

/// A floor at the height 0 that fills the image, and a triangle at the height 0.5. The view is from above.
const POSITIONS: [[f32; 3]; 9] = [
    [-1.0, -1.0, 0.0],
    [1.0, -1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 1.0, 0.0],
    [-0.2, -0.2, 0.5],
    [0.8, -0.2, 0.5],
    [0.3, 0.8, 0.5],
];

/// The push constants of both shaders. The tail makes the struct free of padding.
#[derive(Clone, Copy, bytemuck::NoUninit)]
#[repr(C)]
struct Push {
    positions: u64,
    tlas: u32,
    _tail: u32,
}

fn create_pipeline(ctx: &Context) -> Result<Holder<RenderPipelineHandle>> {
    let module = |stage, text, debug_name| {
        let source = ShaderSource::Glsl(text);
        ctx.create_shader_module(&ShaderModuleDesc { stage, source, debug_name, ..Default::default() })
    };
    let vertex = module(ShaderStage::Vertex, VERTEX, "floor.vert")?;
    let fragment = module(ShaderStage::Fragment, FRAGMENT, "floor.frag")?;
    ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*fragment),
        color: &[Format::Rgba8Unorm.into()],
        debug_name: "floor",
        ..Default::default()
    })
}

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Devices without ray queries get those of the library.
    let ctx = Context::new(&ContextDesc::default())?;
    let pipeline = create_pipeline(&ctx)?;
    let positions = ctx.create_buffer(&BufferDesc {
        usage: BufferUsage::ACCEL_INPUT | BufferUsage::STORAGE,
        data: Some(bytemuck::bytes_of(&POSITIONS)),
        debug_name: "positions",
        ..Default::default()
    })?;
    let geometries = &[BlasGeometry::Triangles(Triangles::packed(*positions, POSITIONS.len() as u32))];
    let blas = ctx.create_blas(&BlasDesc { geometries, debug_name: "floor", ..Default::default() })?;
    let instances = &[TlasInstance::new(*blas)];
    let tlas = ctx.create_tlas(&TlasDesc { instances, debug_name: "scene", ..Default::default() })?;
    let (extent, usage) = (SIZE, TextureUsage::TARGET);
    let image = ctx.create_texture(&TextureDesc { extent, usage, ..Default::default() })?;

    let mut cmd = ctx.acquire_command_buffer()?;
    let color = [ColorAttachment::clear(*image, [0.0; 4])];
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() })?;
    pass.bind_render_pipeline(*pipeline)?;
    pass.push_constants(&Push { positions: positions.address()?, tlas: tlas.index(), _tail: 0 })?;
    pass.draw(0..POSITIONS.len() as u32, 0..1)?;
    drop(pass);
    ctx.submit(cmd)?;

    let rgba = ctx.download_texture(*image, &TextureRegion::default())?;
    let rgb: Vec<_> = rgba.chunks(4).flat_map(|texel| &texel[..3]).copied().collect();
    Ok(std::fs::write("shadow.ppm", [b"P6 512 512 255\n", &rgb[..]].concat())?)
}
