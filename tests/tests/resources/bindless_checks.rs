//! Bindless index checks in shaders: every array and stage, by name, and no report of a valid index.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    AccelStructHandle, BindlessArray, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage,
    ColorAttachment, ColorTarget, ComputePipelineHandle, Context, Dependencies, Error, Format, HitGroup,
    Holder, IndexFault, RayQueryRequest, RayTracingPipelineDesc, RenderPassDesc, RenderPipelineDesc,
    SamplerDesc, ShaderModuleDesc, ShaderModuleHandle, ShaderSource, ShaderStage, SlotState, TextureDesc,
    TextureHandle, TextureRegion, TextureUsage, TextureViewDesc, TlasDesc, TlasInstance, Triangles,
};
use lvk_tests::compute::{Evaluator, compute_pipeline, read_vec4, read_words, vec4_buffer, words_buffer};
use lvk_tests::pipelines;
use lvk_tests::raster::{pixels, target};
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::{TestDevice, device, device_with};

fn checking() -> Option<TestDevice> {
    device_with(|desc| {
        desc.check_indices = true;
        desc.max_textures = 64;
    })
}

fn flat(ctx: &Context, name: &str, value: f32) -> Holder<TextureHandle> {
    let texels = [value; 4];
    ctx.create_texture(&TextureDesc {
        format: Format::R32Float,
        extent: [2, 2],
        data: Some(bytemuck::cast_slice(&texels)),
        debug_name: name,
        ..Default::default()
    })
    .unwrap()
}

fn fault(array: BindlessArray, index: u32, state: SlotState, object: Option<&str>, count: u32) -> IndexFault {
    let shader = "test shader".to_owned();
    IndexFault { array, index, state, object: object.map(str::to_owned), shader, count }
}

const FETCH: &str = "textureBindlessFetch2D(a, ivec2(i % 2, i / 2), 0)";
const MAGENTA: [f32; 4] = [1.0, 0.0, 1.0, 1.0];

#[test]
fn freed_and_unknown_textures_are_named_and_replaced() {
    let Some(ctx) = checking() else { return };
    let fetch = Evaluator::new(&ctx, FETCH);
    let (kept, gone) = (flat(&ctx, "kept", 3.0), flat(&ctx, "gone", 4.0));
    let (good, bad) = (kept.index(), gone.index());
    let none = Dependencies::default();
    assert_eq!(fetch.run(&ctx, [good, 0, 0], 1, &none)[0][0], 3.0);
    assert_eq!(fetch.run(&ctx, [bad, 0, 0], 1, &none)[0][0], 4.0);
    assert_eq!(fetch.run(&ctx, [0, 0, 0], 1, &none)[0], MAGENTA, "a read of the default texture is no fault");
    assert_eq!(ctx.index_faults().unwrap(), []);
    drop(gone);
    assert_eq!(fetch.run(&ctx, [bad, 0, 0], 1, &none)[0], MAGENTA);
    assert_eq!(fetch.run(&ctx, [50, 0, 0], 3, &none)[0], MAGENTA);
    assert_eq!(fetch.run(&ctx, [0xDEAD_BEEF, 0, 0], 1, &none)[0], MAGENTA);
    assert_eq!(fetch.run(&ctx, [bad, 0, 0], 2, &none)[0], MAGENTA);
    use SlotState::{Freed, NeverCreated};
    let textures = BindlessArray::Textures;
    let expected = [
        fault(textures, bad, Freed, Some("gone"), 3),
        fault(textures, 50, NeverCreated, None, 3),
        fault(textures, 0xDEAD_BEEF, NeverCreated, None, 1),
    ];
    assert_eq!(ctx.index_faults().unwrap(), expected);
    let again = flat(&ctx, "again", 5.0);
    assert_eq!(fetch.run(&ctx, [again.index(), 0, 0], 1, &none)[0][0], 5.0);
    assert_eq!(ctx.index_faults().unwrap().len(), 3);
}

