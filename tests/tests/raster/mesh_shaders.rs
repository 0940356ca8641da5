//! Draws with task and mesh shaders, against draws with vertex shaders and against the CPU.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::sync::LazyLock;

use lvk::{
    Blend, BufferDesc, BufferHandle, BufferUsage, ColorAttachment, ColorTarget, CompareOp, Context,
    Dependencies, DepthAttachment, DepthTest, DeviceProfile, Error, Format, Holder, RenderPass,
    RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle, ShaderModuleDesc, ShaderModuleHandle,
    ShaderSource, ShaderStage, SpecializationConstant, SpecializationValue, TextureHandle, VertexAttribute,
    VertexBinding, VertexFormat,
};
use lvk_tests::compute::{compute_pipeline, module};
use lvk_tests::random::Random;
use lvk_tests::raster::{pixels, target};
use lvk_tests::{TestDevice, device, device_with};

/// A device with mesh shaders; otherwise the test says that it tests nothing.
fn mesh_device() -> Option<TestDevice> {
    let ctx = device()?;
    if !ctx.capabilities().mesh_shader {
        eprintln!("NOT TESTED, {} has no mesh shaders", ctx.capabilities().device_name);
        return None;
    }
    Some(ctx)
}

struct Shaders {
    vertex: Option<Holder<ShaderModuleHandle>>,
    task: Option<Holder<ShaderModuleHandle>>,
    mesh: Option<Holder<ShaderModuleHandle>>,
    fragment: Holder<ShaderModuleHandle>,
}

impl Shaders {
    /// Empty texts stand for none.
    fn new(ctx: &Context, vertex: &str, task: &str, mesh: &str, fragment: &str) -> Self {
        let find = |stage, text: &str| (!text.is_empty()).then(|| module(ctx, stage, text));
        Self {
            vertex: find(ShaderStage::Vertex, vertex),
            task: find(ShaderStage::Task, task),
            mesh: find(ShaderStage::Mesh, mesh),
            fragment: module(ctx, ShaderStage::Fragment, fragment),
        }
    }

    fn desc<'a>(&self, desc: &RenderPipelineDesc<'a>) -> RenderPipelineDesc<'a> {
        RenderPipelineDesc {
            vertex: self.vertex.as_deref().copied(),
            task: self.task.as_deref().copied(),
            mesh: self.mesh.as_deref().copied(),
            fragment: Some(*self.fragment),
            ..*desc
        }
    }

    fn pipeline(&self, ctx: &Context, desc: &RenderPipelineDesc<'_>) -> Holder<RenderPipelineHandle> {
        ctx.create_render_pipeline(&self.desc(desc)).unwrap()
    }
}

fn buffer<T: bytemuck::NoUninit>(ctx: &Context, usage: BufferUsage, data: &[T]) -> Holder<BufferHandle> {
    let desc = BufferDesc { usage, data: Some(bytemuck::cast_slice(data)), ..Default::default() };
    ctx.create_buffer(&desc).unwrap()
}

/// Runs one pass over black in a submission of its own.
fn draw(
    ctx: &Context,
    target: TextureHandle,
    depth: Option<DepthAttachment>,
    record: impl FnOnce(&mut RenderPass<'_>) -> lvk::Result<()>,
) {
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let color = [ColorAttachment::clear(target, [0.0; 4])];
    let desc = RenderPassDesc { color: &color, depth, ..Default::default() };
    record(&mut cmd.begin_rendering(&desc).unwrap()).unwrap();
    ctx.submit(cmd).unwrap();
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::NoUninit)]
struct Soup {
    corners: u64,
    triangles: u32,
    pad: u32,
}

/// Declarations of both ways to draw a triangle soup: four floats a corner, the last one a shade.
const SOUP: &str = "
    layout(buffer_reference, scalar) readonly buffer Corners { vec4 at[]; };
    layout(push_constant, scalar) uniform Push { Corners corners; uint triangles; };
    vec4 tint(uint triangle) { return vec4(triangle % 3, triangle % 5, triangle % 7, 8) / vec4(2, 4, 6, 8); }
    ";

const SOUP_VERTEX: &str = "
    layout(location = 0) out float shade;
    layout(location = 1) flat out vec4 color;
    void main() {
        vec4 corner = corners.at[gl_VertexIndex];
        gl_Position = vec4(corner.xyz, 1.0);
        shade = corner.w;
        color = tint(gl_VertexIndex / 3);
    }";

