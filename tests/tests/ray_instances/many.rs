//! TLASes of more than a hundred thousand instances, numbers at the limits of their bits, and updates that choose
//! between refit and rebuild.

use bytemuck::Zeroable;
use lvk::glam::{Affine3A, Vec3};
use lvk::{BuildFlags, BuildMode, Context, DeviceProfile, InstanceFlags, Result, TlasDesc};
use lvk_tests::accel_backend::expect_parts;
use lvk_tests::hit_check::HitCheck;
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{GpuScene, Layout, Part, Placed, RayScene, instances};
use lvk_tests::ray_tracer::{BACK, FRONT, HitRecord, How, MISSED, Method, RayTracer, requires_ray_queries};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::{device, device_with};

/// Instances of one triangle each, on the cells of a flat grid of this width.
const WIDTH: u32 = 330;
const COUNT: u32 = WIDTH * WIDTH;

/// A triangle that fills most of its cell, at a height of its own.
fn triangle(mesh_count: u32) -> Vec<Vec<Part>> {
    let mesh = |index: u32| {
        let high = 0.1 * index as f32;
        let positions = vec![[0.05, 0.0, 0.05], [0.95, high, 0.05], [0.05, 0.0, 0.95]];
        Mesh { positions, triangles: vec![[0, 1, 2]] }
    };
    (0..mesh_count).map(|index| vec![Part::new(mesh(index), Layout::Unshared)]).collect()
}

/// The cell of an instance; neighbours in the list are neighbours in space.
fn cell(index: u32) -> [u32; 2] {
    let spread = |bits: u32| (0..16).fold(0, |all, bit| all | (bits >> (2 * bit) & 1) << bit);
    [spread(index), spread(index >> 1)]
}

/// The cells along a Z curve that lie on the grid.
fn cells() -> Vec<[u32; 2]> {
    (0..512 * 512).map(cell).filter(|[x, z]| *x < WIDTH && *z < WIDTH).collect()
}

fn many(models: u32, height: f32) -> RayScene {
    let place = |(index, [x, z]): (u32, [u32; 2])| {
        let to = Vec3::new(x as f32, height * (x % 5) as f32, z as f32);
        let mask = 1 << (index % 8);
        Placed {
            custom_index: index,
            mask,
            ..Placed::new((index % models) as usize, Affine3A::from_translation(to))
        }
    };
    RayScene { models: triangle(models), placed: (0..).zip(cells()).map(place).collect() }
}

/// Rays down into the grid and along it.
fn rays() -> Vec<Ray> {
    let side = WIDTH as f32;
    let mut rays = random_rays(113, 300, Vec3::new(0.0, -2.0, 0.0), Vec3::new(side, 2.0, side));
    for ray in &mut rays[..200] {
        *ray = Ray {
            t_min: 0.0,
            t_max: 1e4,
            origin: [ray.origin[0].abs() % side, 40.0, ray.origin[2].abs() % side],
            direction: [0.02, -1.0, 0.01],
        };
    }
    rays
}

#[test]
fn a_hundred_thousand_instances_are_traced() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let scene = many(3, 0.1);
    assert_eq!(scene.placed.len(), COUNT as usize);
    let flags = BuildFlags::FAST_BUILD | BuildFlags::ALLOW_UPDATE;
    let gpu = scene.upload_with(&ctx, BuildFlags::default(), flags, COUNT + 5)?;
    let rays = rays();
    compare(&check, "many", &gpu, &scene, &rays)?;
    let higher = many(3, 0.3);
    update(&ctx, &gpu, &higher, BuildMode::Auto { max_refits: 1 })?;
    compare(&check, "many, higher", &gpu, &higher, &rays)?;
    let mut fewer = higher;
    fewer.placed.truncate(COUNT as usize - 30_000);
    update(&ctx, &gpu, &fewer, BuildMode::Auto { max_refits: 9 })?;
    compare(&check, "fewer", &gpu, &fewer, &rays)
}

/// As many, where a kernel puts the addresses in and the numbers are looked up: 60,000 instances of meshes cut in two.
#[test]
fn a_hundred_thousand_parts_of_split_meshes_are_traced() -> Result<()> {
    let profile = DeviceProfile { max_blas_primitives: 1, ..DeviceProfile::default() };
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let mut scene = many(2, 0.1);
    scene.placed.truncate(60_000);
    for model in &mut scene.models {
        let mesh = &mut model[0].mesh;
        mesh.positions.push([0.95, -0.05, 0.95]);
        mesh.triangles.push([1, 3, 2]);
        model[0].layout = Layout::Indexed16;
    }
    let gpu = scene.upload(&ctx)?;
    expect_parts(&ctx, *gpu.models[0], 2..=2)?;
    compare(&check, "many cut in two", &gpu, &scene, &rays())
}

