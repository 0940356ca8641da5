//! Refits of trees whose leaves index vertices that triangles share: every triangle of a moved vertex follows, in
//! every geometry, and a NaN vertex removes only its own triangles.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{BuildFlags, BuildMode, Context, DeviceProfile, RayQueryRequest, Result, transform_rows};
use lvk_tests::hit_check::HitCheck;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{
    GpuScene, Layout, MATRIX_OFFSET, Part, PartBuffers, Placed, RayScene, instances, vertex_bytes,
};
use lvk_tests::vertex_deform::deformed;
use lvk_tests::{device, device_with};

const SMALL: BuildFlags = BuildFlags::LOW_MEMORY.union(BuildFlags::ALLOW_UPDATE);

/// Trees of the CPU and of the GPU.
const FLAGS: [BuildFlags; 2] = [SMALL, SMALL.union(BuildFlags::FAST_BUILD)];

/// A mesh behind vertices that no triangle names, and in front of others.
fn among_other_instances(mesh: &Mesh) -> Mesh {
    const OTHERS: u32 = 300;
    let others = [[7.0, f32::NAN, 9.0]; OTHERS as usize];
    Mesh {
        positions: [&others, &mesh.positions[..], &others].concat(),
        triangles: mesh.triangles.iter().map(|corners| corners.map(|corner| corner + OTHERS)).collect(),
    }
}

/// Models of one geometry and of several, whose vertices lie in every way and are moved by matrices or not.
fn scene() -> RayScene {
    let turned = Affine3A::from_rotation_translation(Quat::from_rotation_x(0.7), Vec3::new(0.2, 0.9, -0.3));
    let moved = |mesh, layout, transform_in_buffer| Part {
        transform: Some(turned),
        transform_in_buffer,
        ..Part::new(mesh, layout)
    };
    let models = vec![
        vec![
            Part::new(among_other_instances(&Mesh::torus(8)), Layout::Indexed16),
            moved(Mesh::cube_grid(2), Layout::Interleaved, true),
            moved(Mesh::terrain(6), Layout::Indexed32, false),
            Part::new(Mesh::cube_grid(1), Layout::Unshared),
        ],
        vec![Part::new(among_other_instances(&Mesh::sphere(8)), Layout::Indexed32)],
        vec![Part::new(Mesh::torus(5), Layout::Unshared)],
    ];
    let place = |model| Placed::new(model, Affine3A::from_translation(Vec3::X * 3.0 * model as f32));
    RayScene { models, placed: (0..3).map(place).collect() }
}

/// Bends every mesh, and turns those whose matrix lies in a buffer.
fn moved(scene: &RayScene, amount: f32) -> RayScene {
    let part = |part: &Part| {
        let turn = |matrix: Affine3A| match part.transform_in_buffer {
            true => Affine3A::from_rotation_z(amount) * matrix,
            false => matrix,
        };
        Part { mesh: deformed(&part.mesh, amount), transform: part.transform.map(turn), ..part.clone() }
    };
    let models = scene.models.iter().map(|parts| parts.iter().map(part).collect()).collect();
    RayScene { models, ..scene.clone() }
}

fn upload(ctx: &Context, part: &Part, buffers: &PartBuffers) -> Result<()> {
    ctx.upload_buffer(*buffers.vertices, 0, &vertex_bytes(&part.mesh, part.layout))?;
    let Some((buffer, matrix)) = buffers.matrix.as_ref().zip(part.transform.as_ref()) else { return Ok(()) };
    ctx.upload_buffer(**buffer, MATRIX_OFFSET, bytemuck::bytes_of(&transform_rows(matrix)))
}

/// Uploads the vertices of the scene and updates the acceleration structures.
fn follow(ctx: &Context, gpu: &GpuScene, scene: &RayScene, mode: BuildMode) -> Result<()> {
    let parts = scene.models.iter().flatten();
    parts.zip(&gpu.buffers).try_for_each(|(part, buffers)| upload(ctx, part, buffers))?;
    let models: Vec<_> = gpu.models.iter().map(|model| **model).collect();
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.build_blas(&models, mode)?;
    cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
    ctx.submit(cmd).map(drop)
}

#[test]
fn all_triangles_follow_their_vertices() -> Result<()> {
    use BuildMode::{Rebuild, Refit};
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    for flags in FLAGS {
        let mut scene = scene();
        let gpu = scene.upload_with(&ctx, flags, BuildFlags::default(), 0)?;
        check.scene(&format!("{flags:?}, built"), &gpu.tlas, &scene)?;
        for (amount, mode) in [(0.3, Refit), (-0.5, Refit), (0.2, Rebuild), (0.4, Refit)] {
            scene = moved(&scene, amount);
            follow(&ctx, &gpu, &scene, mode)?;
            check.scene(&format!("{flags:?}, {mode:?} by {amount}"), &gpu.tlas, &scene)?;
        }
    }
    Ok(())
}

/// Software only: drivers need not accept NaN in a refit.
#[test]
fn a_lost_vertex_takes_its_triangles_and_comes_back() -> Result<()> {
    let profile = DeviceProfile::no_ray_tracing();
    let bare = device_with(|desc| {
        desc.profile = Some(&profile);
        desc.ray_query = RayQueryRequest::Software;
    });
    let Some(ctx) = bare else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let whole = RayScene::single(Mesh::terrain(14), Layout::Indexed32);
    for flags in FLAGS {
        let gpu = whole.upload_with(&ctx, flags, BuildFlags::default(), 0)?;
        for (step, number) in [(19, f32::NAN), (5, f32::INFINITY), (7, f32::NAN)] {
            let mut scene = whole.clone();
            let positions = &mut scene.models[0][0].mesh.positions;
            positions.iter_mut().step_by(step).for_each(|position| position[1] = number);
            follow(&ctx, &gpu, &scene, BuildMode::Refit)?;
            check.scene(&format!("{flags:?}, every {step}th is {number}"), &gpu.tlas, &scene)?;
        }
        follow(&ctx, &gpu, &whole, BuildMode::Refit)?;
        check.scene(&format!("{flags:?}, whole again"), &gpu.tlas, &whole)?;
    }
    Ok(())
}
