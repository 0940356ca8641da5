//! Query pools: occlusion, pipeline statistics, timestamps inside of passes, calibrated timestamps, and refused
//! calls.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::time::{Duration, Instant};

use lvk::{
    ColorAttachment, ColorTarget, CommandBuffer, CompareOp, Context, Dependencies, DepthAttachment,
    DepthTest, Error, Format, Holder, OptionalFeature, PipelineStatistics, QueryKind, QueryPoolDesc,
    QueryPoolHandle, RenderPass, RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle, ShaderStage,
    TextureHandle,
};
use lvk_tests::compute::compute_pipeline;
use lvk_tests::device;
use lvk_tests::raster::{COVER, PAINT, has, pixels, render_pipeline, run_pass, staged_pipeline, target};

const SIDE: u32 = 64;

/// A target with depth and a pipeline that covers it.
struct DrawTarget {
    color: Holder<TextureHandle>,
    depth: Holder<TextureHandle>,
    pipeline: Holder<RenderPipelineHandle>,
}

impl DrawTarget {
    fn new(ctx: &Context) -> Self {
        let depth = DepthTest { format: Format::D32Float, compare: CompareOp::Less, write: true };
        let color = [ColorTarget::new(Format::Rgba8Unorm)];
        let desc = RenderPipelineDesc { color: &color, depth: Some(depth), ..Default::default() };
        Self {
            color: target(ctx, Format::Rgba8Unorm, [SIDE; 2]),
            depth: target(ctx, Format::D32Float, [SIDE; 2]),
            pipeline: render_pipeline(ctx, COVER, PAINT, &desc),
        }
    }

    fn pass<'a>(&self, cmd: &'a mut CommandBuffer) -> RenderPass<'a> {
        let color = [ColorAttachment::clear(*self.color, [0.0; 4])];
        let depth = Some(DepthAttachment::clear(*self.depth, 1.0));
        let mut pass =
            cmd.begin_rendering(&RenderPassDesc { color: &color, depth, ..Default::default() }).unwrap();
        pass.bind_render_pipeline(*self.pipeline).unwrap();
        pass
    }
}

/// Draws over a rectangle.
fn draw(pass: &mut RenderPass<'_>, offset: [u32; 2], extent: [u32; 2], depth: f32) {
    pass.scissor(offset, extent).unwrap();
    pass.push_constants(&[1.0_f32, 0.5, 0.25, 1.0, depth]).unwrap();
    pass.draw(0..3, 0..1).unwrap();
}

fn pool(ctx: &Context, kind: QueryKind, count: u32) -> Holder<QueryPoolHandle> {
    ctx.create_query_pool(&QueryPoolDesc { kind, count, debug_name: "the pool" }).unwrap()
}

fn occlusion(ctx: &Context, count: u32) -> Holder<QueryPoolHandle> {
    pool(ctx, QueryKind::Occlusion { precise: ctx.capabilities().precise_occlusion }, count)
}

fn read(ctx: &Context, pool: QueryPoolHandle, count: usize) -> Vec<Option<u64>> {
    let mut values = vec![Some(77); count];
    ctx.read_queries(pool, 0, &mut values).unwrap();
    values
}

fn finish(ctx: &Context, cmd: CommandBuffer) {
    ctx.wait(ctx.submit(cmd).unwrap()).unwrap();
}

#[track_caller]
fn refused<T: std::fmt::Debug>(result: lvk::Result<T>, words: &str) {
    match &result {
        Err(Error::InvalidUsage { object, message }) if object == "the pool" => {
            assert!(message.contains(words), "'{message}' has no '{words}'");
        }
        _ => unreachable!("{result:?}"),
    }
}

