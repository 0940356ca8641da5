//! Rebuilds and refits, in the same command buffer and with frames in flight. No test records a barrier, or waits
//! before its last line.

use lvk::glam::{Affine3A, Vec3};
use lvk::{
    BlasDesc, BlasGeometry, BuildFlags, BuildMode, Context, Error, PrimitiveOrder, RayQueryPath, Result,
    TlasDesc, Triangles,
};
use lvk_tests::accel_backend::{requires_device_accel_structs, software_alone};
use lvk_tests::device;
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{
    GpuScene, Layout, Part, Placed, RayScene, instances, upload_geometries, vertex_bytes,
};
use lvk_tests::ray_tracer::{How, Method, RayTracer, TraceBuffers, for_each_method};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::vertex_deform::{VertexDeformer, deformed};

const UPDATABLE: BuildFlags = BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE);

fn rays() -> Vec<Ray> {
    random_rays(31, 1_200, Vec3::splat(-1.5), Vec3::splat(1.5))
}

fn check(what: &str, tracer: &RayTracer, gpu: &GpuScene, scene: &RayScene) -> Result<()> {
    let rays = rays();
    let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
    agree(what, &rays, &records, scene);
    Ok(())
}

fn agree(what: &str, rays: &[Ray], records: &[lvk_tests::ray_tracer::HitRecord], scene: &RayScene) {
    let reference = scene.reference();
    HitComparison::of_triangles(rays, records, |ray| reference.closest(ray, 0xff)).assert(what);
}

/// `count` small models on a spiral that `turn` turns.
fn spiral(count: u32, turn: f32) -> RayScene {
    let place = |index: u32| {
        let angle = index as f32 * 0.9 + turn;
        let (x, z) = (angle.cos(), angle.sin());
        let to = Vec3::new(x, index as f32 * 0.2 - 1.0, z);
        let transform = Affine3A::from_translation(to) * Affine3A::from_scale(Vec3::new(0.6, 0.4, 0.5));
        Placed { custom_index: 100 + index, ..Placed::new(index as usize % 2, transform) }
    };
    let models = [Mesh::sphere(7), Mesh::torus(7)];
    let models = models.map(|mesh| vec![Part::new(mesh, Layout::Indexed16)]).to_vec();
    RayScene { models, placed: (0..count).map(place).collect() }
}

fn deformable() -> RayScene {
    RayScene::single(Mesh::torus(10), Layout::Indexed16)
}

fn update(ctx: &Context, gpu: &GpuScene, scene: &RayScene, mode: BuildMode) -> Result<()> {
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), mode)?;
    ctx.submit(cmd)?;
    Ok(())
}

#[test]
fn a_rebuild_takes_more_and_fewer_instances() -> Result<()> {
    for_each_method(|ctx, method, tracer| {
        let gpu = spiral(5, 0.0).upload_with(ctx, BuildFlags::default(), BuildFlags::FAST_BUILD, 12)?;
        for (count, turn) in [(5, 0.0), (12, 0.5), (2, 1.0), (9, 1.5)] {
            let scene = spiral(count, turn);
            update(ctx, &gpu, &scene, BuildMode::Rebuild)?;
            check(&format!("{count} instances by {method:?}"), tracer, &gpu, &scene)?;
        }
        let none = RayScene { placed: Vec::new(), ..spiral(2, 0.0) };
        update(ctx, &gpu, &none, BuildMode::Rebuild)?;
        let records = tracer.trace(&gpu.tlas, &rays(), How::default())?;
        assert!(records.iter().all(|record| record.kind == 0), "there is nothing left to hit");
        Ok(())
    })
}

#[test]
fn a_refit_moves_instances() -> Result<()> {
    for_each_method(|ctx, method, tracer| {
        let gpu = spiral(8, 0.0).upload_with(ctx, BuildFlags::default(), UPDATABLE, 0)?;
        for turn in [0.4, 1.9] {
            let scene = spiral(8, turn);
            update(ctx, &gpu, &scene, BuildMode::Refit)?;
            check(&format!("turned by {turn}, {method:?}"), tracer, &gpu, &scene)?;
        }
        Ok(())
    })
}