/// Up to 8 triangles a workgroup, the last one may have fewer.
const SOUP_MESH: &str = "
    layout(local_size_x = 8) in;
    layout(triangles, max_vertices = 24, max_primitives = 8) out;
    layout(location = 0) out float shade[];
    layout(location = 1) perprimitiveEXT out vec4 color[];
    void main() {
        uint first = gl_WorkGroupID.x * 8;
        uint count = min(triangles - first, 8u);
        SetMeshOutputsEXT(3 * count, count);
        uint self = gl_LocalInvocationIndex;
        if (self >= count) {
            return;
        }
        for (uint corner = 3 * self; corner < 3 * self + 3; ++corner) {
            vec4 at = corners.at[3 * first + corner];
            gl_MeshVerticesEXT[corner].gl_Position = vec4(at.xyz, 1.0);
            shade[corner] = at.w;
        }
        gl_PrimitiveTriangleIndicesEXT[self] = 3 * self + uvec3(0, 1, 2);
        color[self] = tint(first + self);
    }";

fn soup_fragment(qualifier: &str) -> String {
    format!(
        "#extension GL_EXT_mesh_shader : require
         layout(location = 0) in float shade;
         layout(location = 1) {qualifier} in vec4 color;
         layout(location = 0) out vec4 result;
         void main() {{ result = vec4(color.rgb * shade, 1.0); }}"
    )
}

#[test]
fn a_mesh_shader_draws_what_a_vertex_shader_draws() {
    const TRIANGLES: u32 = 45;
    const SIZE: [u32; 2] = [64, 48];
    let Some(ctx) = mesh_device() else { return };
    let mut random = Random::new(5);
    let mut corner = |_| {
        [
            random.between(-1.0, 1.0),
            random.between(-1.0, 1.0),
            random.between(0.0, 1.0),
            random.between(0.2, 1.0),
        ]
    };
    let corners: Vec<[f32; 4]> = (0..3 * TRIANGLES).map(&mut corner).collect();
    let corners = buffer(&ctx, BufferUsage::STORAGE, &corners);
    let push = Soup { corners: ctx.buffer_address(*corners).unwrap(), triangles: TRIANGLES, pad: 0 };
    let depth_test = DepthTest { format: Format::D32Float, compare: CompareOp::Less, write: true };
    let desc = RenderPipelineDesc {
        color: &[Format::Rgba8Unorm.into()],
        depth: Some(depth_test),
        ..Default::default()
    };
    let render = |shaders: &Shaders| {
        let pipeline = shaders.pipeline(&ctx, &desc);
        let (color, depth) = (target(&ctx, Format::Rgba8Unorm, SIZE), target(&ctx, Format::D32Float, SIZE));
        draw(&ctx, *color, Some(DepthAttachment::clear(*depth, 1.0)), |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            pass.push_constants(&push)?;
            match &shaders.mesh {
                Some(_) => pass.draw_mesh_tasks([TRIANGLES.div_ceil(8), 1, 1]),
                None => pass.draw(0..3 * TRIANGLES, 0..1),
            }
        });
        (pixels::<[u8; 4]>(&ctx, *color), pixels::<f32>(&ctx, *depth))
    };
    let (flat, each) = (soup_fragment("flat"), soup_fragment("perprimitiveEXT"));
    let by_vertices = render(&Shaders::new(&ctx, &format!("{SOUP}{SOUP_VERTEX}"), "", "", &flat));
    let by_mesh = render(&Shaders::new(&ctx, "", "", &format!("{SOUP}{SOUP_MESH}"), &each));
    let colors: std::collections::HashSet<_> = by_vertices.0.iter().collect();
    assert!(colors.len() > 100, "{} colours test little", colors.len());
    let bytes = by_mesh.0.as_flattened().iter().zip(by_vertices.0.as_flattened());
    assert_eq!(bytes.filter(|(a, b)| a.abs_diff(**b) > 1).count(), 0, "the images differ");
    let depths = by_mesh.1.iter().zip(&by_vertices.1);
    assert_eq!(depths.filter(|(a, b)| (*a - *b).abs() > 1e-6).count(), 0, "the depths differ");
}

