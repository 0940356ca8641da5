//! Meshes that are split because the device takes no larger ones: hits, shaders and numbers equal those of the whole
//! mesh.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{
    BlasDesc, BlasGeometry, BufferDesc, BufferUsage, BuildFlags, DeviceProfile, GeometryFlags,
    GeometryTransform, HitGroup, InstanceFlags, PrimitiveOrder, RayTracingPipelineDesc, Result, ShaderRecord,
    ShaderStage, TlasDesc,
};
use lvk_tests::accel_backend::{builds_device_accel_structs, expect_parts};
use lvk_tests::hit_check::{HitCheck, rays_for, same_hits};
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Part, Placed, RayScene, instances, upload_geometries};
use lvk_tests::ray_tracer::{CULL_BACK, CULL_FRONT, How, MISSED, Method, RayTracer, shader, shader_with};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::reference::Hit;
use lvk_tests::sphere_scene::{GROUPS, SphereModel};
use lvk_tests::{TestDevice, device, device_with, without_software};

/// Creates a context whose BLASes take at most `primitives` primitives.
fn device_of(primitives: u64) -> Option<TestDevice> {
    let profile = DeviceProfile {
        name: "small structures".into(),
        max_blas_primitives: primitives,
        ..DeviceProfile::default()
    };
    device_with(|desc| desc.profile = Some(&profile))
}

fn turned(angle: f32, scale: Vec3, to: Vec3) -> Affine3A {
    let turn = Quat::from_axis_angle(Vec3::new(1.0, 2.0, -0.5).normalize(), angle);
    Affine3A::from_scale_rotation_translation(scale, turn, to)
}

/// A model of four geometries in all layouts, two of them not opaque, and one of 12 triangles.
fn models() -> Vec<Vec<Part>> {
    let part = |mesh, layout, flags, transform| Part { flags, transform, ..Part::new(mesh, layout) };
    let (opaque, seen_through) = (GeometryFlags::OPAQUE, GeometryFlags::empty());
    let mirrored = turned(2.0, Vec3::new(1.5, -1.0, 1.0), Vec3::NEG_Y);
    let stretched = turned(0.7, Vec3::new(1.0, 0.5, 1.5), Vec3::X);
    vec![
        vec![
            part(Mesh::sphere(7), Layout::Unshared, seen_through, None),
            part(
                Mesh::cube_grid(2),
                Layout::Indexed16,
                opaque,
                Some(Affine3A::from_translation(Vec3::Y * 2.0)),
            ),
            part(Mesh::torus(7), Layout::Interleaved, opaque, Some(stretched)),
            part(
                Mesh::terrain(7),
                Layout::Indexed32,
                seen_through | GeometryFlags::NO_DUPLICATE_ANY_HIT,
                Some(mirrored),
            ),
        ],
        vec![Part::new(Mesh::cube_grid(1), Layout::Unshared)],
        vec![Part::new(Mesh::torus(9), Layout::Indexed16)],
    ]
}

/// Split and unsplit models in turn, of all masks, custom indices, fronts and flags, a third of them mirrored.
fn scene() -> RayScene {
    let place = |index: u32| {
        let scale = Vec3::new(if index % 3 == 1 { -0.8 } else { 1.1 }, 0.9, 1.2);
        let to = Vec3::new((index % 3) as f32 * 3.1, (index / 3) as f32 * 3.3, (index % 2) as f32 * 2.0);
        let flags = match index {
            2 => InstanceFlags::FLIP_FACING,
            3 | 7 => InstanceFlags::NO_CULL,
            4 => InstanceFlags::FORCE_OPAQUE,
            5 => InstanceFlags::FORCE_NO_OPAQUE,
            _ => InstanceFlags::empty(),
        };
        Placed {
            custom_index: 0xff_ffff - index * 1_000,
            mask: 1 << (index % 4),
            flags,
            ..Placed::new([0, 1, 0, 2, 0, 2, 1, 0, 2][index as usize], turned(index as f32, scale, to))
        }
    };
    RayScene { models: models(), placed: (0..9).map(place).collect() }
}