/// Refits that need not wait for each other, and two of one acceleration structure, which must; what they show before and after that
/// is built, traced and destroyed in between.
#[test]
fn many_accel_structs_are_refitted_in_one_command_buffer() -> Result<()> {
    for_each_method(|ctx, method, tracer| {
        let upload = |turn| spiral(8, turn).upload_with(ctx, UPDATABLE, UPDATABLE, 0);
        let all = [0.0, 0.3, 0.6].into_iter().map(upload).collect::<Result<Vec<_>>>()?;
        let rays = rays();
        let trace_buffers_of_all = all.iter().map(|_| tracer.buffers(&rays)).collect::<Result<Vec<_>>>()?;
        let shown = instances(&spiral(8, 0.0).placed, &all[0].models);
        for round in [1.0, 2.0] {
            let scene = |number: usize, step: f32| spiral(8, round + number as f32 * 0.5 + step);
            let refit = |cmd: &mut lvk::CommandBuffer, number: usize, step| {
                let list = instances(&scene(number, step).placed, &all[number].models);
                cmd.update_tlas(*all[number].tlas, &list, BuildMode::Refit)
            };
            let mut cmd = ctx.acquire_command_buffer()?;
            (0..3).try_for_each(|number| refit(&mut cmd, number, 0.1))?;
            refit(&mut cmd, 0, 0.2)?;
            tracer.record(&mut cmd, &all[0].tlas, &trace_buffers_of_all[0], How::default())?;
            refit(&mut cmd, 1, 0.2)?;
            cmd.build_blas(&[*all[2].models[0]], BuildMode::Refit)?;
            refit(&mut cmd, 2, 0.2)?;
            tracer.record(&mut cmd, &all[1].tlas, &trace_buffers_of_all[1], How::default())?;
            tracer.record(&mut cmd, &all[2].tlas, &trace_buffers_of_all[2], How::default())?;
            ctx.submit(cmd)?;
            for (number, trace_buffers) in trace_buffers_of_all.iter().enumerate() {
                let what = format!("structure {number} in round {round} by {method:?}");
                agree(&what, &rays, &tracer.read(trace_buffers)?, &scene(number, 0.2));
            }
        }
        // The same acceleration structures shown by another one, and then no longer there.
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.update_tlas(*all[1].tlas, &shown, BuildMode::Refit)?;
        ctx.submit(cmd)?;
        check("shown by another", tracer, &all[1], &spiral(8, 0.0))?;
        let mut all = all;
        all[0].models.clear();
        let mut cmd = ctx.acquire_command_buffer()?;
        let refused = cmd.update_tlas(*all[1].tlas, &shown, BuildMode::Refit);
        assert!(matches!(refused, Err(lvk::Error::StaleHandle { .. })), "{refused:?}");
        cmd.update_tlas(*all[1].tlas, &instances(&spiral(8, 0.4).placed, &all[1].models), BuildMode::Refit)?;
        ctx.submit(cmd)?;
        check("after its models are gone", tracer, &all[1], &spiral(8, 0.4))?;
        Ok(())
    })
}

/// A mesh that a dispatch deforms before each of its builds, and rays that meet it.
struct DeformingMesh {
    deformer: VertexDeformer,
    tracer: RayTracer,
    scene: RayScene,
    gpu: GpuScene,
    rays: Vec<Ray>,
}

impl DeformingMesh {
    fn new(ctx: &Context, method: Method) -> Result<Self> {
        let scene = deformable();
        let gpu = scene.upload_with(ctx, UPDATABLE, UPDATABLE, 0)?;
        let (deformer, tracer) = (VertexDeformer::new(ctx)?, RayTracer::new(ctx, method)?);
        Ok(Self { deformer, tracer, scene, gpu, rays: rays() })
    }