#[test]
fn the_end_of_a_context_logs_faults_that_were_not_asked_for() {
    capture_warnings();
    for asks in [false, true] {
        let Some(ctx) = checking() else { return };
        let fetch = Evaluator::new(&ctx, FETCH);
        let gone = flat(&ctx, "gone before the end", 4.0);
        let bad = gone.index();
        drop(gone);
        assert_eq!(fetch.run(&ctx, [bad, 0, 0], 1, &Dependencies::default())[0], MAGENTA);
        if asks {
            assert_eq!(ctx.index_faults().unwrap().len(), 1);
        }
        drop((fetch, ctx));
        let lines = take_warnings("'gone before the end' was destroyed");
        assert_eq!(lines.len(), usize::from(!asks), "{lines:?}");
        let names =
            |line: &String| line.contains(&format!("'test shader' used index {bad} of Textures 1 times"));
        assert!(lines.iter().all(names), "{lines:?}");
    }
}

/// Commands that were recorded while the owner was alive may read its slot, whenever they run. Later commands may
/// not, even while the slot still holds the texture.
#[test]
fn an_index_ends_with_its_handle_for_command_buffers_begun_later() {
    let Some(ctx) = checking() else { return };
    let fetch = Evaluator::new(&ctx, FETCH);
    let texture = flat(&ctx, "short-lived", 7.0);
    let index = texture.index();
    let (early, late) = (vec4_buffer(&ctx, 1), vec4_buffer(&ctx, 1));
    let record = |result: BufferHandle| {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        fetch.record(&ctx, &mut cmd, [index, 0, 0], (result, 1), &Dependencies::default());
        cmd
    };
    let before = record(*early);
    drop(texture);
    let after = record(*late);
    ctx.submit(after).unwrap();
    ctx.submit(before).unwrap();
    assert_eq!(read_vec4(&ctx, *early, 1)[0][0], 7.0);
    assert_eq!(read_vec4(&ctx, *late, 1)[0], MAGENTA);
    let expected = [fault(BindlessArray::Textures, index, SlotState::Freed, Some("short-lived"), 1)];
    assert_eq!(ctx.index_faults().unwrap(), expected);
}

#[test]
fn samplers_storage_images_and_usages_are_distinguished() {
    let Some(ctx) = checking() else { return };
    let sampled = flat(&ctx, "sampled only", 2.0);
    let stored = ctx
        .create_texture(&TextureDesc {
            format: Format::R32Float,
            extent: [2, 2],
            usage: TextureUsage::STORAGE,
            debug_name: "stored only",
            ..Default::default()
        })
        .unwrap();
    let sampler = ctx.create_sampler(&SamplerDesc { debug_name: "filter", ..Default::default() }).unwrap();
    let (texture, image, filter) = (sampled.index(), stored.index(), sampler.index());
    let sample = Evaluator::new(&ctx, "textureBindless2DLod(a, b, vec2(0.5), 0.0)");
    let store = Evaluator::new(&ctx, "vec4(1.0); imageStore(kImages2D[int(a)], ivec2(i, 0), vec4(9.0))");
    let none = Dependencies::default();
    let storing = Dependencies { storage_images: &[*stored], ..none };
    assert_eq!(sample.run(&ctx, [texture, filter, 0], 1, &none)[0][0], 2.0);
    store.run(&ctx, [image, 0, 0], 2, &storing);
    assert_eq!(ctx.index_faults().unwrap(), []);
    sample.run(&ctx, [image, filter, 0], 1, &none);
    store.run(&ctx, [texture, 0, 0], 2, &none);
    drop(sampler);
    sample.run(&ctx, [texture, filter, 0], 1, &none);
    use SlotState::{Freed, OtherUsage};
    let expected = [
        fault(BindlessArray::Textures, image, OtherUsage, Some("stored only"), 1),
        fault(BindlessArray::Samplers, filter, Freed, Some("filter"), 1),
        fault(BindlessArray::StorageImages, texture, OtherUsage, Some("sampled only"), 2),
    ];
    assert_eq!(ctx.index_faults().unwrap(), expected);
}