/// As the plain device, whose numbers are Vulkan's own, and as the reference say.
#[test]
fn a_split_mesh_is_hit_like_the_whole_one_whatever_limit_splits_it() -> Result<()> {
    let Some(plain) = device() else { return Ok(()) };
    let scene = RayScene::single(Mesh::torus(14), Layout::Indexed16);
    let whole = scene.upload_with(&plain, BuildFlags::FAST_BUILD, BuildFlags::default(), 0)?;
    let info = plain.accel_struct_info(*whole.models[0])?;
    assert_eq!((info.parts, info.is_remapped), (1, false));
    let reference = scene.reference();
    let rays = rays_for(&reference);
    let of_whole: Vec<_> = HitCheck::new(&plain)?
        .tracers()
        .map(|(_, tracer)| tracer.trace(&whole.tlas, &rays, How::default()))
        .collect::<Result<_>>()?;
    let any = DeviceProfile { name: "small structures".into(), ..DeviceProfile::default() };
    let structure_bytes = plain.accel_struct_sizes(*whole.models[0])?.structure_bytes / 9;
    for profile in [
        DeviceProfile { max_blas_primitives: 31, ..any.clone() },
        DeviceProfile {
            scratch_bytes_per_primitive: 5_000,
            max_accel_scratch_bytes: 200_000,
            min_scratch_alignment: 256,
            ..any.clone()
        },
        DeviceProfile { max_accel_structure_bytes: structure_bytes, ..any },
    ] {
        let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return Ok(()) };
        let split = scene.upload(&ctx)?;
        let info = ctx.accel_struct_info(*split.models[0])?;
        expect_parts(&ctx, *split.models[0], 5..=90)?;
        assert_eq!(info.is_remapped, builds_device_accel_structs(&ctx), "{info:?}");
        for ((method, tracer), of_whole) in HitCheck::new(&ctx)?.tracers().zip(&of_whole) {
            let what = format!("{} parts, {method:?}", info.parts);
            let records = tracer.trace(&split.tlas, &rays, How::default())?;
            let at_edges = same_hits(&what, &rays, (of_whole, &records), &reference);
            assert!(at_edges * 100 < rays.len(), "{what}: {at_edges} differ");
            HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff)).assert(&what);
        }
    }
    Ok(())
}

#[test]
fn split_and_whole_meshes_share_a_scene() -> Result<()> {
    let Some(ctx) = device_of(24) else { return Ok(()) };
    let scene = scene();
    let gpu = scene.upload(&ctx)?;
    for (model, expected) in gpu.models.iter().zip([5..=90, 1..=1, 5..=90]) {
        expect_parts(&ctx, **model, expected)?;
    }
    let reference = scene.reference();
    let rays = rays_for(&reference);
    let check = HitCheck::new(&ctx)?;
    for mask in [0xff, 0b0001, 0b0110] {
        let (what, how) = (format!("mask {mask:#b}"), How { mask, ..How::default() });
        check.closest(&what, &gpu.tlas, &rays, how, |ray| reference.closest(ray, mask))?;
        for (method, tracer) in check.tracers() {
            let shadows = tracer.trace(&gpu.tlas, &rays, How { mask, ..How::shadows() })?;
            HitComparison::of_occlusion(&rays, &shadows, |ray| reference.occluded(ray, mask))
                .assert(&format!("shadows, {what}, {method:?}"));
        }
    }
    let faces = |hit: &Hit, front| hit.is_front == front || [3, 7].contains(&hit.ids.instance);
    for (flags, front) in [(CULL_BACK, true), (CULL_FRONT, false)] {
        let answer = |ray: &Ray| reference.closest_where(ray, 0xff, |hit| faces(hit, front));
        check.closest("culling", &gpu.tlas, &rays, How { flags, ..How::default() }, answer)?;
    }
    Ok(())
}