/// Lets a mesh workgroup fill one cell of a grid with a value.
const CELL: &str = "
    layout(local_size_x = 1) in;
    layout(triangles, max_vertices = 4, max_primitives = 2) out;
    layout(location = 0) flat out uint number[];
    void fill(uint cell, uint row, uvec2 cells, uint value) {
        SetMeshOutputsEXT(4, 2);
        for (uint corner = 0; corner < 4; ++corner) {
            vec2 at = vec2(uvec2(cell, row) + uvec2(corner & 1, corner >> 1)) / vec2(cells);
            gl_MeshVerticesEXT[corner].gl_Position = vec4(at * 2.0 - 1.0, 0.0, 1.0);
            number[corner] = value;
        }
        gl_PrimitiveTriangleIndicesEXT[0] = uvec3(0, 1, 2);
        gl_PrimitiveTriangleIndicesEXT[1] = uvec3(2, 1, 3);
    }
    ";

const NUMBER: &str = "
    layout(location = 0) flat in uint number;
    layout(location = 0) out vec4 result;
    void main() { result = vec4(number / 255.0); }";

fn first_bytes(ctx: &Context, target: TextureHandle) -> Vec<u8> {
    pixels::<[u8; 4]>(ctx, target).iter().map(|pixel| pixel[0]).collect()
}

const PLAIN: ColorTarget = ColorTarget::new(Format::Rgba8Unorm);
const ADDING: ColorTarget = ColorTarget::blended(Format::Rgba8Unorm, Blend::ADDITIVE);

#[test]
fn a_task_shader_decides_how_many_mesh_workgroups_run() {
    let Some(ctx) = mesh_device() else { return };
    // Task workgroup n starts n mesh workgroups: cells 0, then 1 and 2, then 3 to 5, and the payload says from where.
    let task = "
        layout(local_size_x = 4) in;
        struct Payload { uint first; uint of[4]; };
        taskPayloadSharedEXT Payload payload;
        void main() {
            uint n = gl_WorkGroupID.x;
            payload.of[gl_LocalInvocationIndex] = 10 * n + gl_LocalInvocationIndex;
            if (gl_LocalInvocationIndex == 0) {
                payload.first = n * (n - 1) / 2;
            }
            EmitMeshTasksEXT(n, 1, 1);
        }";
    let mesh = format!(
        "{CELL}
        struct Payload {{ uint first; uint of[4]; }};
        taskPayloadSharedEXT Payload payload;
        void main() {{
            uint self = gl_WorkGroupID.x;
            fill(payload.first + self, 0, uvec2(8, 1), payload.of[self] + 1);
        }}"
    );
    let desc = RenderPipelineDesc { color: &[PLAIN], ..Default::default() };
    let pipeline = Shaders::new(&ctx, "", task, &mesh, NUMBER).pipeline(&ctx, &desc);
    let row = target(&ctx, Format::Rgba8Unorm, [8, 1]);
    draw(&ctx, *row, None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.draw_mesh_tasks([4, 1, 1])?;
        pass.draw_mesh_tasks([0, 1, 1])
    });
    assert_eq!(first_bytes(&ctx, *row), [11, 21, 22, 31, 32, 33, 0, 0]);
    let arguments = buffer(&ctx, BufferUsage::INDIRECT, &[3, 1, 1_u32]);
    draw(&ctx, *row, None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.draw_mesh_tasks_indirect(*arguments, 0, 1, 12)
    });
    assert_eq!(first_bytes(&ctx, *row), [11, 21, 22, 0, 0, 0, 0, 0]);
}

/// Each workgroup adds one to the cell at its x and y.
fn counting_pipeline(ctx: &Context) -> Holder<RenderPipelineHandle> {
    let mesh = format!("{CELL} void main() {{ fill(gl_WorkGroupID.x, gl_WorkGroupID.y, uvec2(4, 3), 1); }}");
    let desc = RenderPipelineDesc { color: &[ADDING], debug_name: "counting", ..Default::default() };
    Shaders::new(ctx, "", "", &mesh, NUMBER).pipeline(ctx, &desc)
}