#[test]
fn samples_of_rectangles_are_counted() {
    let Some(ctx) = device() else { return };
    let (draw_target, pool) = (DrawTarget::new(&ctx), occlusion(&ctx, 5));
    assert_eq!(read(&ctx, *pool, 5), [None; 5]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.begin_query(*pool, 4).unwrap();
    for again in 0..2 {
        let mut pass = draw_target.pass(&mut cmd);
        draw(&mut pass, [0, 0], [10 + again, 1], 0.5);
    }
    cmd.end_query(*pool, 4).unwrap();
    let mut pass = draw_target.pass(&mut cmd);
    pass.begin_query(*pool, 0).unwrap();
    draw(&mut pass, [3, 5], [17, 11], 0.5);
    pass.end_query(*pool, 0).unwrap();
    pass.begin_query(*pool, 1).unwrap();
    draw(&mut pass, [3, 5], [17, 11], 0.75);
    pass.end_query(*pool, 1).unwrap();
    pass.begin_query(*pool, 2).unwrap();
    draw(&mut pass, [0, 0], [SIDE; 2], 0.625);
    draw(&mut pass, [40, 40], [2, 3], 0.25);
    pass.end_query(*pool, 2).unwrap();
    drop(pass);
    finish(&ctx, cmd);
    let rest = u64::from(SIDE * SIDE);
    let expected = [17 * 11, 0, rest - 17 * 11 + 6, 0, 21];
    let found = read(&ctx, *pool, 5);
    assert_eq!(found[3], None, "was never begun");
    for (query, exact) in expected.into_iter().enumerate().filter(|(query, _)| *query != 3) {
        let count = found[query].unwrap();
        match ctx.capabilities().precise_occlusion {
            true => assert_eq!(count, exact, "query {query}"),
            false => assert_eq!(count > 0, exact > 0, "query {query}"),
        }
    }
    let mut middle = [None; 2];
    ctx.read_queries(*pool, 1, &mut middle).unwrap();
    assert_eq!(middle, found[1..3]);
}

#[test]
fn more_queries_than_are_read_at_once_keep_their_order() {
    let Some(ctx) = device() else { return };
    let (draw_target, pool) = (DrawTarget::new(&ctx), occlusion(&ctx, 70));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let mut pass = draw_target.pass(&mut cmd);
    for query in (0..70).filter(|query| query % 3 != 0) {
        pass.begin_query(*pool, query).unwrap();
        draw(
            &mut pass,
            [0, 0],
            [if query % 2 == 0 { 0 } else { 64 - query / 2 }, 1],
            0.9 - query as f32 * 0.01,
        );
        pass.end_query(*pool, query).unwrap();
    }
    drop(pass);
    finish(&ctx, cmd);
    for (query, found) in read(&ctx, *pool, 70).into_iter().enumerate() {
        let expected = (query % 3 != 0).then_some(query % 2 == 1);
        assert_eq!(found.map(|count| count > 0), expected, "query {query}");
    }
}

#[test]
fn an_inexact_count_says_whether_anything_passed() {
    let Some(ctx) = device() else { return };
    let (draw_target, pool) = (DrawTarget::new(&ctx), pool(&ctx, QueryKind::Occlusion { precise: false }, 2));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let mut pass = draw_target.pass(&mut cmd);
    pass.begin_query(*pool, 0).unwrap();
    draw(&mut pass, [0, 0], [8, 8], 0.5);
    pass.end_query(*pool, 0).unwrap();
    pass.begin_query(*pool, 1).unwrap();
    draw(&mut pass, [0, 0], [8, 8], 0.6);
    pass.end_query(*pool, 1).unwrap();
    drop(pass);
    finish(&ctx, cmd);
    let found = read(&ctx, *pool, 2);
    assert!(found[0].unwrap() > 0 && found[1] == Some(0), "{found:?}");
}

#[test]
fn stages_are_counted_beside_samples() {
    let Some(ctx) = device() else { return };
    let desc = QueryPoolDesc { kind: QueryKind::PipelineStatistics, count: 3, debug_name: "the pool" };
    if !ctx.capabilities().pipeline_statistics {
        assert!(matches!(ctx.create_query_pool(&desc), Err(Error::Unsupported { .. })));
        return eprintln!("NOT TESTED, the device counts no stages");
    }
    let (draw_target, stages) = (DrawTarget::new(&ctx), ctx.create_query_pool(&desc).unwrap());
    let samples = occlusion(&ctx, 1);
    let work = compute_pipeline(&ctx, "layout(local_size_x = 32) in; void main() {}");
    assert_eq!(ctx.statistics(*stages, 0).unwrap(), None);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.begin_query(*stages, 1).unwrap();
    cmd.bind_compute_pipeline(*work).unwrap();
    cmd.dispatch([3, 2, 1], &Dependencies::default()).unwrap();
    cmd.end_query(*stages, 1).unwrap();
    let mut pass = draw_target.pass(&mut cmd);
    pass.begin_query(*stages, 0).unwrap();
    pass.begin_query(*samples, 0).unwrap();
    for step in 0..5_u8 {
        draw(&mut pass, [0, 0], [16, 16], 0.9 - f32::from(step) * 0.1);
    }
    pass.end_query(*stages, 0).unwrap();
    pass.end_query(*samples, 0).unwrap();
    drop(pass);
    match cmd.begin_query(*stages, 2) {
        Err(Error::Unsupported { .. }) if ctx.capabilities().driver_name == "llvmpipe" => {}
        begun => {
            begun.unwrap();
            cmd.end_query(*stages, 2).unwrap();
        }
    }
    finish(&ctx, cmd);
    let drawn = ctx.statistics(*stages, 0).unwrap().unwrap();
    assert_eq!((drawn.input_vertices, drawn.input_primitives), (15, 5));
    assert!((5..=15).contains(&drawn.vertex_invocations), "{drawn:?}");
    assert_eq!(drawn.clipped_primitives, 5);
    assert!(drawn.rasterized_primitives >= 5 && drawn.fragment_invocations >= 5 * 256, "{drawn:?}");
    assert_eq!(
        (drawn.compute_invocations, drawn.geometry_invocations, drawn.tessellation_patches),
        (0, 0, 0)
    );
    let computed = ctx.statistics(*stages, 1).unwrap().unwrap();
    assert_eq!(computed, PipelineStatistics { compute_invocations: 192, ..Default::default() });
    let nothing = ctx.statistics(*stages, 2).unwrap();
    assert!(nothing.is_none_or(|found| found == PipelineStatistics::default()), "{nothing:?}");
    assert!(read(&ctx, *samples, 1)[0].is_some_and(|count| count > 0));
}

/// One triangle over the target, by a mesh workgroup of 8 invocations.
const MESH: &str = "layout(local_size_x = 8) in;
    layout(triangles, max_vertices = 3, max_primitives = 1) out;
    void main() {
        SetMeshOutputsEXT(3, 1);
        uint i = gl_LocalInvocationIndex;
        if (i < 3) {
            gl_MeshVerticesEXT[i].gl_Position = vec4(vec2(i & 1, i >> 1) * 4.0 - 1.0, 0.5, 1.0);
        }
        gl_PrimitiveTriangleIndicesEXT[0] = uvec3(0, 1, 2);
    }";
const WHITE: (ShaderStage, &str) =
    (ShaderStage::Fragment, "layout(location = 0) out vec4 c; void main() { c = vec4(1.0); }");

fn mesh_pipeline(ctx: &Context, stages: &[(ShaderStage, &str)]) -> Holder<RenderPipelineHandle> {
    let color = [ColorTarget::new(Format::Rgba8Unorm)];
    let desc = RenderPipelineDesc { color: &color, ..Default::default() };
    staged_pipeline(ctx, stages, &desc).unwrap()
}

/// Three task workgroups of 4 invocations ask for two mesh workgroups each; then five of those without a task, of which a half
/// is scissored away; then an ordinary draw.
#[test]
fn task_and_mesh_shaders_are_counted() {
    let Some(ctx) = device() else { return };
    if !ctx.capabilities().mesh_shader || !has(&ctx, OptionalFeature::MeshShaderQueries) {
        let desc = QueryPoolDesc { kind: QueryKind::MeshStatistics, ..Default::default() };
        assert!(matches!(ctx.create_query_pool(&desc), Err(Error::Unsupported { .. })));
        return eprintln!("NOT TESTED, {} counts no mesh shaders", ctx.capabilities().device_name);
    }
    let task = (ShaderStage::Task, "layout(local_size_x = 4) in; void main() { EmitMeshTasksEXT(2, 1, 1); }");
    let with_task = mesh_pipeline(&ctx, &[task, (ShaderStage::Mesh, MESH), WHITE]);
    let alone = mesh_pipeline(&ctx, &[(ShaderStage::Mesh, MESH), WHITE]);
    let (draw_target, stages) = (DrawTarget::new(&ctx), pool(&ctx, QueryKind::MeshStatistics, 3));
    let drawn = target(&ctx, Format::Rgba8Unorm, [SIDE; 2]);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        for (query, pipeline, groups, height) in [(0, &with_task, 3, SIDE), (1, &alone, 5, SIDE / 2)] {
            pass.scissor([0, 0], [SIDE, height])?;
            pass.begin_query(*stages, query)?;
            pass.bind_render_pipeline(**pipeline)?;
            pass.draw_mesh_tasks([groups, 1, 1])?;
            pass.end_query(*stages, query)?;
        }
        Ok(())
    });
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let mut pass = draw_target.pass(&mut cmd);
    pass.begin_query(*stages, 2).unwrap();
    draw(&mut pass, [0, 0], [SIDE; 2], 0.5);
    pass.end_query(*stages, 2).unwrap();
    drop(pass);
    finish(&ctx, cmd);
    let full = u64::from(SIDE * SIDE);
    for (query, tasks, meshes, fragments) in
        [(0, 3 * 4, 3 * 2 * 8, 6 * full), (1, 0, 5 * 8, 5 * full / 2), (2, 0, 0, full)]
    {
        let found = ctx.statistics(*stages, query).unwrap().unwrap();
        assert_eq!((found.task_invocations, found.mesh_invocations), (tasks, meshes), "{found:?}");
        assert!(found.fragment_invocations >= fragments, "{found:?}");
        let none = (found.input_vertices, found.vertex_invocations, found.compute_invocations);
        assert_eq!(none, (0, 0, 0), "{found:?}");
    }
}