fn compare(check: &HitCheck, what: &str, gpu: &GpuScene, scene: &RayScene, rays: &[Ray]) -> Result<()> {
    let reference = scene.reference();
    for mask in [0xff, 0x11] {
        let how = How { mask, ..How::default() };
        let what = format!("{what}, mask {mask:#x}");
        check.closest(&what, &gpu.tlas, rays, how, |ray| reference.closest_by(ray, how))?;
    }
    Ok(())
}

fn update(ctx: &Context, gpu: &GpuScene, scene: &RayScene, mode: BuildMode) -> Result<()> {
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), mode)?;
    ctx.submit(cmd)?;
    Ok(())
}

/// Some models in a row, which `step` moves and of which it counts more or fewer.
fn instances_in_a_row(step: u32) -> RayScene {
    let count = [3, 3, 3, 5, 5, 1, 6, 6, 0, 4][step as usize];
    let place = |index: u32| {
        let to = Vec3::new(index as f32 * 2.6, step as f32 * 0.3, 0.1 * (index * step) as f32);
        Placed {
            custom_index: step,
            ..Placed::new((index + step) as usize % 2, Affine3A::from_translation(to))
        }
    };
    let models = [Mesh::torus(6), Mesh::sphere(5)].map(|mesh| vec![Part::new(mesh, Layout::Indexed16)]);
    RayScene { models: models.to_vec(), placed: (0..count).map(place).collect() }
}

fn updatable_and_not(ctx: &Context) -> Result<Vec<GpuScene>> {
    let scenes = [BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE, BuildFlags::FAST_BUILD]
        .map(|top| instances_in_a_row(0).upload_with(ctx, BuildFlags::default(), top, 6));
    scenes.into_iter().collect()
}

/// `Auto` shows the same as a rebuild, whatever the flags and the counts, in one command buffer or in several.
#[test]
fn an_automatic_update_is_never_refused() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    for max_refits in [0, 1, 2, u32::MAX] {
        let mode = BuildMode::Auto { max_refits };
        for gpu in updatable_and_not(&ctx)? {
            for step in 0..10 {
                update(&ctx, &gpu, &instances_in_a_row(step), mode)?;
                if !instances_in_a_row(step).placed.is_empty() {
                    check.scene(&format!("step {step}, {mode:?}"), &gpu.tlas, &instances_in_a_row(step))?;
                }
            }
            let mut cmd = ctx.acquire_command_buffer()?;
            for step in [1, 2, 4, 6, 7] {
                cmd.update_tlas(*gpu.tlas, &instances(&instances_in_a_row(step).placed, &gpu.models), mode)?;
            }
            ctx.submit(cmd)?;
            check.scene(&format!("at once, {mode:?}"), &gpu.tlas, &instances_in_a_row(7))?;
        }
    }
    Ok(())
}

/// Records the offset into the shader binding table where others record the tag of a sphere.
fn offset_query(ctx: &Context) -> Result<RayTracer> {
    const OFFSETS: &str = r#"
        #include "ray_query_start.glsl"
        void main() {
            START_RAY_QUERY;
            while (lvkRayQueryProceed(rq)) {}
            HitRecord record = kNoHit;
            if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE) {
                record.kind = lvkRayQueryFrontFace(rq, LVK_COMMITTED) ? kFront : kBack;
                record.instance = lvkRayQueryInstanceId(rq, LVK_COMMITTED, tlas);
                record.customIndex = lvkRayQueryInstanceCustomIndex(rq, LVK_COMMITTED);
                record.geometry = lvkRayQueryInstanceShaderBindingTableRecordOffset(rq, LVK_COMMITTED);
            }
            hits.at[index] = record;
        }"#;
    RayTracer::from_query_text(ctx, OFFSETS, &[])
}