/// The any-hit shader decides by the number of the primitive, which is not the one that Vulkan counts.
#[test]
fn any_hit_shaders_know_the_primitives_of_split_meshes() -> Result<()> {
    let Some(ctx) = device_of(30) else { return Ok(()) };
    let scene = scene();
    let gpu = scene.upload(&ctx)?;
    expect_parts(&ctx, *gpu.models[0], 5..=90)?;
    let reference = scene.reference();
    let rays = rays_for(&reference);
    let has_holes = |hit: &Hit| match scene.placed[hit.ids.instance as usize].flags {
        InstanceFlags::FORCE_OPAQUE => false,
        InstanceFlags::FORCE_NO_OPAQUE => true,
        _ => {
            let model = scene.placed[hit.ids.instance as usize].model;
            !scene.models[model][hit.ids.geometry as usize].flags.contains(GeometryFlags::OPAQUE)
        }
    };
    let answer = |ray: &Ray| {
        reference.closest_where(ray, 0xff, |hit| hit.ids.primitive.is_multiple_of(2) || !has_holes(hit))
    };
    HitCheck::with_even_primitives(&ctx)?.closest("holes", &gpu.tlas, &rays, How::default(), answer)
}

/// The group is the instance's offset and the geometry's place, which a part without some geometries must not shift.
#[test]
fn parts_keep_hit_groups() -> Result<()> {
    const TAGGED_HIT: &str = r#"
        #include "ray_records.glsl"
        layout(shaderRecordEXT, scalar) buffer Record { uint tag; };
        layout(location = 0) rayPayloadInEXT HitRecord record;
        void main() {
            record = HitRecord(gl_HitTEXT, vec2(0), tag, lvkInstanceId(tlas), gl_InstanceCustomIndexEXT,
                               lvkGeometryIndex(), lvkPrimitiveIndex(tlas));
        }"#;
    const RAY_GEN: &str = include_str!("../../shaders/closest.rgen.glsl");
    let Some(ctx) = device_of(24) else { return Ok(()) };
    if !Method::available(&ctx).contains(&Method::Pipeline) {
        return Ok(());
    }
    let defines = [("SBT_STRIDE", "1")];
    let ray_gen = shader_with(&ctx, ShaderStage::RayGen, RAY_GEN, &defines)?;
    let miss = shader(&ctx, ShaderStage::Miss, include_str!("../../shaders/record.rmiss.glsl"))?;
    let hit = shader(&ctx, ShaderStage::ClosestHit, TAGGED_HIT)?;
    let records: Vec<_> = (0..13_u32).map(|group| (100 + group).to_ne_bytes()).collect();
    let group = |record| HitGroup { closest_hit: Some(*hit), record, ..Default::default() };
    let groups: Vec<_> = records.iter().map(|record| group(ShaderRecord::from_bytes(record))).collect();
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &groups,
        ..Default::default()
    })?;
    let mut scene = scene();
    (0..).zip(&mut scene.placed).for_each(|(index, placed)| placed.hit_group_offset = index);
    let gpu = scene.upload(&ctx)?;
    expect_parts(&ctx, *gpu.models[0], 5..)?;
    let reference = scene.reference();
    let rays = rays_for(&reference);
    let records = RayTracer::from_pipeline(&ctx, pipeline).trace(&gpu.tlas, &rays, How::default())?;
    HitComparison::of_shapes(&rays, &records, |ray| reference.closest(ray, 0xff)).assert("hit groups");
    let mut tags: Vec<_> =
        records.iter().filter(|hit| hit.kind != MISSED).map(|hit| (hit.kind, hit)).collect();
    assert!(tags.iter().all(|(tag, hit)| *tag == 100 + hit.instance + hit.geometry));
    tags.sort_by_key(|(tag, _)| *tag);
    tags.dedup_by_key(|(tag, _)| *tag);
    assert!(tags.len() > 8, "the rays reach many groups");
    Ok(())
}