/// Vulkan forbids it, wherever the query was begun; behind its end draws go on.
#[test]
fn mesh_shaders_do_not_draw_while_vertices_are_counted() {
    let Some(ctx) = device() else { return };
    if !ctx.capabilities().mesh_shader || !ctx.capabilities().pipeline_statistics {
        return eprintln!("NOT TESTED, {} lacks mesh shaders or statistics", ctx.capabilities().device_name);
    }
    let pipeline = mesh_pipeline(&ctx, &[(ShaderStage::Mesh, MESH), WHITE]);
    let drawn = target(&ctx, Format::Rgba8Unorm, [SIDE; 2]);
    let stages = pool(&ctx, QueryKind::PipelineStatistics, 2);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let desc = RenderPassDesc { color: &color, ..Default::default() };
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.begin_query(*stages, 0).unwrap();
    let mut pass = cmd.begin_rendering(&desc).unwrap();
    pass.bind_render_pipeline(*pipeline).unwrap();
    refused(pass.draw_mesh_tasks([1, 1, 1]), "QueryKind::MeshStatistics");
    drop(pass);
    cmd.end_query(*stages, 0).unwrap();
    let mut pass = cmd.begin_rendering(&desc).unwrap();
    pass.bind_render_pipeline(*pipeline).unwrap();
    pass.begin_query(*stages, 1).unwrap();
    refused(pass.draw_mesh_tasks([1, 1, 1]), "query 1 is open");
    pass.end_query(*stages, 1).unwrap();
    pass.draw_mesh_tasks([1, 1, 1]).unwrap();
    drop(pass);
    finish(&ctx, cmd);
    assert!(pixels::<u32>(&ctx, *drawn).iter().all(|pixel| *pixel == u32::MAX));
}