/// Creates a texture of 2x2 floats that shaders store to, copy and sample.
fn stored(ctx: &Context, name: &str) -> Holder<TextureHandle> {
    ctx.create_texture(&TextureDesc {
        format: Format::R32Float,
        extent: [2, 2],
        usage: TextureUsage::STORAGE | TextureUsage::SAMPLED | TextureUsage::TARGET,
        data: Some(bytemuck::cast_slice(&[4.0_f32; 4])),
        debug_name: name,
        ..Default::default()
    })
    .unwrap()
}

/// A write needs a declaration, and so does each read of what an earlier command wrote. Undeclared accesses still happen.
#[test]
fn textures_that_a_command_does_not_declare_are_reported() {
    let Some(ctx) = checking() else { return };
    let image = stored(&ctx, "canvas");
    let index = image.index();
    let fetch = Evaluator::new(&ctx, FETCH);
    let load = Evaluator::new(&ctx, "imageLoad(kImages2D[a], ivec2(0))");
    let store = Evaluator::new(&ctx, "vec4(1.0); imageStore(kImages2D[a], ivec2(i, 0), vec4(9.0))");
    let none = Dependencies::default();
    let (storing, sampling) = (
        Dependencies { storage_images: &[*image], ..none },
        Dependencies { sampled_images: &[*image], ..none },
    );
    let run = |evaluator: &Evaluator, uses| evaluator.run(&ctx, [index, 0, 0], 1, uses)[0][0];
    let faults = || ctx.index_faults().unwrap();
    // Only uploaded: readable everywhere.
    assert_eq!(run(&fetch, &none), 4.0);
    // Declared accesses, in any order.
    run(&store, &storing);
    assert_eq!(run(&load, &storing), 9.0);
    assert_eq!(run(&fetch, &sampling), 9.0);
    assert_eq!(run(&fetch, &none), 9.0, "the declared read made it readable");
    assert_eq!(faults(), []);

    use SlotState::Undeclared;
    let expect = |array, count| fault(array, index, Undeclared, Some("canvas"), count);
    run(&store, &storing);
    run(&fetch, &none);
    assert_eq!(faults(), [expect(BindlessArray::Textures, 1)], "a read of a written texture");
    run(&fetch, &sampling);
    run(&store, &none);
    let [_, write] = &faults()[..] else { unreachable!("{:?}", faults()) };
    assert_eq!(*write, expect(BindlessArray::StorageImages, 1), "a write");
}

/// Attachments are written by their pass, copies make their target readable, and all textures of an image count.
#[test]
fn declarations_follow_passes_copies_and_views() {
    let Some(ctx) = checking() else { return };
    let image = stored(&ctx, "canvas");
    let view =
        ctx.create_texture_view(&TextureViewDesc { texture: Some(*image), ..Default::default() }).unwrap();
    let fetch = Evaluator::new(&ctx, FETCH);
    let none = Dependencies::default();
    let read = |index, uses: &Dependencies<'_>| fetch.run(&ctx, [index, 0, 0], 1, uses)[0][0];
    let clear = || {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let color = [ColorAttachment::clear(*image, [7.0; 4])];
        drop(cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap());
        ctx.submit(cmd).unwrap();
    };
    clear();
    read(view.index(), &Dependencies { sampled_images: &[*view], ..none });
    assert_eq!(ctx.index_faults().unwrap(), []);
    clear();
    read(view.index(), &none);
    let [found] = &ctx.index_faults().unwrap()[..] else { unreachable!("one fault is expected") };
    assert_eq!((found.state, found.index), (SlotState::Undeclared, view.index()));
    // A copy leaves its target readable.
    ctx.upload_texture(*image, &TextureRegion::default(), bytemuck::cast_slice(&[5.0_f32; 4])).unwrap();
    assert_eq!(read(image.index(), &none), 5.0);
    assert_eq!(ctx.index_faults().unwrap().len(), 1);
}