/// The planner has to know a matrix to place the triangles it moves, and every part has to be built with it.
#[test]
fn a_transform_in_a_buffer_is_one_by_value() -> Result<()> {
    let Some(ctx) = device_of(28) else { return Ok(()) };
    let scene = RayScene { models: models(), placed: vec![Placed::new(0, Affine3A::IDENTITY)] };
    let (_buffers, mut geometries) = upload_geometries(&ctx, &scene.models[0])?;
    let mut floats = vec![f32::NAN; 4];
    for geometry in &mut geometries {
        let BlasGeometry::Triangles(triangles) = geometry else { continue };
        if let Some(GeometryTransform::Rows(rows)) = triangles.transform {
            floats.extend(rows);
        }
    }
    let data = Some(bytemuck::cast_slice(&floats));
    let usage = BufferUsage::ACCEL_INPUT;
    let matrices = ctx.create_buffer(&BufferDesc { data, usage, ..Default::default() })?;
    let mut offset = 16;
    for geometry in &mut geometries {
        let BlasGeometry::Triangles(triangles) = geometry else { continue };
        if triangles.transform.is_some() {
            triangles.transform = Some(GeometryTransform::Buffer { buffer: *matrices, offset });
            offset += 48;
        }
    }
    let blas = [ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })?];
    expect_parts(&ctx, *blas[0], 5..=90)?;
    let shown = instances(&scene.placed, &blas);
    let tlas = ctx.create_tlas(&TlasDesc { instances: &shown, ..Default::default() })?;
    HitCheck::new(&ctx)?.scene("matrices in a buffer", &tlas, &scene)
}

/// Intersection shaders find their sphere by the number of the AABB.
#[test]
fn intersection_shaders_know_the_aabbs_of_split_meshes() -> Result<()> {
    let Some(ctx) = device_of(5) else { return Ok(()) };
    let spheres = SphereModel { count: 21, step: 8 };
    let (_buffers, geometries) = spheres.aabb_geometries(&ctx)?;
    let model = [ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })?];
    expect_parts(&ctx, *model[0], 9..=40)?;
    let place = |index: u32| Placed {
        hit_group_offset: 1 - index,
        custom_index: 900 + index,
        ..Placed::new(0, turned(index as f32, Vec3::splat(1.2), Vec3::X * 8.0 * index as f32))
    };
    let placed = [place(0), place(1)];
    let tlas = ctx.create_tlas(&TlasDesc { instances: &instances(&placed, &model), ..Default::default() })?;
    let rays = random_rays(51, 1_500, Vec3::new(-4.0, -2.0, -6.0), Vec3::new(14.0, 14.0, 8.0));
    spheres.check_hits(&ctx, &tlas, &placed, &rays, "split boxes", |records| {
        for hit in records.iter().filter(|record| record.kind != MISSED) {
            let (radius, tag) = GROUPS[1 - hit.instance as usize];
            assert_eq!((hit.kind, hit.barycentrics), (tag, [radius, tag as f32]));
        }
    })?;
    Ok(())
}

/// The numbers of a part need not rise: parts are put into order like whole meshes, or left alone.
#[test]
fn parts_may_be_put_into_order() -> Result<()> {
    let Some(ctx) = device_of(100) else { return Ok(()) };
    let scene = RayScene::single(shuffled(&Mesh::torus(12)), Layout::Indexed16);
    let (_buffers, geometries) = upload_geometries(&ctx, &scene.models[0])?;
    let check = HitCheck::new(&ctx)?;
    for order in [PrimitiveOrder::Given, PrimitiveOrder::Spatial] {
        let blas = [ctx.create_blas(&BlasDesc { geometries: &geometries, order, ..Default::default() })?];
        expect_parts(&ctx, *blas[0], 6..=12)?;
        let shown = instances(&scene.placed, &blas);
        let tlas = ctx.create_tlas(&TlasDesc { instances: &shown, ..Default::default() })?;
        check.scene(&format!("{order:?}"), &tlas, &scene)?;
    }
    Ok(())
}