#[test]
fn workgroups_of_all_axes_run() {
    let Some(ctx) = mesh_device() else { return };
    let pipeline = counting_pipeline(&ctx);
    let cells = target(&ctx, Format::Rgba8Unorm, [4, 3]);
    draw(&ctx, *cells, None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.draw_mesh_tasks([3, 2, 5])?;
        pass.draw_mesh_tasks([1, 3, 1])
    });
    assert_eq!(first_bytes(&ctx, *cells), [6, 5, 5, 0, 6, 5, 5, 0, 1, 0, 0, 0]);
}

#[test]
fn arguments_of_mesh_draws_come_from_buffers() {
    let Some(ctx) = mesh_device() else { return };
    let pipeline = counting_pipeline(&ctx);
    let cells = target(&ctx, Format::Rgba8Unorm, [4, 3]);
    let arguments = buffer(&ctx, BufferUsage::INDIRECT, &[99, 1, 1, 1, 0, 2, 2, 1, 0, 4, 3, 1_u32]);
    draw(&ctx, *cells, None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.draw_mesh_tasks_indirect(*arguments, 4, 3, 16)?;
        pass.draw_mesh_tasks_indirect(*arguments, 4, 0, 16)
    });
    assert_eq!(first_bytes(&ctx, *cells), [3, 2, 1, 1, 2, 2, 1, 1, 1, 1, 1, 1]);
}

#[test]
fn arguments_may_be_written_by_a_dispatch_before_the_pass() {
    let Some(ctx) = mesh_device() else { return };
    let write = compute_pipeline(
        &ctx,
        "layout(local_size_x = 1) in;
         layout(buffer_reference, scalar) writeonly buffer Arguments { uint groups[3]; };
         layout(push_constant, scalar) uniform Push { Arguments arguments; };
         void main() { arguments.groups = uint[](2, 3, 1); }",
    );
    let pipeline = counting_pipeline(&ctx);
    let cells = target(&ctx, Format::Rgba8Unorm, [4, 3]);
    let arguments = buffer(&ctx, BufferUsage::INDIRECT | BufferUsage::STORAGE, &[0_u32; 3]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*write).unwrap();
    cmd.push_constants(&ctx.buffer_address(*arguments).unwrap()).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*arguments], ..Default::default() }).unwrap();
    let color = [ColorAttachment::clear(*cells, [0.0; 4])];
    let plain = RenderPassDesc { color: &color, ..Default::default() };
    {
        let mut pass = cmd.begin_rendering(&plain).unwrap();
        pass.bind_render_pipeline(*pipeline).unwrap();
        let forgotten = pass.draw_mesh_tasks_indirect(*arguments, 0, 1, 12);
        usage_error(forgotten, "list it in the pass's dependencies");
    }
    let dependencies = Dependencies { read_buffers: &[*arguments], ..Default::default() };
    {
        let mut pass = cmd.begin_rendering(&RenderPassDesc { dependencies, ..plain }).unwrap();
        pass.bind_render_pipeline(*pipeline).unwrap();
        pass.draw_mesh_tasks_indirect(*arguments, 0, 1, 12).unwrap();
    }
    ctx.submit(cmd).unwrap();
    assert_eq!(first_bytes(&ctx, *cells), [1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0]);
}