    /// Deforms, builds and traces in one submission.
    fn submit(
        &mut self,
        ctx: &Context,
        trace_buffers: &TraceBuffers,
        amount: f32,
        mode: BuildMode,
    ) -> Result<()> {
        let Self { deformer, tracer, scene, gpu, .. } = self;
        let mesh = &mut scene.models[0][0].mesh;
        let mut cmd = ctx.acquire_command_buffer()?;
        deformer.record(&mut cmd, *gpu.buffers[0].vertices, mesh, amount)?;
        *mesh = deformed(mesh, amount);
        cmd.build_blas(&[*gpu.models[0]], mode)?;
        cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), mode)?;
        tracer.record(&mut cmd, &gpu.tlas, trace_buffers, How::default())?;
        ctx.submit(cmd)?;
        Ok(())
    }
}

#[test]
fn an_accel_struct_is_refitted_to_vertices_written_by_a_dispatch() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    for method in Method::available(&ctx) {
        let mut all = DeformingMesh::new(&ctx, method)?;
        let trace_buffers = all.tracer.buffers(&all.rays)?;
        for (amount, mode) in [(0.3, BuildMode::Refit), (-0.5, BuildMode::Refit), (0.4, BuildMode::Rebuild)] {
            all.submit(&ctx, &trace_buffers, amount, mode)?;
            let what = format!("deformed by {amount}, {method:?}");
            agree(&what, &all.rays, &all.tracer.read(&trace_buffers)?, &all.scene);
        }
    }
    Ok(())
}

#[test]
fn an_accel_struct_is_rebuilt_from_uploaded_vertices() -> Result<()> {
    for_each_method(|ctx, method, tracer| {
        let mut scene = deformable();
        let gpu = scene.upload(ctx)?;
        check(&format!("before, by {method:?}"), tracer, &gpu, &scene)?;
        scene.models[0][0].mesh = deformed(&scene.models[0][0].mesh, 0.6);
        let bytes = vertex_bytes(&scene.models[0][0].mesh, Layout::Indexed16);
        ctx.upload_buffer(*gpu.buffers[0].vertices, 0, &bytes)?;
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.build_blas(&[*gpu.models[0]], BuildMode::Rebuild)?;
        cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
        ctx.submit(cmd)?;
        check(&format!("after, by {method:?}"), tracer, &gpu, &scene)?;
        Ok(())
    })
}

/// One TLAS, one deforming BLAS and one vertex buffer for all frames, none of which waits for the frame before.
#[test]
fn every_frame_in_flight_sees_its_own_state() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    for method in Method::available(&ctx) {
        let mut all = DeformingMesh::new(&ctx, method)?;
        let mut frames = Vec::new();
        for number in 0..6 {
            ctx.next_frame()?;
            let (amount, mode) =
                if number % 3 == 2 { (-0.35, BuildMode::Rebuild) } else { (0.2, BuildMode::Refit) };
            let trace_buffers = all.tracer.buffers(&all.rays)?;
            all.scene.placed[0].transform = Affine3A::from_rotation_z(number as f32);
            all.scene.placed[0].custom_index = number;
            all.submit(&ctx, &trace_buffers, amount, mode)?;
            frames.push((trace_buffers, all.scene.clone()));
        }
        for (number, (trace_buffers, scene)) in frames.iter().enumerate() {
            let what = format!("frame {number} by {method:?}");
            agree(&what, &all.rays, &all.tracer.read(trace_buffers)?, scene);
        }
    }
    Ok(())
}

/// Acceleration structures that the top level still shows outlive their holders.
#[test]
fn a_destroyed_blas_is_referenced_until_the_next_update() -> Result<()> {
    for_each_method(|ctx, method, tracer| {
        let scene = spiral(6, 0.2);
        let mut gpu = scene.upload(ctx)?;
        gpu.models.clear();
        gpu.buffers.clear();
        ctx.wait_idle()?;
        check(&format!("destroyed models by {method:?}"), tracer, &gpu, &scene)?;
        Ok(())
    })
}