fn shuffled(mesh: &Mesh) -> Mesh {
    let count = mesh.triangles.len();
    let triangles = (0..count).map(|index| mesh.triangles[index * 211 % count]).collect();
    Mesh { positions: mesh.positions.clone(), triangles }
}

/// Two bytes a number and an odd number of triangles: the last index ends in the middle of a word.
#[test]
fn short_indices_are_gathered_to_the_last_byte() -> Result<()> {
    let Some(ctx) = device_of(9) else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    for layout in [Layout::Indexed16, Layout::Interleaved] {
        for left_out in [1, 2, 3] {
            let mut scene = RayScene::single(Mesh::torus(5), layout);
            scene.models[0][0].mesh.triangles.truncate(100 - left_out);
            let gpu = scene.upload(&ctx)?;
            expect_parts(&ctx, *gpu.models[0], 10..)?;
            check.scene(&format!("{layout:?}, {left_out} left out"), &gpu.tlas, &scene)?;
        }
    }
    Ok(())
}

/// A hit reports the same for any number of parts, down to one triangle a part.
#[test]
fn a_part_may_be_a_single_triangle() -> Result<()> {
    let Some(ctx) = device_of(1) else { return Ok(()) };
    let scene = RayScene::single(Mesh::cube_grid(1), Layout::Interleaved);
    let gpu = scene.upload(&ctx)?;
    expect_parts(&ctx, *gpu.models[0], 12..=12)?;
    HitCheck::new(&ctx)?.scene("a triangle a part", &gpu.tlas, &scene)
}

/// 95,700 triangles are 256 MiB of scratch on the phone: a few more make two parts at least.
#[test]
fn a_mesh_over_the_limits_of_the_phone_is_split() -> Result<()> {
    let profile = DeviceProfile::mali_g715();
    let Some(ctx) = without_software(|desc| desc.profile = Some(&profile)) else { return Ok(()) };
    assert!(!ctx.capabilities().ray_tracing_pipeline);
    if !ctx.capabilities().ray_query {
        eprintln!(
            "NOT TESTED, {} has no ray queries, and the phone nothing else",
            ctx.capabilities().device_name
        );
        return Ok(());
    }
    let scene = RayScene::single(Mesh::terrain(219), Layout::Indexed32);
    let gpu = scene.upload(&ctx)?;
    let sizes = ctx.accel_struct_sizes(*gpu.models[0])?;
    expect_parts(&ctx, *gpu.models[0], 2..=6)?;
    assert!(sizes.build_scratch_bytes <= 256 << 20, "{sizes:?}");
    let reference = scene.reference();
    let rays = rays_for(&reference);
    // Weights of triangles this small are not those of f64.
    let records = RayTracer::new(&ctx, Method::Query)?.trace(&gpu.tlas, &rays, How::default())?;
    HitComparison::of_shapes(&rays, &records, |ray| reference.closest(ray, 0xff)).assert("on the phone");
    assert!(ctx.accel_memory().scratch_bytes <= (256 << 20) + 256);
    Ok(())
}

/// A mesh for which the phone would ask 30 times what it can give, all of it a thousand times smaller.
#[test]
fn a_mesh_far_over_the_limits_of_the_phone_is_hit_like_the_whole_one() -> Result<()> {
    let scene = RayScene::single(Mesh::torus(28), Layout::Indexed32);
    let triangles = scene.models[0][0].mesh.triangles.len() as u64;
    let phone = DeviceProfile::mali_g715();
    let profile = DeviceProfile {
        name: "little phone".into(),
        max_accel_scratch_bytes: triangles * phone.scratch_bytes_per_primitive / 30,
        ray_tracing_pipeline: true,
        ..phone
    };
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return Ok(()) };
    let gpu = scene.upload(&ctx)?;
    expect_parts(&ctx, *gpu.models[0], 31..)?;
    assert_eq!(ctx.accel_struct_info(*gpu.models[0])?.is_remapped, builds_device_accel_structs(&ctx));
    HitCheck::new(&ctx)?.scene("many parts", &gpu.tlas, &scene)
}
