//! Transforms of instances and of geometries: non-uniform scales, shears, mirrors, very small and very large ones, by
//! value and from buffers; and many instances at one position.

use lvk::glam::{Affine3A, Mat3A, Quat, Vec3, Vec3A};
use lvk::{BuildFlags, BuildMode, DeviceProfile, InstanceFlags, Result, transform_rows};
use lvk_tests::hit_check::HitCheck;
use lvk_tests::meshes::Mesh;
use lvk_tests::random::Random;
use lvk_tests::ray_scene::{Layout, MATRIX_OFFSET, Part, Placed, RayScene, instances};
use lvk_tests::ray_tracer::{CULL_BACK, CULL_FRONT, How};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::{TestDevice, device, device_with};

fn devices() -> Vec<TestDevice> {
    let profile = DeviceProfile { max_blas_primitives: 60, ..DeviceProfile::default() };
    device().into_iter().chain(device_with(|desc| desc.profile = Some(&profile))).collect()
}

fn shear(along: [f32; 6]) -> Affine3A {
    let [a, b, c, d, e, f] = along;
    Affine3A::from_mat3(
        Mat3A::from_cols(Vec3A::new(1.0, a, b), Vec3A::new(c, 1.0, d), Vec3A::new(e, f, 1.0)).into(),
    )
}

/// Named matrices, none of which keeps angles.
fn matrices() -> Vec<(&'static str, Affine3A)> {
    let turn = Affine3A::from_quat(Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 1.1));
    let scale = |x, y, z| Affine3A::from_scale(Vec3::new(x, y, z));
    vec![
        ("uneven", scale(0.4, 1.6, 0.9)),
        ("mirrored in x", scale(-1.0, 1.0, 1.0)),
        ("mirrored in y and z", scale(0.7, -1.1, -0.9)),
        ("point reflection", scale(-0.8, -0.9, -1.0)),
        ("sheared", shear([0.6, 0.0, 0.0, 0.3, -0.4, 0.0])),
        ("sheared and mirrored", shear([0.2, 0.5, -0.3, 0.0, 0.0, 0.7]) * scale(1.0, 1.0, -1.0)),
        ("turned and uneven", turn * scale(0.3, 1.2, 1.0) * turn),
        ("turned, sheared, mirrored", turn * shear([0.0, 0.8, 0.2, 0.0, 0.0, -0.5]) * scale(-1.2, 0.5, 0.8)),
    ]
}

fn at(index: usize) -> Affine3A {
    Affine3A::from_translation(Vec3::new(
        (index % 3) as f32 * 4.5,
        (index / 3) as f32 * 4.5,
        index as f32 * 0.2,
    ))
}

/// Compares closest hits, and those of rays that see one side only.
fn check_sides(check: &HitCheck, ctx: &TestDevice, what: &str, scene: &RayScene) -> Result<()> {
    let gpu = scene.upload(ctx)?;
    check.scene(what, &gpu.tlas, scene)?;
    let reference = scene.reference();
    let (low, high) = reference.bounds();
    let rays = random_rays(101, 900, low.as_vec3(), high.as_vec3());
    for flags in [CULL_BACK, CULL_FRONT] {
        let how = How { flags, ..How::default() };
        let what = format!("{what}, one side");
        check.closest(&what, &gpu.tlas, &rays, how, |ray| reference.closest_by(ray, how))?;
    }
    Ok(())
}

#[test]
fn instances_are_scaled_sheared_and_mirrored() -> Result<()> {
    for ctx in devices() {
        let models = vec![vec![
            Part::new(Mesh::torus(8), Layout::Indexed16),
            Part::new(Mesh::cube_grid(1), Layout::Unshared),
        ]];
        let place = |(index, (_, matrix)): (usize, &(_, Affine3A))| Placed {
            custom_index: index as u32,
            flags: if index % 3 == 2 { InstanceFlags::FLIP_FACING } else { InstanceFlags::empty() },
            ..Placed::new(0, at(index) * *matrix)
        };
        let scene = RayScene { models, placed: matrices().iter().enumerate().map(place).collect() };
        check_sides(&HitCheck::new(&ctx)?, &ctx, "instances", &scene)?;
    }
    Ok(())
}