#[test]
fn times_inside_of_a_pass_rise() {
    let Some(ctx) = device() else { return };
    let (draw_target, times) = (DrawTarget::new(&ctx), pool(&ctx, QueryKind::Timestamps, 4));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.write_timestamp(*times, 0).unwrap();
    let mut pass = draw_target.pass(&mut cmd);
    pass.write_timestamp(*times, 1).unwrap();
    draw(&mut pass, [0, 0], [SIDE; 2], 0.5);
    pass.write_timestamp(*times, 2).unwrap();
    drop(pass);
    cmd.write_timestamp(*times, 3).unwrap();
    finish(&ctx, cmd);
    let found = ctx.timestamps_ms(*times, 0, 4).unwrap();
    assert!(found.iter().all(Option::is_some) && found.is_sorted(), "{found:?}");
    let ticks = read(&ctx, *times, 4);
    let period = f64::from(ctx.capabilities().limits.timestamp_period_ns) * 1e-6;
    for (ms, ticks) in found.iter().zip(ticks) {
        assert!((ms.unwrap() - ticks.unwrap() as f64 * period).abs() < 1e-3);
    }
}

#[test]
fn misuse_is_refused_while_it_is_recorded() {
    let Some(ctx) = device() else { return };
    let (draw_target, samples) = (DrawTarget::new(&ctx), occlusion(&ctx, 3));
    let times = pool(&ctx, QueryKind::Timestamps, 3);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    refused(cmd.write_timestamp(*samples, 0), "begin_query");
    refused(cmd.begin_query(*times, 0), "write_timestamp");
    refused(cmd.begin_query(*samples, 3), "outside");
    refused(cmd.end_query(*samples, 3), "not begun");
    refused(cmd.end_query(*samples, 0), "not begun");
    cmd.begin_query(*samples, 0).unwrap();
    refused(cmd.begin_query(*samples, 1), "nested");
    refused(cmd.reset_queries(*samples, 0..2), "open");
    cmd.reset_queries(*samples, 1..2).unwrap();
    let mut pass = draw_target.pass(&mut cmd);
    refused(pass.begin_query(*samples, 1), "nested");
    refused(pass.end_query(*samples, 0), "same side");
    draw(&mut pass, [0, 0], [4, 4], 0.5);
    drop(pass);
    cmd.end_query(*samples, 0).unwrap();
    refused(cmd.begin_query(*samples, 0), "reset it first");
    cmd.write_timestamp(*times, 0).unwrap();
    refused(cmd.write_timestamp(*times, 0), "reset it first");
    refused(cmd.reset_queries(*times, std::ops::Range { start: 2, end: 1 }), "2..1 of queries ends before");
    cmd.reset_queries(*times, 0..1).unwrap();
    cmd.write_timestamp(*times, 0).unwrap();
    finish(&ctx, cmd);
    assert!(read(&ctx, *samples, 1)[0].unwrap() > 0);
    refused(ctx.timestamps_ms(*samples, 0, 1), "times");
    refused(ctx.statistics(*samples, 0), "statistics");
    refused(ctx.read_queries(*samples, 2, &mut [None; 2]), "outside");
    refused(ctx.read_queries(*samples, u32::MAX, &mut [None; 2]), "outside");
}