/// The mesh stage reads by address what a dispatch wrote, and a dispatch reads what the mesh stage wrote.
#[test]
fn buffers_flow_into_and_out_of_the_mesh_stage() {
    let Some(ctx) = mesh_device() else { return };
    let numbers = "
        layout(buffer_reference, scalar) buffer Numbers { uint at[8]; };
        layout(push_constant, scalar) uniform Push { Numbers numbers; };";
    let step = |expression: &str| {
        let body = format!("void main() {{ uint i = gl_GlobalInvocationID.x; {expression} }}");
        compute_pipeline(&ctx, &format!("layout(local_size_x = 8) in; {numbers} {body}"))
    };
    let (fill, double) = (step("numbers.at[i] = i;"), step("numbers.at[i] *= 2;"));
    let mesh = format!(
        "{CELL} {numbers} void main() {{
            uint i = gl_WorkGroupID.x;
            uint number = numbers.at[i];
            numbers.at[i] = number + 100;
            fill(i, 0, uvec2(8, 1), number);
        }}"
    );
    let desc = RenderPipelineDesc { color: &[PLAIN], ..Default::default() };
    let pipeline = Shaders::new(&ctx, "", "", &mesh, NUMBER).pipeline(&ctx, &desc);
    let row = target(&ctx, Format::Rgba8Unorm, [8, 1]);
    let buffer = buffer(&ctx, BufferUsage::STORAGE, &[7_u32; 8]);
    let address = ctx.buffer_address(*buffer).unwrap();
    let writes = Dependencies { buffers: &[*buffer], ..Default::default() };
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*fill).unwrap();
    cmd.push_constants(&address).unwrap();
    cmd.dispatch([1, 1, 1], &writes).unwrap();
    {
        let color = [ColorAttachment::clear(*row, [0.0; 4])];
        let desc = RenderPassDesc { color: &color, dependencies: writes, ..Default::default() };
        let mut pass = cmd.begin_rendering(&desc).unwrap();
        pass.bind_render_pipeline(*pipeline).unwrap();
        pass.draw_mesh_tasks([8, 1, 1]).unwrap();
    }
    cmd.bind_compute_pipeline(*double).unwrap();
    cmd.dispatch([1, 1, 1], &writes).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(first_bytes(&ctx, *row), [0, 1, 2, 3, 4, 5, 6, 7]);
    let mut found = [0_u32; 8];
    ctx.download_buffer(*buffer, 0, bytemuck::cast_slice_mut(&mut found)).unwrap();
    assert_eq!(found, [200, 202, 204, 206, 208, 210, 212, 214]);
}

fn usage_error<T: std::fmt::Debug>(result: lvk::Result<T>, words: &str) {
    match result {
        Err(Error::InvalidUsage { object, message }) => {
            let text = format!("{object}: {message}");
            assert!(text.contains(words), "'{text}' does not say '{words}'");
        }
        other => unreachable!("expected an error that says '{words}', not {other:?}"),
    }
}

const EMPTY_MESH: &str = "
    layout(local_size_x = 1) in;
    layout(points, max_vertices = 1, max_primitives = 1) out;
    void main() { SetMeshOutputsEXT(0u, 0u); }";
const EMPTY_TASK: &str = "layout(local_size_x = 1) in; void main() { EmitMeshTasksEXT(0, 0, 0); }";
const VERTEX: &str = "void main() { gl_Position = vec4(0.0); }";
const WHITE: &str = "layout(location = 0) out vec4 result; void main() { result = vec4(1.0); }";

#[test]
fn stages_that_do_not_go_together_are_refused() {
    let Some(ctx) = mesh_device() else { return };
    let all = Shaders::new(&ctx, VERTEX, EMPTY_TASK, EMPTY_MESH, WHITE);
    let base = RenderPipelineDesc { color: &[PLAIN], debug_name: "odd one", ..Default::default() };
    let full = all.desc(&base);
    let refuse = |desc: RenderPipelineDesc<'_>, words: &str| {
        usage_error(ctx.create_render_pipeline(&desc), words);
    };
    refuse(full, "odd one: a mesh shader takes the place of the vertex shader");
    refuse(RenderPipelineDesc { task: None, ..full }, "takes the place of the vertex shader");
    refuse(RenderPipelineDesc { mesh: None, ..full }, "a task shader feeds a mesh shader");
    refuse(RenderPipelineDesc { vertex: None, mesh: None, ..full }, "a task shader needs a mesh shader");
    refuse(RenderPipelineDesc { vertex: None, mesh: None, task: None, ..full }, "a vertex shader or a mesh");
    let mesh = RenderPipelineDesc { vertex: None, ..full };
    let bindings = [VertexBinding { stride: 4, per_instance: false }];
    refuse(RenderPipelineDesc { vertex_bindings: &bindings, ..mesh }, "no vertex buffers");
    let attribute = VertexAttribute { location: 0, binding: 0, format: VertexFormat::F32, offset: 0 };
    refuse(RenderPipelineDesc { vertex_attributes: &[attribute], ..mesh }, "no vertex buffers");
    refuse(RenderPipelineDesc { mesh: all.vertex.as_deref().copied(), ..mesh }, "a Mesh module is needed");
    refuse(RenderPipelineDesc { task: mesh.mesh, ..mesh }, "a Task module is needed");
    refuse(
        RenderPipelineDesc { mesh: None, task: None, vertex: mesh.mesh, ..mesh },
        "a Vertex module is needed",
    );
    for good in [mesh, RenderPipelineDesc { task: None, ..mesh }] {
        drop(ctx.create_render_pipeline(&good).unwrap());
    }
}