/// A geometry's own matrix moves its vertices: a mirror there turns the front round, one of the instance does not.
#[test]
fn geometries_are_moved_by_value_and_by_buffer() -> Result<()> {
    for ctx in devices() {
        for transform_in_buffer in [false, true] {
            let part = |(index, (_, matrix)): (usize, &(_, Affine3A))| {
                let layout = if index % 2 == 0 { Layout::Indexed32 } else { Layout::Unshared };
                let transform = Some(at(index) * *matrix);
                // One in three by the other way, so that both stand in one acceleration structure.
                let transform_in_buffer = transform_in_buffer != (index % 3 == 0);
                Part { transform, transform_in_buffer, ..Part::new(Mesh::torus(6), layout) }
            };
            let mut parts: Vec<_> = matrices().iter().enumerate().map(part).collect();
            parts.insert(3, Part::new(Mesh::sphere(5), Layout::Indexed16));
            let mirrored = at(1) * Affine3A::from_scale(Vec3::new(0.8, -0.9, 1.0));
            let placed = vec![Placed::new(0, at(0)), Placed::new(0, at(8) * mirrored)];
            let scene = RayScene { models: vec![parts], placed };
            let what = format!("geometries, mostly by buffer: {transform_in_buffer}");
            check_sides(&HitCheck::new(&ctx)?, &ctx, &what, &scene)?;
        }
    }
    Ok(())
}

/// A matrix in a buffer is read by every build: others written there later count for rebuilds and refits.
#[test]
fn a_matrix_in_a_buffer_is_read_again() -> Result<()> {
    for ctx in devices() {
        let check = HitCheck::new(&ctx)?;
        let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE;
        let mut scene = RayScene::single(Mesh::torus(8), Layout::Indexed16);
        scene.models[0][0] = Part {
            transform: Some(Affine3A::IDENTITY),
            transform_in_buffer: true,
            ..scene.models[0][0].clone()
        };
        let gpu = scene.upload_with(&ctx, flags, flags, 0)?;
        check.scene("as created", &gpu.tlas, &scene)?;
        for ((name, matrix), mode) in
            matrices().into_iter().zip([BuildMode::Refit, BuildMode::Rebuild].repeat(4))
        {
            scene.models[0][0].transform = Some(matrix);
            let Some(buffer) = &gpu.buffers[0].matrix else { unreachable!("the matrix lies in a buffer") };
            ctx.upload_buffer(**buffer, MATRIX_OFFSET, bytemuck::bytes_of(&transform_rows(&matrix)))?;
            let mut cmd = ctx.acquire_command_buffer()?;
            cmd.build_blas(&[*gpu.models[0]], mode)?;
            cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), mode)?;
            ctx.submit(cmd)?;
            check.scene(&format!("{name}, {mode:?}"), &gpu.tlas, &scene)?;
        }
    }
    Ok(())
}

/// Models a thousandth and a thousand in size, each with rays of its own size.
#[test]
fn very_small_and_very_large_instances_are_hit() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    for size in [1e-3, 1e3] {
        let mut scene = RayScene::single(Mesh::torus(8), Layout::Indexed16);
        let scale = Affine3A::from_scale(Vec3::new(size, 0.7 * size, -size));
        scene.placed = vec![Placed::new(0, scale)];
        let gpu = scene.upload(&ctx)?;
        let reference = scene.reference();
        // Directions as long as the model is large keep distances near 1.
        let stretched = |ray: Ray| Ray {
            origin: ray.origin.map(|x| x * size),
            direction: ray.direction.map(|x| x * size),
            ..ray
        };
        let rays: Vec<_> =
            random_rays(103, 900, Vec3::NEG_ONE, Vec3::ONE).into_iter().map(stretched).collect();
        let answer = |ray: &Ray| reference.closest(ray, 0xff);
        check.closest(&format!("size {size}"), &gpu.tlas, &rays, How::default(), answer)?;
    }
    Ok(())
}

/// Every instance reaches through all others, so that nothing but distances tells them apart.
#[test]
fn a_hundred_and_fifty_instances_overlap() -> Result<()> {
    for ctx in devices() {
        let mut random = Random::new(107);
        let mut place = |index: u32| {
            let turn = Quat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
            let scale = random.point(Vec3::splat(0.7), Vec3::splat(1.3));
            let to = random.direction() * random.between(0.0, 0.2);
            let transform = Affine3A::from_scale_rotation_translation(scale, turn, to);
            Placed {
                custom_index: 0xff_ffff - index,
                mask: (index % 255 + 1) as u8,
                ..Placed::new(index as usize % 3, transform)
            }
        };
        let models = [Mesh::cube_grid(1), Mesh::torus(4), Mesh::sphere(4)];
        let models = models.map(|mesh| vec![Part::new(mesh, Layout::Indexed16)]).to_vec();
        let scene = RayScene { models, placed: (0..150).map(&mut place).collect() };
        let gpu = scene.upload(&ctx)?;
        let check = HitCheck::new(&ctx)?;
        check.scene("overlapping", &gpu.tlas, &scene)?;
        let reference = scene.reference();
        let rays = random_rays(109, 600, Vec3::NEG_ONE, Vec3::ONE);
        for mask in [0x01, 0x80, 0x3c] {
            let how = How { mask, ..How::default() };
            let what = format!("overlapping, mask {mask:#x}");
            check.closest(&what, &gpu.tlas, &rays, how, |ray| reference.closest_by(ray, how))?;
        }
    }
    Ok(())
}