#[test]
fn queries_left_open_do_not_get_to_the_gpu() {
    let Some(ctx) = device() else { return };
    let (draw_target, samples) = (DrawTarget::new(&ctx), occlusion(&ctx, 2));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.begin_query(*samples, 0).unwrap();
    refused(ctx.submit(cmd), "not ended in its command buffer");
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let mut pass = draw_target.pass(&mut cmd);
    pass.begin_query(*samples, 1).unwrap();
    drop(pass);
    refused(cmd.end_query(*samples, 1), "not begun");
    refused(ctx.submit(cmd), "not ended in its render pass");
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let mut pass = draw_target.pass(&mut cmd);
    pass.begin_query(*samples, 1).unwrap();
    std::mem::forget(pass);
    cmd.begin_query(*samples, 0).unwrap();
    cmd.end_query(*samples, 0).unwrap();
    refused(ctx.submit(cmd), "not ended in its render pass");
    assert_eq!(read(&ctx, *samples, 2), [None; 2]);
}

#[test]
fn a_query_written_by_an_earlier_submission_must_be_reset() {
    let Some(ctx) = device() else { return };
    let times = pool(&ctx, QueryKind::Timestamps, 2);
    let stamped = || {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.write_timestamp(*times, 1).unwrap();
        cmd
    };
    let (first, second) = (stamped(), stamped());
    finish(&ctx, second);
    let before = ctx.timestamps_ms(*times, 1, 1).unwrap()[0].unwrap();
    refused(ctx.submit(first), "query 1 was written before");
    let late = stamped();
    let mut reset = ctx.acquire_command_buffer().unwrap();
    reset.reset_queries(*times, 0..2).unwrap();
    ctx.submit(reset).unwrap();
    finish(&ctx, late);
    assert!(ctx.timestamps_ms(*times, 1, 1).unwrap()[0].unwrap() > before);
}

