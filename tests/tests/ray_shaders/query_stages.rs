//! Ray queries in every stage of graphics and compute pipelines. Each sees the builds, refits and TLAS updates before
//! it, of earlier submissions and of its own command buffer, without a barrier and without a declared acceleration
//! acceleration structure.

use bytemuck::NoUninit;
use lvk::glam::{Affine3A, Vec3};
use lvk::{
    AccelStructHandle, BufferDesc, BufferHandle, BuildFlags, BuildMode, ColorAttachment, CommandBuffer,
    ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, Error, Format, Holder, RenderPassDesc,
    RenderPipelineDesc, RenderPipelineHandle, Result, ShaderStage, TextureHandle, Topology,
};
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::raster::{pixels, target};
use lvk_tests::ray_scene::{GpuScene, Layout, Part, Placed, RayScene, instances};
use lvk_tests::ray_tracer::{BACK, FRONT, HitRecord, MISSED, shader};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::reference::{Answer, HitIds};
use lvk_tests::vertex_deform::{VertexDeformer, deformed};
use lvk_tests::{TestDevice, device};

/// One ray for each pixel of a square.
const SIDE: u32 = 32;
const COUNT: u32 = SIDE * SIDE;
/// Invocations of a workgroup; each traces one ray.
const GROUP: u32 = 32;
const UPDATABLE: BuildFlags = BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE);

/// Code of every stage: `found` traces a ray and packs the hit into a texel.
const TRACE: &str = r"
    #include <lvk/ray_query.glsl>
    struct Ray { vec3 origin; float tMin; vec3 direction; float tMax; };
    layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Rays { Ray at[]; };
    layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Texels { vec4 at[]; };
    layout(push_constant, scalar) uniform Push { Rays rays; Texels texels; uint tlas; };
    const uint kSide = 32;

    vec4 found(uint index) {
        Ray ray = rays.at[index];
        LvkRayQuery rq;
        lvkRayQueryInitialize(rq, tlas, LVK_RAY_FLAG_OPAQUE, 0xFFu, ray.origin, ray.tMin, ray.direction, ray.tMax);
        while (lvkRayQueryProceed(rq)) {}
        if (lvkRayQueryType(rq, LVK_COMMITTED) != LVK_COMMITTED_TRIANGLE) {
            return vec4(0.0);
        }
        uint id = lvkRayQueryInstanceCustomIndex(rq, LVK_COMMITTED);
        uint code = 1 + 2 * id + uint(lvkRayQueryFrontFace(rq, LVK_COMMITTED));
        return vec4(lvkRayQueryT(rq, LVK_COMMITTED), lvkRayQueryBarycentrics(rq, LVK_COMMITTED), code);
    }

    vec4 pixel(uint index) {
        return vec4((vec2(index % kSide, index / kSide) + 0.5) / kSide * 2.0 - 1.0, 0.0, 1.0);
    }
    ";

const COMPUTE: &str = "
    layout(local_size_x = 32) in;
    void main() { texels.at[gl_GlobalInvocationID.x] = found(gl_GlobalInvocationID.x); }";

const FRAGMENT: &str = "
    layout(location = 0) out vec4 result;
    void main() { result = found(uint(gl_FragCoord.x) + kSide * uint(gl_FragCoord.y)); }";

const COVER: &str = "
    void main() {
        vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
        gl_Position = vec4(corner * 4.0 - 1.0, 0.0, 1.0);
    }";

const VERTEX: &str = "
    layout(location = 0) flat out vec4 texel;
    void main() {
        gl_Position = pixel(gl_VertexIndex);
        gl_PointSize = 1.0;
        texel = found(gl_VertexIndex);
    }";

const MESH: &str = "
    layout(local_size_x = 32) in;
    layout(points, max_vertices = 32, max_primitives = 32) out;
    layout(location = 0) flat out vec4 texel[];
    void main() {
        SetMeshOutputsEXT(32u, 32u);
        uint self = gl_LocalInvocationIndex;
        gl_MeshVerticesEXT[self].gl_Position = pixel(gl_GlobalInvocationID.x);
        gl_MeshVerticesEXT[self].gl_PointSize = 1.0;
        gl_PrimitivePointIndicesEXT[self] = self;
        texel[self] = found(gl_GlobalInvocationID.x);
    }";

