//! What every frame uses: targets, pipelines, meshes and acceleration structures.

use bytemuck::NoUninit;
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, BuildFlags,
    ComputePipelineHandle, Context, Format, Holder, PrimitiveOrder, RenderPipelineDesc, RenderPipelineHandle,
    Result, SamplerHandle, TextureDesc, TextureHandle, TextureUsage, TlasDesc, TlasInstance, Triangles,
};
use lvk_tests::compute::compute_pipeline;
use lvk_tests::raster::render_pipeline;

/// Frames after which everything repeats: a frame's inputs depend on its number modulo this one only.
pub const CYCLE: u32 = 250;
/// Words of the buffer that each queue writes.
pub const WORDS: u32 = 64;
/// Instances that the TLAS has place for.
pub const MOST_INSTANCES: u32 = 8;
/// Triangles of a mesh along a side; each square has two.
const SIDE: u32 = 6;

/// What the shaders of a frame read, uploaded anew for each dispatch and draw.
#[repr(C)]
#[derive(Debug, Clone, Copy, NoUninit)]
pub struct FrameConstants {
    /// Address of the words that the queues write.
    pub words: u64,
    /// Bindless index of the TLAS.
    pub tlas: u32,
    /// Bindless index of the traced image.
    pub image: u32,
    /// Bindless index of the streamed texture.
    pub texture: u32,
    /// Bindless index of the sampler.
    pub sampler: u32,
    /// Finest mip of the texture that is there.
    pub finest_mip: u32,
    /// Frame number in the cycle.
    pub phase: u32,
}

const HEAD: &str = "
    layout(buffer_reference, scalar) readonly buffer Words { uint at[]; };
    layout(buffer_reference, scalar) readonly buffer Frame {
        Words words; uint tlas; uint image; uint texture; uint smp; uint finestMip; uint phase;
    };
    layout(push_constant, scalar) uniform Push { Frame frame; };
";

const TRACE: &str = "
    layout(local_size_x = 8, local_size_y = 4) in;
    void main() {
        ivec2 at = ivec2(gl_GlobalInvocationID.xy);
        ivec2 size = imageSize(kImages2D[frame.image]);
        if (any(greaterThanEqual(at, size))) return;
        vec2 uv = (vec2(at) + 0.5) / vec2(size);
        LvkRayQuery rq;
        vec3 origin = vec3(uv * vec2(8.0, 4.0) - vec2(0.03, 0.07), -1.0);
        lvkRayQueryInitialize(rq, frame.tlas, 0, 0xff, origin, 0.0, vec3(0, 0, 1), 100.0);
        while (lvkRayQueryProceed(rq)) {}
        vec3 color = 0.5 * textureBindless2DLod(frame.texture, frame.smp, uv, float(frame.finestMip)).rgb;
        if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE) {
            float custom = float(lvkRayQueryInstanceCustomIndex(rq, LVK_COMMITTED));
            color += vec3(custom / 64.0, lvkRayQueryT(rq, LVK_COMMITTED) / 40.0, 0.25);
        }
        color.b += float(frame.words.at[at.x % 64] & 0xffu) / 1024.0;
        imageStore(kImages2D[frame.image], at, vec4(color, 1.0));
    }";

const VERTEX: &str = "
    void main() {
        vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
        float shrink = gl_InstanceIndex == 0 ? 1.0 : 0.1 + 0.2 * float(gl_InstanceIndex);
        gl_Position = vec4((corner * 4.0 - 1.0) * shrink, 0.5, 1.0);
    }";

const FRAGMENT: &str = "
    layout(location = 0) out vec4 result;
    void main() {
        vec4 traced = textureBindlessFetch2D(frame.image, ivec2(gl_FragCoord.xy), 0);
        result = vec4(traced.rgb + vec3(float(frame.phase) / 1000.0, 0.0, 0.0), 1.0);
    }";

/// Objects that live for the whole run, but for the targets, which are resized.
pub struct Scene {
    /// Image that rays are traced to.
    pub traced: Holder<TextureHandle>,
    /// Image that is drawn to.
    pub target: Holder<TextureHandle>,
    /// Size of both.
    pub extent: [u32; 2],
    /// Sampler of the streamed textures.
    pub sampler: Holder<SamplerHandle>,
    /// Words that the three queues write in turn.
    pub words: Holder<BufferHandle>,
    /// Vertices of the mesh that moves.
    pub vertices: Holder<BufferHandle>,
    /// The mesh that moves; it is refitted.
    pub moving: Holder<AccelStructHandle>,
    /// A mesh that stays.
    pub fixed: Holder<AccelStructHandle>,
    /// Vertices of the mesh that stays.
    _fixed_vertices: Holder<BufferHandle>,
    /// Instances of both.
    pub tlas: Holder<AccelStructHandle>,
    /// Traces rays.
    pub trace: Holder<ComputePipelineHandle>,
    /// Draws.
    pub draw: Holder<RenderPipelineHandle>,
}