/// A triangle across the ray along z.
fn accel_structs(ctx: &Context) -> (Holder<AccelStructHandle>, Holder<AccelStructHandle>) {
    let positions = [[-1.0_f32, -1.0, 1.0], [1.0, -1.0, 1.0], [0.0, 1.0, 1.0]];
    let vertices = BufferDesc {
        data: Some(bytemuck::cast_slice(&positions)),
        usage: BufferUsage::ACCEL_INPUT,
        ..Default::default()
    };
    let vertices = ctx.create_buffer(&vertices).unwrap();
    let geometries = [BlasGeometry::Triangles(Triangles::packed(*vertices, 3))];
    let blas = ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() }).unwrap();
    let instances = [TlasInstance::new(*blas)];
    let desc = TlasDesc { instances: &instances, debug_name: "the world", ..Default::default() };
    let tlas = ctx.create_tlas(&desc).unwrap();
    ctx.wait_idle().unwrap();
    (blas, tlas)
}

const TRACE: &str = "
    #include <lvk/ray_query.glsl>
    layout(local_size_x = 1) in;
    layout(buffer_reference, scalar) writeonly buffer Result { float at; };
    layout(push_constant, scalar) uniform Push { Result result; uint tlas; };
    void main() {
        LvkRayQuery rq;
        lvkRayQueryInitialize(rq, tlas, LVK_RAY_FLAG_OPAQUE, 0xFFu, vec3(0), 0.0, vec3(0, 0, 1), 9.0);
        while (lvkRayQueryProceed(rq)) {}
        bool hit = lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE;
        result.at = hit ? lvkRayQueryT(rq, LVK_COMMITTED) : -1.0;
    }";

/// Returns the distance of a ray's hit, or -1.
fn trace(ctx: &Context, pipeline: ComputePipelineHandle, tlas: u32) -> f32 {
    let result = words_buffer(ctx, &[0]);
    let address = ctx.buffer_address(*result).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(pipeline).unwrap();
    cmd.push_constants(&[address as u32, (address >> 32) as u32, tlas]).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*result], ..Default::default() }).unwrap();
    ctx.submit(cmd).unwrap();
    f32::from_bits(read_words(ctx, *result, 1)[0])
}

/// Cases: the device's own queries and the library's.
#[test]
fn ray_queries_check_their_accel_structs() {
    for query in [RayQueryRequest::HardwareIfPresent, RayQueryRequest::Software] {
        let made = device_with(|desc| {
            desc.check_indices = true;
            desc.ray_query = query;
        });
        let Some(ctx) = made else { return };
        if !ctx.capabilities().ray_query {
            eprintln!("NOT TESTED, the device has no ray queries");
            continue;
        }
        let (_blas, tlas) = accel_structs(&ctx);
        let index = tlas.index();
        let pipeline = compute_pipeline(&ctx, TRACE);
        assert_eq!(trace(&ctx, *pipeline, index), 1.0, "{query:?}");
        assert_eq!(ctx.index_faults().unwrap(), [], "{query:?}");
        drop(tlas);
        assert_eq!(trace(&ctx, *pipeline, index), -1.0, "{query:?}");
        let faults = ctx.index_faults().unwrap();
        let [fault] = &faults[..] else { unreachable!("{faults:?}") };
        assert_eq!(
            (fault.array, fault.index, fault.state),
            (BindlessArray::AccelStructs, index, SlotState::Freed)
        );
        assert_eq!(fault.object.as_deref(), Some("the world"));
    }
}

/// Creates a module that reads texture 60, which does not exist. Its name is that of its stage.
fn module_with_bad_index(ctx: &Context, stage: ShaderStage, text: &str) -> Holder<ShaderModuleHandle> {
    let text = text.replace("BAD_TEXEL", "textureBindlessFetch2D(60u, ivec2(0), 0)");
    let name = format!("{stage:?}");
    let source = ShaderSource::Glsl(&text);
    ctx.create_shader_module(&ShaderModuleDesc { stage, source, debug_name: &name, ..Default::default() })
        .unwrap()
}

/// The shaders that were caught, each with texture 60; magenta has red.
fn caught(ctx: &Context) -> Vec<String> {
    let faults = ctx.index_faults().unwrap();
    assert!(
        faults.iter().all(|fault| (fault.array, fault.index) == (BindlessArray::Textures, 60)),
        "{faults:?}"
    );
    assert!(
        faults.iter().all(|fault| fault.state == SlotState::NeverCreated && fault.count > 0),
        "{faults:?}"
    );
    faults.into_iter().map(|fault| fault.shader).collect()
}