const TASK: &str = "
    layout(local_size_x = 32) in;
    struct Payload { uint first; vec4 texels[32]; };
    taskPayloadSharedEXT Payload payload;
    void main() {
        payload.first = gl_WorkGroupID.x * 32;
        payload.texels[gl_LocalInvocationIndex] = found(gl_GlobalInvocationID.x);
        EmitMeshTasksEXT(1, 1, 1);
    }";

/// Shows what the task shader found.
const SHOW_PAYLOAD: &str = "
    layout(local_size_x = 32) in;
    layout(points, max_vertices = 32, max_primitives = 32) out;
    layout(location = 0) flat out vec4 texel[];
    struct Payload { uint first; vec4 texels[32]; };
    taskPayloadSharedEXT Payload payload;
    void main() {
        const uint kSide = 32;
        SetMeshOutputsEXT(32u, 32u);
        uint self = gl_LocalInvocationIndex;
        uint index = payload.first + self;
        vec2 at = (vec2(index % kSide, index / kSide) + 0.5) / kSide * 2.0 - 1.0;
        gl_MeshVerticesEXT[self].gl_Position = vec4(at, 0.0, 1.0);
        gl_MeshVerticesEXT[self].gl_PointSize = 1.0;
        gl_PrimitivePointIndicesEXT[self] = self;
        texel[self] = payload.texels[self];
    }";

const PASS_ON: &str = "
    layout(location = 0) flat in vec4 texel;
    layout(location = 0) out vec4 result;
    void main() { result = texel; }";

#[repr(C)]
#[derive(Clone, Copy, NoUninit)]
struct Push {
    rays: u64,
    texels: u64,
    tlas: u32,
    pad: u32,
}

enum Pipeline {
    Compute(Holder<ComputePipelineHandle>),
    Render(Holder<RenderPipelineHandle>),
}

/// Memory of the texels of one trace of all rays.
enum Texels {
    Buffer(Holder<BufferHandle>),
    Target(Holder<TextureHandle>),
}

/// Traces by queries in one stage.
struct Prober {
    ctx: Context,
    stage: ShaderStage,
    pipeline: Pipeline,
    rays: Vec<Ray>,
    uploaded: Holder<BufferHandle>,
}

impl Prober {
    fn new(ctx: &Context, stage: ShaderStage) -> Result<Self> {
        let rays = random_rays(53, COUNT as usize, Vec3::splat(-1.5), Vec3::splat(1.5));
        let data = Some(bytemuck::cast_slice(&rays));
        let uploaded = ctx.create_buffer(&BufferDesc { data, debug_name: "rays", ..Default::default() })?;
        let pipeline = if stage == ShaderStage::Compute {
            let module = shader(ctx, stage, &format!("{TRACE}{COMPUTE}"))?;
            let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
            Pipeline::Compute(ctx.create_compute_pipeline(&desc)?)
        } else {
            Pipeline::Render(render_pipeline(ctx, stage)?)
        };
        Ok(Self { ctx: ctx.clone(), stage, pipeline, rays, uploaded })
    }

    fn texels(&self) -> Result<Texels> {
        if let Pipeline::Render(_) = self.pipeline {
            return Ok(Texels::Target(target(&self.ctx, Format::Rgba32Float, [SIDE, SIDE])));
        }
        let desc = BufferDesc { size_bytes: 16 * u64::from(COUNT), ..Default::default() };
        Ok(Texels::Buffer(self.ctx.create_buffer(&desc)?))
    }