/// Numbers at the ends of their ranges, side by side, so that none spills into another.
fn at_limits() -> RayScene {
    const LARGEST: u32 = (1 << 24) - 1;
    let numbers = [
        (0, 0),
        (LARGEST, 0),
        (0, LARGEST),
        (LARGEST, LARGEST),
        (0x80_0000, 1),
        (1, 0x80_0000),
        (0xaa_aaaa, 0x55_5555),
    ];
    let flags = [InstanceFlags::empty(), InstanceFlags::all().difference(InstanceFlags::FORCE_NO_OPAQUE)];
    let mut placed = Vec::new();
    for (custom_index, hit_group_offset) in numbers {
        for (flags, mask) in flags.into_iter().flat_map(|flags| [0, 1, 0x80, 0xff].map(|mask| (flags, mask)))
        {
            let transform = Affine3A::from_translation(Vec3::X * placed.len() as f32);
            placed.push(Placed { custom_index, mask, hit_group_offset, flags, ..Placed::new(0, transform) });
        }
    }
    RayScene { models: triangle(1), placed }
}

#[test]
fn numbers_at_their_limits_are_reported() -> Result<()> {
    let Some(ctx) = device().filter(|ctx| requires_ray_queries(ctx)) else { return Ok(()) };
    let scene = at_limits();
    let gpu = scene.upload(&ctx)?;
    let above = |index: usize| Ray::new(Vec3::new(index as f32 + 0.3, 1.0, 0.3), Vec3::NEG_Y);
    let rays: Vec<_> = (0..scene.placed.len()).map(above).collect();
    let tracer = offset_query(&ctx)?;
    for mask in [0x01, 0x80, 0x7e, 0xff, 0] {
        let records = tracer.trace(&gpu.tlas, &rays, How { mask, ..How::default() })?;
        for (index, (record, placed)) in (0..).zip(records.iter().zip(&scene.placed)) {
            if placed.mask & mask == 0 {
                assert_eq!(record.kind, MISSED, "mask {mask:#x}: {placed:?}");
                continue;
            }
            let flipped = placed.flags.contains(InstanceFlags::FLIP_FACING);
            let expected = HitRecord {
                // From above the triangle turns anticlockwise in left-handed coordinates.
                kind: if flipped { FRONT } else { BACK },
                instance: index,
                custom_index: placed.custom_index,
                geometry: placed.hit_group_offset,
                ..Zeroable::zeroed()
            };
            assert_eq!(*record, expected, "mask {mask:#x}: {placed:?}");
        }
    }
    Ok(())
}

/// An acceleration structure with room for more shows what it was given, however much of the room that is.
#[test]
fn capacity_above_the_count_adds_no_hits() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    for capacity in [0, 6, 7, 1_000, 100_000] {
        let gpu = instances_in_a_row(6).upload_with(
            &ctx,
            BuildFlags::default(),
            BuildFlags::default(),
            capacity,
        )?;
        check.scene(&format!("room for {capacity}"), &gpu.tlas, &instances_in_a_row(6))?;
        update(&ctx, &gpu, &instances_in_a_row(2), BuildMode::Rebuild)?;
        check.scene(&format!("fewer, room for {capacity}"), &gpu.tlas, &instances_in_a_row(2))?;
        let more = RayScene {
            placed: vec![instances_in_a_row(6).placed[0]; capacity.max(6) as usize + 1],
            ..instances_in_a_row(6)
        };
        assert!(update(&ctx, &gpu, &more, BuildMode::Rebuild).is_err(), "one more than {capacity}");
        check.scene("as before", &gpu.tlas, &instances_in_a_row(2))?;
    }
    assert!(
        ctx.create_tlas(&TlasDesc { capacity: u32::MAX, parts_per_instance: u32::MAX, ..Default::default() })
            .is_err()
    );
    Ok(())
}

#[test]
fn flags_and_masks_at_their_limits_are_kept() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let scene = at_limits();
    // Hit groups beyond the table cannot be traced by pipeline, so the offsets go.
    let placed = scene.placed.iter().map(|placed| Placed { hit_group_offset: 0, ..*placed }).collect();
    let scene = RayScene { placed, ..scene };
    let gpu = scene.upload(&ctx)?;
    let reference = scene.reference();
    let rays = random_rays(117, 900, Vec3::new(0.0, -0.2, 0.0), Vec3::new(56.0, 0.2, 1.0));
    for method in Method::available(&ctx) {
        let tracer = RayTracer::new(&ctx, method)?;
        let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
        HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff))
            .assert(&format!("numbers at their limits by {method:?}"));
    }
    Ok(())
}