const VERTEX: &str = "
    layout(location = 0) out vec4 color;
    void main() {
        color = BAD_TEXEL;
        gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0.0, 1.0);
    }";
const FRAGMENT: &str = "
    layout(location = 0) in vec4 color;
    layout(location = 0) out vec4 result;
    void main() { result = color * 0.5 + BAD_TEXEL * 0.25; }";
const TASK: &str = "
    layout(local_size_x = 1) in;
    taskPayloadSharedEXT vec4 payload;
    void main() { payload = BAD_TEXEL; EmitMeshTasksEXT(1, 1, 1); }";
const MESH: &str = "
    layout(local_size_x = 1) in;
    layout(triangles, max_vertices = 3, max_primitives = 1) out;
    layout(location = 0) out vec4 color[];
    taskPayloadSharedEXT vec4 payload;
    void main() {
        SetMeshOutputsEXT(3u, 1u);
        gl_PrimitiveTriangleIndicesEXT[0] = uvec3(0, 1, 2);
        for (uint i = 0; i < 3; ++i) {
            gl_MeshVerticesEXT[i].gl_Position = vec4(vec2(i & 1, i >> 1) * 4.0 - 1.0, 0.0, 1.0);
            color[i] = payload * 0.5 + BAD_TEXEL * 0.5;
        }
    }";

#[test]
fn stages_that_draw_are_checked() {
    use ShaderStage::{Fragment, Mesh, Task, Vertex};
    let Some(ctx) = checking() else { return };
    let draw = |pipeline: &RenderPipelineDesc<'_>, mesh: bool| {
        let colors = [ColorTarget::from(Format::Rgba32Float)];
        let pipeline =
            ctx.create_render_pipeline(&RenderPipelineDesc { color: &colors, ..*pipeline }).unwrap();
        let target = target(&ctx, Format::Rgba32Float, [2, 2]);
        let color = [ColorAttachment::clear(*target, [0.0; 4])];
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
        pass.bind_render_pipeline(*pipeline).unwrap();
        if mesh { pass.draw_mesh_tasks([1, 1, 1]) } else { pass.draw(0..3, 0..1) }.unwrap();
        drop(pass);
        ctx.submit(cmd).unwrap();
        assert_eq!(pixels::<[f32; 4]>(&ctx, *target), [[0.75, 0.0, 0.75, 0.75]; 4]);
    };
    let (vertex, fragment) =
        (module_with_bad_index(&ctx, Vertex, VERTEX), module_with_bad_index(&ctx, Fragment, FRAGMENT));
    draw(
        &RenderPipelineDesc { vertex: Some(*vertex), fragment: Some(*fragment), ..Default::default() },
        false,
    );
    assert_eq!(caught(&ctx), ["Fragment", "Vertex"]);
    if !ctx.capabilities().mesh_shader {
        eprintln!("NOT TESTED, the device has no mesh shaders");
        return;
    }
    let (task, mesh) = (module_with_bad_index(&ctx, Task, TASK), module_with_bad_index(&ctx, Mesh, MESH));
    let desc = RenderPipelineDesc {
        task: Some(*task),
        mesh: Some(*mesh),
        fragment: Some(*fragment),
        ..Default::default()
    };
    draw(&desc, true);
    assert_eq!(caught(&ctx), ["Fragment", "Mesh", "Task", "Vertex"]);
}

const RAY_GEN: &str = "
    layout(buffer_reference, scalar) writeonly buffer Result { float at[]; };
    layout(push_constant, scalar) uniform Push { Result result; uint tlas; };
    layout(location = 0) rayPayloadEXT float value;
    layout(location = 0) callableDataEXT float called;
    void main() {
        float own = BAD_TEXEL.x;
        traceRayEXT(kTLAS[tlas], LVK_RAY_FLAG_NO_OPAQUE, 0xff, 0, 0, 0, vec3(0), 0.0, vec3(0, 0, 1), 9.0, 0);
        result.at[0] = value + own;
        traceRayEXT(kTLAS[tlas], 0, 0xff, 0, 0, 0, vec3(0), 0.0, vec3(0, 0, -1), 9.0, 0);
        executeCallableEXT(0, 0);
        result.at[1] = value + called;
    }";