#[test]
fn workgroups_and_outputs_beyond_the_device_are_refused() {
    let Some(ctx) = mesh_device() else { return };
    let limits = ctx.capabilities().limits.mesh;
    let sized = "
        layout(local_size_x_id = 3) in;
        layout(points, max_vertices = 1, max_primitives = 1) out;
        void main() { SetMeshOutputsEXT(0u, 0u); }";
    let sized_task = "layout(local_size_x_id = 4) in; void main() { EmitMeshTasksEXT(0, 0, 0); }";
    let shaders = Shaders::new(&ctx, "", sized_task, sized, WHITE);
    let make = |mesh: u32, task: u32| {
        let constant = |id, value| SpecializationConstant { id, value: SpecializationValue::U32(value) };
        let specialization = [constant(3, mesh), constant(4, task)];
        let desc =
            RenderPipelineDesc { color: &[PLAIN], specialization: &specialization, ..Default::default() };
        ctx.create_render_pipeline(&shaders.desc(&desc)).map(drop)
    };
    make(limits.max_mesh_workgroup_size[0].min(limits.max_mesh_invocations), 1).unwrap();
    let exceeded = |result: lvk::Result<()>| matches!(result, Err(Error::LimitExceeded { .. }));
    assert!(exceeded(make(limits.max_mesh_workgroup_size[0] + 1, 1)));
    assert!(exceeded(make(1, limits.max_task_workgroup_size[0] + 1)));
    assert!(matches!(make(0, 1), Err(Error::InvalidUsage { .. })));
}

#[test]
fn payloads_and_shared_memory_beyond_the_device_are_refused() {
    let Some(ctx) = mesh_device() else { return };
    let limits = ctx.capabilities().limits.mesh;
    let task = "layout(local_size_x = 1) in;
        layout(constant_id = 5) const uint kHanded = 1;
        layout(constant_id = 6) const uint kShared = 1;
        struct Payload { uint words[kHanded]; };
        taskPayloadSharedEXT Payload payload;
        shared uint own[kShared];
        void main() { own[0] = 1; payload.words[0] = own[0]; EmitMeshTasksEXT(1, 1, 1); }";
    let mesh = "layout(local_size_x = 1) in;
        layout(points, max_vertices = 1, max_primitives = 1) out;
        layout(constant_id = 7) const uint kMeshShared = 1;
        shared uint own[kMeshShared];
        void main() { own[0] = 1; SetMeshOutputsEXT(own[0] - 1u, 0u); }";
    let shaders = Shaders::new(&ctx, "", task, mesh, WHITE);
    let make = |words: [u32; 3]| {
        let constant = |(id, words)| SpecializationConstant { id, value: SpecializationValue::U32(words) };
        let specialization: Vec<_> = (5..).zip(words).map(constant).collect();
        let desc =
            RenderPipelineDesc { color: &[PLAIN], specialization: &specialization, ..Default::default() };
        ctx.create_render_pipeline(&shaders.desc(&desc)).map(drop)
    };
    make([1; 3]).unwrap();
    let most = [limits.max_task_payload_bytes, limits.max_task_shared_bytes, limits.max_mesh_shared_bytes];
    for (part, bytes) in most.into_iter().enumerate() {
        let mut words = [1; 3];
        words[part] = bytes / 4 + 1;
        let made = make(words);
        assert!(matches!(made, Err(Error::LimitExceeded { .. })), "{words:?}: {made:?}");
    }
}