/// An update of a dropped command buffer has no effect, and the BLASes of the TLAS stay alive.
#[test]
fn a_cancelled_command_buffer_changes_nothing() -> Result<()> {
    for_each_method(|ctx, method, tracer| {
        let scene = deformable();
        let mut gpu = scene.upload_with(ctx, BuildFlags::default(), UPDATABLE, 4)?;
        ctx.wait_idle()?;
        let other = spiral(3, 0.0);
        let other_gpu = other.upload(ctx)?;
        let mut cmd = ctx.acquire_command_buffer()?;
        let others = instances(&other.placed, &other_gpu.models);
        cmd.update_tlas(*gpu.tlas, &others, BuildMode::Rebuild)?;
        assert!(
            cmd.update_tlas(*gpu.tlas, &others[..1], BuildMode::Refit).is_err(),
            "three were recorded before"
        );
        cmd.update_tlas(*gpu.tlas, &others, BuildMode::Refit)?;
        drop(cmd);
        let one = instances(&scene.placed, &gpu.models);
        let mut cmd = ctx.acquire_command_buffer()?;
        assert!(cmd.update_tlas(*gpu.tlas, &others, BuildMode::Refit).is_err(), "three were never built");
        cmd.update_tlas(*gpu.tlas, &one, BuildMode::Refit)?;
        drop(cmd);
        gpu.models.clear();
        ctx.wait_idle()?;
        let _takes_its_place = scene.upload(ctx)?;
        check(&format!("given up, {method:?}"), tracer, &gpu, &scene)?;
        Ok(())
    })
}

/// Two command buffers are recorded side by side; the first submitted changes how many instances the second refits.
#[test]
fn a_refit_overtaken_by_a_rebuild_of_another_count_is_refused() -> Result<()> {
    for_each_method(|ctx, method, tracer| {
        let gpu = spiral(3, 0.0).upload_with(ctx, BuildFlags::default(), UPDATABLE, 4)?;
        let three = instances(&spiral(3, 0.0).placed, &gpu.models);
        let two = spiral(2, 1.0);
        let mut rebuild = ctx.acquire_command_buffer()?;
        rebuild.update_tlas(*gpu.tlas, &instances(&two.placed, &gpu.models), BuildMode::Rebuild)?;
        let mut refit = ctx.acquire_command_buffer()?;
        refit.update_tlas(*gpu.tlas, &three, BuildMode::Refit)?;
        ctx.submit(rebuild)?;
        assert!(matches!(ctx.submit(refit), Err(lvk::Error::InvalidUsage { .. })));
        check(&format!("two are shown, {method:?}"), tracer, &gpu, &two)?;
        Ok(())
    })
}