/// Rays, a structure that is looked for in the wrong place included.
#[test]
fn stages_that_trace_are_checked() {
    use ShaderStage::{AnyHit, Callable, ClosestHit, Miss, RayGen};
    let Some(ctx) = checking() else { return };
    if !ctx.capabilities().ray_tracing_pipeline {
        eprintln!("NOT TESTED, the device has no ray tracing pipelines");
        return;
    }
    let (_blas, tlas) = accel_structs(&ctx);
    let payload =
        |body: &str| format!("layout(location = 0) rayPayloadInEXT float value; void main() {{ {body} }}");
    let ray_gen = module_with_bad_index(&ctx, RayGen, RAY_GEN);
    let miss = module_with_bad_index(&ctx, Miss, &payload("value = 10.0 * BAD_TEXEL.x;"));
    let hit = module_with_bad_index(&ctx, ClosestHit, &payload("value = 20.0 * BAD_TEXEL.x;"));
    let any =
        module_with_bad_index(&ctx, AnyHit, &payload("if (BAD_TEXEL.y > 0.5) { ignoreIntersectionEXT; }"));
    let text =
        "layout(location = 0) callableDataInEXT float called; void main() { called = 5.0 * BAD_TEXEL.x; }";
    let callable = module_with_bad_index(&ctx, Callable, text);
    let group = HitGroup { closest_hit: Some(*hit), any_hit: Some(*any), ..Default::default() };
    let pipeline = ctx
        .create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &[*ray_gen],
            miss: &[*miss],
            hit_groups: &[group],
            callable: &[*callable],
            ..Default::default()
        })
        .unwrap();
    let run = |tlas: u32| {
        let result = words_buffer(&ctx, &[0; 2]);
        let address = ctx.buffer_address(*result).unwrap();
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.bind_ray_tracing_pipeline(*pipeline).unwrap();
        cmd.push_constants(&[address as u32, (address >> 32) as u32, tlas]).unwrap();
        cmd.trace_rays([1, 1, 1], &Dependencies { buffers: &[*result], ..Default::default() }).unwrap();
        ctx.submit(cmd).unwrap();
        [0, 1].map(|at| f32::from_bits(read_words(&ctx, *result, 2)[at]))
    };
    assert_eq!(run(tlas.index()), [21.0, 15.0]);
    assert_eq!(caught(&ctx), ["AnyHit", "Callable", "ClosestHit", "Miss", "RayGen"]);
    assert_eq!(run(9), [11.0, 15.0], "nothing is in the empty structure");
    let faults = ctx.index_faults().unwrap();
    let structures: Vec<_> = faults.iter().filter(|f| f.array == BindlessArray::AccelStructs).collect();
    assert_eq!(structures.iter().map(|f| (f.index, f.count)).collect::<Vec<_>>(), [(9, 2)]);
}

#[test]
fn without_the_switch_there_is_nothing_to_ask() {
    let Some(ctx) = device() else { return };
    let asked = ctx.index_faults();
    assert!(matches!(&asked, Err(Error::InvalidUsage { message, .. }) if message.contains("check_indices")));
}

/// Every module of the samples is instrumented, and the layer takes it.
#[test]
fn the_modules_of_all_samples_stay_valid() {
    lvk_tests::warnings::capture_warnings();
    let Some(ctx) = checking() else { return };
    let stages = pipelines::all().into_iter().flat_map(|pipeline| pipeline.stages);
    let made = stages.filter(|stage| ctx.create_shader_module(&stage.module()).is_ok()).count();
    assert!(made >= 60, "{made}");
    assert_eq!(lvk_tests::warnings::take_warnings("are not checked"), [""; 0]);
}