#[test]
fn draws_that_do_not_fit_the_pipeline_are_refused() {
    let Some(ctx) = mesh_device() else { return };
    let limits = ctx.capabilities().limits.mesh;
    let desc = |debug_name| RenderPipelineDesc { color: &[PLAIN], debug_name, ..Default::default() };
    let mesh = Shaders::new(&ctx, "", "", EMPTY_MESH, WHITE).pipeline(&ctx, &desc("mesh"));
    let task = Shaders::new(&ctx, "", EMPTY_TASK, EMPTY_MESH, WHITE).pipeline(&ctx, &desc("task"));
    let vertex = Shaders::new(&ctx, VERTEX, "", "", WHITE).pipeline(&ctx, &desc("vertex"));
    let pushing = format!("layout(push_constant) uniform Push {{ uint number; }}; {EMPTY_MESH}")
        .replace("0u, 0u", "min(number, 0u), 0u");
    let pushing = Shaders::new(&ctx, "", "", &pushing, WHITE).pipeline(&ctx, &desc("pushing"));
    let arguments = buffer(&ctx, BufferUsage::INDIRECT, &[0_u32; 8]);
    let plain = buffer(&ctx, BufferUsage::STORAGE, &[0_u32; 8]);
    let target = target(&ctx, Format::Rgba8Unorm, [4, 4]);
    let color = [ColorAttachment::clear(*target, [0.5; 4])];
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
    usage_error(pass.draw_mesh_tasks([1, 1, 1]), "bind a render pipeline first");
    pass.bind_render_pipeline(*vertex).unwrap();
    usage_error(pass.draw_mesh_tasks([1, 1, 1]), "vertex: it has no mesh shader");
    usage_error(pass.draw_mesh_tasks_indirect(*arguments, 0, 1, 12), "vertex: it has no mesh shader");
    pass.bind_render_pipeline(*pushing).unwrap();
    usage_error(pass.draw_mesh_tasks([1, 1, 1]), "4 bytes of push constants");
    pass.bind_render_pipeline(*mesh).unwrap();
    usage_error(pass.draw(0..3, 0..1), "mesh: it has a mesh shader");
    usage_error(pass.draw_indexed(0..3, 0, 0..1), "mesh: it has a mesh shader");
    usage_error(pass.draw_indirect(*arguments, 0, 1, 16), "mesh: it has a mesh shader");
    usage_error(pass.draw_mesh_tasks_indirect(*arguments, 2, 1, 12), "no multiple of 4");
    usage_error(pass.draw_mesh_tasks_indirect(*arguments, 0, 2, 8), "at least 12 bytes");
    usage_error(pass.draw_mesh_tasks_indirect(*arguments, 24, 1, 12), "outside of the buffer");
    usage_error(pass.draw_mesh_tasks_indirect(*arguments, 0, 3, 12), "outside of the buffer");
    usage_error(pass.draw_mesh_tasks_indirect(*plain, 0, 1, 12), "INDIRECT");
    let exceeded = |result: lvk::Result<()>| matches!(result, Err(Error::LimitExceeded { .. }));
    for axis in 0..3 {
        let mut groups = [1; 3];
        groups[axis] = limits.max_mesh_workgroups[axis].saturating_add(1);
        assert!(exceeded(pass.draw_mesh_tasks(groups)), "{groups:?}");
    }
    assert!(exceeded(pass.draw_mesh_tasks(limits.max_mesh_workgroups)), "{limits:?}");
    pass.bind_render_pipeline(*task).unwrap();
    assert!(exceeded(pass.draw_mesh_tasks([1, limits.max_task_workgroups[1].saturating_add(1), 1])));
    drop(pass);
    ctx.submit(cmd).unwrap();
    let bytes = first_bytes(&ctx, *target);
    assert!(bytes.iter().all(|byte| (127..=128).contains(byte)), "a half, rounded either way: {bytes:?}");
}

#[test]
fn a_device_without_mesh_shaders_says_so() {
    let Some(full) = mesh_device() else { return };
    static PROFILE: LazyLock<DeviceProfile> =
        LazyLock::new(|| DeviceProfile { mesh_shader: false, ..Default::default() });
    let Some(ctx) = device_with(|desc| desc.profile = Some(&PROFILE)) else { return };
    assert!(!ctx.capabilities().mesh_shader);
    for (stage, text) in [(ShaderStage::Mesh, EMPTY_MESH), (ShaderStage::Task, EMPTY_TASK)] {
        let source = ShaderSource::Glsl(text);
        let made = ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..Default::default() });
        match made.map(drop) {
            Err(Error::Unsupported { why, .. }) => assert!(why.contains("meshShader"), "{why}"),
            other => unreachable!("{other:?}"),
        }
    }
    let foreign = module(&full, ShaderStage::Mesh, EMPTY_MESH);
    let desc = RenderPipelineDesc { mesh: Some(*foreign), color: &[PLAIN], ..Default::default() };
    assert!(matches!(ctx.create_render_pipeline(&desc).map(drop), Err(Error::Unsupported { .. })));
}