impl Scene {
    /// Creates everything for the first frame.
    pub fn new(ctx: &Context) -> Result<Self> {
        let trace = compute_pipeline(ctx, &format!("#include <lvk/ray_query.glsl>\n{HEAD}{TRACE}"));
        let desc = RenderPipelineDesc { color: &[Format::Rgba8Unorm.into()], ..Default::default() };
        let draw = render_pipeline(ctx, VERTEX, &format!("{HEAD}{FRAGMENT}"), &desc);
        let words = ctx.create_buffer(&BufferDesc {
            data: Some(&[0; 4 * WORDS as usize]),
            debug_name: "words",
            ..Default::default()
        })?;
        let vertices = mesh_buffer(ctx, 0)?;
        let fixed_vertices = mesh_buffer(ctx, 3)?;
        let moving = blas(ctx, *vertices, BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE)?;
        let fixed = blas(ctx, *fixed_vertices, BuildFlags::FAST_TRACE)?;
        let extent = extent_of(0);
        let [traced, target] = targets(ctx, extent)?;
        let sampler = ctx.create_sampler(&Default::default())?;
        let tlas = tlas(ctx, &instances(0, [*moving, *fixed]))?;
        Ok(Self {
            traced,
            target,
            extent,
            sampler,
            words,
            vertices,
            moving,
            fixed,
            _fixed_vertices: fixed_vertices,
            tlas,
            trace,
            draw,
        })
    }

    /// Replaces the targets by those of another size.
    pub fn resize(&mut self, ctx: &Context, extent: [u32; 2]) -> Result<()> {
        [self.traced, self.target] = targets(ctx, extent)?;
        self.extent = extent;
        Ok(())
    }

    /// Replaces the TLAS by a new one.
    pub fn renew_tlas(&mut self, ctx: &Context, phase: u32) -> Result<()> {
        self.tlas = tlas(ctx, &instances(phase, [*self.moving, *self.fixed]))?;
        Ok(())
    }
}

/// Returns the size of the targets in a phase.
pub fn extent_of(phase: u32) -> [u32; 2] {
    if (100..150).contains(&phase) { [48, 28] } else { [64, 36] }
}

/// Returns the instances of a phase: one to [`MOST_INSTANCES`], each at a depth of its own.
pub fn instances(phase: u32, meshes: [AccelStructHandle; 2]) -> Vec<TlasInstance> {
    let place = |slot: u32| {
        let (x, y, z) = (slot as f32, (phase % 5) as f32 * 0.3, 1.0 + 3.0 * slot as f32);
        TlasInstance {
            transform: [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z],
            custom_index: 1 + (7 * slot + phase) % 60,
            ..TlasInstance::new(meshes[((slot + phase) % 2) as usize])
        }
    };
    (0..=phase % MOST_INSTANCES).map(place).collect()
}

/// Returns the vertices of a wavy sheet over a unit square and more, three for each triangle.
pub fn sheet(phase: u32) -> Vec<[f32; 3]> {
    let point = |x: u32, y: u32| {
        let wave = ((x + 2 * y + phase) % 11) as f32 * 0.1;
        [2.0 * x as f32 / SIDE as f32, 2.0 * y as f32 / SIDE as f32, wave]
    };
    let square = |x: u32, y: u32| {
        let corners = [point(x, y), point(x + 1, y), point(x, y + 1), point(x + 1, y + 1)];
        [0, 1, 2, 2, 1, 3].map(|corner| corners[corner])
    };
    (0..SIDE * SIDE).flat_map(|at| square(at % SIDE, at / SIDE)).collect()
}

/// Creates the buffer of a sheet.
pub fn mesh_buffer(ctx: &Context, phase: u32) -> Result<Holder<BufferHandle>> {
    ctx.create_buffer(&BufferDesc {
        data: Some(bytemuck::cast_slice(&sheet(phase))),
        usage: BufferUsage::ACCEL_INPUT,
        debug_name: "sheet",
        ..Default::default()
    })
}

/// Creates the BLAS of a sheet.
pub fn blas(ctx: &Context, vertices: BufferHandle, flags: BuildFlags) -> Result<Holder<AccelStructHandle>> {
    let geometries = [BlasGeometry::Triangles(Triangles::packed(vertices, 6 * SIDE * SIDE))];
    let order = PrimitiveOrder::Given;
    ctx.create_blas(&BlasDesc {
        geometries: &geometries,
        flags,
        order,
        debug_name: "sheet",
        ..Default::default()
    })
}

fn tlas(ctx: &Context, instances: &[TlasInstance]) -> Result<Holder<AccelStructHandle>> {
    ctx.create_tlas(&TlasDesc {
        instances,
        capacity: MOST_INSTANCES,
        flags: BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE,
        debug_name: "sheets",
        ..Default::default()
    })
}

fn targets(ctx: &Context, extent: [u32; 2]) -> Result<[Holder<TextureHandle>; 2]> {
    let target = |usage| {
        let format = Format::Rgba8Unorm;
        ctx.create_texture(&TextureDesc { format, extent, usage, debug_name: "target", ..Default::default() })
    };
    Ok([
        target(TextureUsage::STORAGE | TextureUsage::SAMPLED)?,
        target(TextureUsage::TARGET | TextureUsage::SAMPLED)?,
    ])
}