    /// Records a trace; the pass, where there is one, declares `declared` and nothing else.
    fn record(
        &self,
        cmd: &mut CommandBuffer,
        tlas: &Holder<AccelStructHandle>,
        texels: &Texels,
        declared: &[AccelStructHandle],
    ) -> Result<()> {
        let (rays, tlas) = (self.ctx.buffer_address(*self.uploaded)?, tlas.index());
        match (&self.pipeline, texels) {
            (Pipeline::Compute(pipeline), Texels::Buffer(buffer)) => {
                cmd.bind_compute_pipeline(**pipeline)?;
                let texels = self.ctx.buffer_address(**buffer)?;
                cmd.push_constants(&Push { rays, texels, tlas, pad: 0 })?;
                let writes = Dependencies { buffers: &[**buffer], ..Default::default() };
                cmd.dispatch([COUNT / GROUP, 1, 1], &writes)
            }
            (Pipeline::Render(pipeline), Texels::Target(target)) => {
                let color = [ColorAttachment::clear(**target, [-1.0; 4])];
                let dependencies = Dependencies { acceleration_structures: declared, ..Default::default() };
                let desc = RenderPassDesc { color: &color, dependencies, ..Default::default() };
                let mut pass = cmd.begin_rendering(&desc)?;
                pass.bind_render_pipeline(**pipeline)?;
                pass.push_constants(&Push { rays, texels: 0, tlas, pad: 0 })?;
                match self.stage {
                    ShaderStage::Fragment => pass.draw(0..3, 0..1),
                    ShaderStage::Vertex => pass.draw(0..COUNT, 0..1),
                    _ => pass.draw_mesh_tasks([COUNT / GROUP, 1, 1]),
                }
            }
            _ => unreachable!("the texels were made by `texels`"),
        }
    }

    /// Waits, and compares what was found with the reference.
    fn check(&self, what: &str, texels: &Texels, scene: &RayScene) -> Result<()> {
        let found = match texels {
            Texels::Target(target) => pixels::<[f32; 4]>(&self.ctx, **target),
            Texels::Buffer(buffer) => {
                let mut found = vec![[0.0_f32; 4]; COUNT as usize];
                self.ctx.download_buffer(**buffer, 0, bytemuck::cast_slice_mut(&mut found))?;
                found
            }
        };
        let records: Vec<HitRecord> = found.into_iter().map(unpacked).collect();
        let reference = scene.reference();
        let answer = |ray: &Ray| without_places(reference.closest(ray, 0xff));
        HitComparison::of_triangles(&self.rays, &records, answer)
            .assert(&format!("{what}, by {:?}", self.stage));
        Ok(())
    }

    /// Traces in a submission of its own and compares.
    fn check_now(&self, what: &str, gpu: &GpuScene, scene: &RayScene) -> Result<()> {
        let texels = self.texels()?;
        let mut cmd = self.ctx.acquire_command_buffer()?;
        self.record(&mut cmd, &gpu.tlas, &texels, &[])?;
        self.ctx.submit(cmd)?;
        self.check(what, &texels, scene)
    }
}

fn render_pipeline(ctx: &Context, stage: ShaderStage) -> Result<Holder<RenderPipelineHandle>> {
    let make = |stage, text: &str| shader(ctx, stage, text);
    let tracing = |text: &str| make(stage, &format!("{TRACE}{text}"));
    let (vertex, task, mesh, fragment) = match stage {
        ShaderStage::Vertex => (Some(tracing(VERTEX)?), None, None, make(ShaderStage::Fragment, PASS_ON)?),
        ShaderStage::Fragment => (Some(make(ShaderStage::Vertex, COVER)?), None, None, tracing(FRAGMENT)?),
        ShaderStage::Mesh => (None, None, Some(tracing(MESH)?), make(ShaderStage::Fragment, PASS_ON)?),
        _ => {
            let mesh = make(ShaderStage::Mesh, SHOW_PAYLOAD)?;
            (None, Some(tracing(TASK)?), Some(mesh), make(ShaderStage::Fragment, PASS_ON)?)
        }
    };
    ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: vertex.as_deref().copied(),
        task: task.as_deref().copied(),
        mesh: mesh.as_deref().copied(),
        fragment: Some(*fragment),
        topology: if stage == ShaderStage::Fragment { Topology::Triangles } else { Topology::Points },
        color: &[Format::Rgba32Float.into()],
        debug_name: "queries",
        ..Default::default()
    })
}

fn unpacked([t, u, v, code]: [f32; 4]) -> HitRecord {
    let code = code as u32;
    let hit = code.checked_sub(1);
    HitRecord {
        t,
        barycentrics: [u, v],
        kind: hit.map_or(MISSED, |hit| if hit % 2 == 1 { FRONT } else { BACK }),
        instance: 0,
        custom_index: hit.unwrap_or(0) / 2,
        geometry: 0,
        primitive: 0,
    }
}