#[test]
fn clocks_of_gpu_and_host_go_together() {
    let Some(ctx) = device() else { return };
    if !ctx.capabilities().calibrated_timestamps {
        assert!(matches!(ctx.calibrated_timestamps(), Err(Error::Unsupported { .. })));
        return eprintln!("NOT TESTED, the device's clock cannot be read with the host's");
    }
    let times = pool(&ctx, QueryKind::Timestamps, 1);
    let (before, start) = (monotonic(), Instant::now());
    let first = ctx.calibrated_timestamps().unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.write_timestamp(*times, 0).unwrap();
    finish(&ctx, cmd);
    let second = ctx.calibrated_timestamps().unwrap();
    let (after, wall) = (monotonic(), start.elapsed());
    #[cfg(target_os = "linux")]
    assert_eq!([first.clock, second.clock], [lvk::HostClock::Monotonic; 2]);
    assert!(first.host <= second.host);
    assert!(
        before.is_none_or(|before| before <= first.host) && after.is_none_or(|after| second.host <= after)
    );
    assert!(second.host - first.host <= wall + Duration::from_millis(1));
    let stamp = ctx.timestamps_ms(*times, 0, 1).unwrap()[0].unwrap();
    assert!(first.gpu_ms <= stamp && stamp <= second.gpu_ms, "{first:?} {stamp} {second:?}");
    let slack = first.deviation + second.deviation + Duration::from_micros(50);
    let seen = first.host_at(stamp);
    assert!(seen + slack >= first.host && seen <= second.host + slack, "{seen:?} of {first:?} to {second:?}");
    // Both scales of the host are those of one clock, so their distances are the same.
    let slack = slack + first.instant_deviation + second.instant_deviation;
    let (apart, instants) = (second.host - first.host, second.instant - first.instant);
    assert!(apart.abs_diff(instants) <= slack, "{first:?} to {second:?}");
    let at = first.instant_at(stamp).unwrap();
    assert!(start <= at + slack && at <= second.instant + slack, "{at:?} of {first:?} to {second:?}");
}

/// The clock of the host that drivers read; `None` on Windows, where it is another.
#[cfg(unix)]
fn monotonic() -> Option<Duration> {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    Some(Duration::new(now.tv_sec.unsigned_abs(), u32::try_from(now.tv_nsec).unwrap()))
}

#[cfg(not(unix))]
fn monotonic() -> Option<Duration> {
    None
}