/// A rebuild reads the indices again and a refit does not, where the library has put the triangles into an order: so
/// empty triangles tell the two apart.
#[test]
fn cancelled_builds_do_not_count_as_wear() -> Result<()> {
    let Some(ctx) =
        device().filter(|ctx| requires_device_accel_structs(ctx, "indices that a refit does not read"))
    else {
        return Ok(());
    };
    let queries = ctx.capabilities().ray_query_path == RayQueryPath::Hardware;
    let tracer = RayTracer::new(&ctx, if queries { Method::Query } else { Method::Pipeline })?;
    let ring = Mesh::torus(10);
    let count = ring.triangles.len();
    let triangles = (0..count).map(|index| ring.triangles[index * 211 % count]).collect();
    let scene = RayScene::single(Mesh { triangles, ..ring }, Layout::Indexed16);
    let (_buffers, geometries) = upload_geometries(&ctx, &scene.models[0])?;
    let order = PrimitiveOrder::Spatial;
    let blas = ctx.create_blas(&BlasDesc {
        geometries: &geometries,
        flags: UPDATABLE,
        order,
        ..Default::default()
    })?;
    assert!(ctx.accel_struct_info(*blas)?.is_remapped);
    let shown = [lvk::TlasInstance::new(*blas)];
    let tlas = ctx.create_tlas(&TlasDesc { instances: &shown, ..Default::default() })?;
    let BlasGeometry::Triangles(Triangles { indices: Some(indices), .. }) = geometries[0] else {
        unreachable!("triangles with indices")
    };
    ctx.wait_idle()?;
    ctx.upload_buffer(indices.buffer, indices.offset, &vec![0; count * 3 * 2])?;
    let auto = BuildMode::Auto { max_refits: 2 };
    let is_there = |modes: &[BuildMode], submits: bool| -> Result<bool> {
        let mut cmd = ctx.acquire_command_buffer()?;
        modes.iter().try_for_each(|mode| cmd.build_blas(&[*blas], *mode))?;
        cmd.update_tlas(*tlas, &shown, BuildMode::Rebuild)?;
        if submits {
            ctx.submit(cmd)?;
        } else {
            drop(cmd);
        }
        let records = tracer.trace(&tlas, &rays(), How::default())?;
        Ok(records.iter().any(|record| record.kind != 0))
    };
    assert!(is_there(&[auto], true)?, "the first refit");
    assert!(is_there(&[BuildMode::Refit, BuildMode::Refit], false)?);
    assert!(is_there(&[auto], true)?, "the second");
    assert!(is_there(&[BuildMode::Rebuild], false)?);
    assert!(!is_there(&[auto], true)?, "worn out, so it was rebuilt");
    ctx.upload_buffer(indices.buffer, indices.offset, &index_bytes(&scene.models[0][0].mesh))?;
    assert!(!is_there(&[auto, auto], true)?, "rebuilt just now, so it was refitted");
    assert!(is_there(&[auto], true)?, "both refits of the command buffer counted");
    ctx.upload_buffer(indices.buffer, indices.offset, &vec![0; count * 3 * 2])?;
    assert!(!is_there(&[auto, auto, auto], true)?, "and do so within one");
    Ok(())
}

/// The first rebuild gives a software BVH another tree, so its bytes tell a rebuild from a refit. Refits of unmoved
/// vertices change nothing but AABBs, and these by the first refit alone.
#[test]
fn cancelled_software_builds_do_not_count_as_wear() -> Result<()> {
    let Some(ctx) = software_alone(|_| ()) else { return Ok(()) };
    let gpu = deformable().upload_with(&ctx, UPDATABLE, UPDATABLE, 0)?;
    let blas = *gpu.models[0];
    let auto = BuildMode::Auto { max_refits: 2 };
    let after = |modes: &[BuildMode], submits: bool| -> Result<Vec<u8>> {
        let mut cmd = ctx.acquire_command_buffer()?;
        modes.iter().try_for_each(|mode| cmd.build_blas(&[blas], *mode))?;
        if submits {
            ctx.submit(cmd)?;
        } else {
            drop(cmd);
        }
        ctx.serialize_blas(blas)
    };
    let refitted = after(&[auto], true)?;
    let is_rebuilt = |modes: &[BuildMode], submits| Ok::<_, Error>(after(modes, submits)? != refitted);
    assert!(!is_rebuilt(&[BuildMode::Refit, BuildMode::Refit], false)?);
    assert!(!is_rebuilt(&[auto], true)?, "the second");
    assert!(!is_rebuilt(&[BuildMode::Rebuild], false)?);
    assert!(is_rebuilt(&[auto], true)?, "worn out, so it was rebuilt");
    Ok(())
}

fn index_bytes(mesh: &Mesh) -> Vec<u8> {
    mesh.triangles.iter().flatten().flat_map(|index| (*index as u16).to_le_bytes()).collect()
}