/// Values that the texels do not store count as 0.
fn without_places(answer: Answer) -> Answer {
    let hit = answer.hit.map(|hit| {
        let ids = HitIds { instance: 0, geometry: 0, primitive: 0, custom_index: hit.ids.custom_index };
        lvk_tests::reference::Hit { ids, ..hit }
    });
    Answer { hit, ..answer }
}

/// A deforming torus, and room to show it several times.
struct Stage {
    prober: Prober,
    deformer: VertexDeformer,
    scene: RayScene,
    gpu: GpuScene,
    /// Declared last: its end judges that of everything else.
    ctx: TestDevice,
}

impl Stage {
    /// `None` where the device lacks what the stage needs.
    fn new(stage: ShaderStage) -> Result<Option<Self>> {
        let Some(ctx) = device() else { return Ok(None) };
        let caps = ctx.capabilities();
        let needs_mesh = matches!(stage, ShaderStage::Task | ShaderStage::Mesh);
        if !caps.ray_query || (needs_mesh && !caps.mesh_shader) {
            eprintln!("NOT TESTED, {} has no ray queries in the {stage:?} stage", caps.device_name);
            return Ok(None);
        }
        let scene = RayScene {
            models: vec![vec![Part::new(Mesh::torus(8), Layout::Indexed16)]],
            placed: vec![Placed { custom_index: 3, ..Placed::new(0, Affine3A::IDENTITY) }],
        };
        let gpu = scene.upload_with(&ctx, UPDATABLE, UPDATABLE, 4)?;
        let deformer = VertexDeformer::new(&ctx)?;
        let prober = Prober::new(&ctx, stage)?;
        Ok(Some(Self { prober, deformer, scene, gpu, ctx }))
    }

    /// Moves the vertices by a dispatch and builds from them.
    fn deform(&mut self, cmd: &mut CommandBuffer, amount: f32, mode: BuildMode) -> Result<()> {
        let (vertices, mesh) = (*self.gpu.buffers[0].vertices, &mut self.scene.models[0][0].mesh);
        self.deformer.record(cmd, vertices, mesh, amount)?;
        cmd.build_blas(&[*self.gpu.models[0]], mode)?;
        *mesh = deformed(mesh, amount);
        Ok(())
    }

    /// Shows `count` instances, turned.
    fn update_tlas(&mut self, cmd: &mut CommandBuffer, count: u32, turn: f32, mode: BuildMode) -> Result<()> {
        let place = |index: u32| {
            let to = Vec3::new(0.3 * index as f32, 0.2 - 0.4 * index as f32, 0.1);
            let transform = Affine3A::from_translation(to) * Affine3A::from_rotation_x(turn + index as f32);
            Placed { custom_index: 10 * count + index, ..Placed::new(0, transform) }
        };
        self.scene.placed = (0..count).map(place).collect();
        cmd.update_tlas(*self.gpu.tlas, &instances(&self.scene.placed, &self.gpu.models), mode)
    }

    fn builds_of_earlier_submissions_are_seen(&mut self) -> Result<()> {
        self.prober.check_now("the first build", &self.gpu, &self.scene)?;
        let mut cmd = self.ctx.acquire_command_buffer()?;
        self.deform(&mut cmd, 0.3, BuildMode::Refit)?;
        self.update_tlas(&mut cmd, 1, 0.0, BuildMode::Refit)?;
        self.ctx.submit(cmd)?;
        self.prober.check_now("a refit submitted before", &self.gpu, &self.scene)
    }

    fn builds_of_the_same_command_buffer_are_seen(&mut self) -> Result<()> {
        let steps = [(0.3, BuildMode::Refit), (-0.5, BuildMode::Refit), (0.4, BuildMode::Rebuild)];
        for (amount, mode) in steps {
            let texels = self.prober.texels()?;
            let mut cmd = self.ctx.acquire_command_buffer()?;
            self.deform(&mut cmd, amount, mode)?;
            self.update_tlas(&mut cmd, 1, amount, mode)?;
            self.prober.record(&mut cmd, &self.gpu.tlas, &texels, &[])?;
            self.ctx.submit(cmd)?;
            self.prober.check(&format!("deformed by {amount}, {mode:?}"), &texels, &self.scene)?;
        }
        Ok(())
    }

    /// Queries between updates see what was shown last, and the next update waits for them.
    fn updates_between_queries_keep_their_order(&mut self) -> Result<()> {
        let shown = [
            (3, 0.2, BuildMode::Rebuild),
            (3, 0.9, BuildMode::Refit),
            (1, 1.4, BuildMode::Rebuild),
            (2, 0.5, BuildMode::Rebuild),
        ];
        let mut cmd = self.ctx.acquire_command_buffer()?;
        let mut expected = Vec::new();
        for (count, turn, mode) in shown {
            self.update_tlas(&mut cmd, count, turn, mode)?;
            let texels = self.prober.texels()?;
            self.prober.record(&mut cmd, &self.gpu.tlas, &texels, &[])?;
            expected.push((texels, self.scene.clone()));
        }
        let texels = self.prober.texels()?;
        self.prober.record(&mut cmd, &self.gpu.tlas, &texels, &[*self.gpu.tlas])?;
        expected.push((texels, self.scene.clone()));
        self.ctx.submit(cmd)?;
        for (step, (texels, scene)) in expected.iter().enumerate() {
            self.prober.check(&format!("update {step}"), texels, scene)?;
        }
        Ok(())
    }

    fn everything_is_seen(stage: ShaderStage) -> Result<()> {
        let Some(mut stage) = Self::new(stage)? else { return Ok(()) };
        stage.builds_of_earlier_submissions_are_seen()?;
        stage.builds_of_the_same_command_buffer_are_seen()?;
        stage.updates_between_queries_keep_their_order()
    }
}

/// Declares a test for each stage.
macro_rules! queries_see_what_was_built {
    ($($test:ident: $stage:ident;)*) => {
        $(#[test]
        fn $test() -> Result<()> {
            Stage::everything_is_seen(ShaderStage::$stage)
        })*
    };
}

queries_see_what_was_built! {
    queries_of_the_compute_stage_see_what_was_built: Compute;
    queries_of_the_vertex_stage_see_what_was_built: Vertex;
    queries_of_the_fragment_stage_see_what_was_built: Fragment;
    queries_of_the_mesh_stage_see_what_was_built: Mesh;
    queries_of_the_task_stage_see_what_was_built: Task;
}

/// No pipeline queries rays when the pass begins behind a build, so that only a declared acceleration structure is waited for.
#[test]
fn a_pipeline_made_inside_of_a_pass_needs_the_accel_struct_declared() -> Result<()> {
    for is_declared in [false, true] {
        let Some(mut stage) = Stage::new(ShaderStage::Compute)? else { return Ok(()) };
        let texels = target(&stage.ctx, Format::Rgba32Float, [SIDE, SIDE]);
        let color = [ColorAttachment::clear(*texels, [0.0; 4])];
        let plain = RenderPassDesc { color: &color, ..Default::default() };
        let tlas = [*stage.gpu.tlas];
        let declared = Dependencies {
            acceleration_structures: if is_declared { &tlas } else { &[] },
            ..Default::default()
        };
        let mut cmd = stage.ctx.acquire_command_buffer()?;
        stage.update_tlas(&mut cmd, 1, 0.3, BuildMode::Refit)?;
        let mut pass = cmd.begin_rendering(&RenderPassDesc { dependencies: declared, ..plain })?;
        let pipeline = render_pipeline(&stage.ctx, ShaderStage::Fragment)?;
        match pass.bind_render_pipeline(*pipeline) {
            Ok(()) => assert!(is_declared, "nothing waited for the build"),
            Err(Error::InvalidUsage { message, .. }) => {
                assert!(!is_declared && message.contains("before the pass begins"), "{message}");
            }
            Err(other) => return Err(other),
        }
        drop(pass);
        cmd.begin_rendering(&plain)?.bind_render_pipeline(*pipeline)?;
        stage.ctx.submit(cmd)?;
    }
    Ok(())
}
