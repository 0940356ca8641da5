//! Rays along the faces of AABBs and in the planes of flat ones. Every AABB that a ray touches is a candidate
//! (Vulkan, "Ray Intersection Candidate Determination": bounds may be larger than the AABB, never smaller). Every
//! number is exact in f32.

use lvk::glam::{Affine3A, Mat3, Vec3};
use lvk::{
    Aabbs, BlasDesc, BlasGeometry, BufferDesc, BufferUsage, BuildFlags, BuildMode, Context, GeometryFlags,
    RayQueryPath, Result, TlasDesc,
};
use lvk_tests::device;
use lvk_tests::ray_scene::{Placed, instances};
use lvk_tests::ray_tracer::{How, RayTracer, requires_ray_queries};
use lvk_tests::rays::Ray;

type Corners = [Vec3; 2];

/// Distance from an AABB at which a ray must miss it.
const BESIDE: f32 = 0.25;

/// Trees of the CPU and of the GPU, and such as are refitted.
const FLAGS: [BuildFlags; 4] = [
    BuildFlags::FAST_TRACE,
    BuildFlags::FAST_BUILD,
    BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE),
    BuildFlags::FAST_BUILD.union(BuildFlags::ALLOW_UPDATE),
];

fn tracer(ctx: &Context) -> Result<RayTracer> {
    let text = include_str!("../../shaders/touched_query.comp.glsl");
    RayTracer::from_query_text(ctx, text, &[])
}

/// AABBs of one size on a grid.
fn grid(counts: [u16; 3], size: Vec3) -> Vec<Corners> {
    let [x, y, z] = counts;
    let places = (0..x).flat_map(|i| (0..y).flat_map(move |j| (0..z).map(move |k| [i, j, k])));
    places.map(|at| Vec3::from(at.map(|at| f32::from(at) * 2.0))).map(|low| [low, low + size]).collect()
}

fn models() -> Vec<(&'static str, Vec<Corners>)> {
    let flat = Vec3::new(1.0, 0.0, 1.0);
    vec![
        ("a cube", grid([1; 3], Vec3::ONE)),
        ("a flat box", grid([1; 3], flat)),
        ("cubes", grid([3; 3], Vec3::ONE)),
        ("flat boxes in a plane", grid([6, 1, 5], flat)),
        ("sticks in a line", grid([30, 1, 1], Vec3::X)),
        ("points in a row", grid([31, 1, 1], Vec3::ZERO)),
        ("points at one place", vec![[Vec3::ZERO; 2]; 12]),
    ]
}

/// As they are; turned by a right angle, larger and elsewhere.
fn transforms() -> [Affine3A; 2] {
    let turned = Mat3::from_cols(Vec3::Z * 2.0, Vec3::X * -4.0, Vec3::Y);
    [Affine3A::IDENTITY, Affine3A::from_mat3_translation(turned, Vec3::new(16.0, -8.0, 4.0))]
}

/// Rays along every axis through corners, edges, faces and the middle of each AABB, and beside it.
fn rays(boxes: &[Corners]) -> Vec<Ray> {
    let mut rays = Vec::new();
    for [low, high] in boxes {
        for (along, sign) in (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
            for (a, b) in (0..5).flat_map(|a| (0..5).map(move |b| (a, b))) {
                let place = |axis: usize, which: usize| {
                    let (low, high) = (low[axis], high[axis]);
                    [low - BESIDE, low, (low + high) * 0.5, high, high + BESIDE][which]
                };
                let mut origin = Vec3::ZERO;
                origin[along] = if sign > 0.0 { low[along] - 1.0 } else { high[along] + 1.0 };
                origin[(along + 1) % 3] = place((along + 1) % 3, a);
                origin[(along + 2) % 3] = place((along + 2) % 3, b);
                rays.push(Ray::new(origin, Vec3::AXES[along] * sign));
            }
        }
    }
    rays
}

/// The AABBs that a ray along an axis touches.
fn touched(ray: &Ray, boxes: &[Corners]) -> u32 {
    let (origin, direction) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
    let touches = |[low, high]: &Corners| {
        let within = low.cmple(origin) & high.cmpge(origin);
        let ahead = direction.cmpgt(Vec3::ZERO) & high.cmpge(origin);
        let behind = direction.cmplt(Vec3::ZERO) & low.cmple(origin);
        (within | ahead | behind).all()
    };
    (0..).zip(boxes).filter(|(_, corners)| touches(corners)).fold(0, |all, (number, _)| all | 1 << number)
}

/// Returns the number of rays that miss an AABB that they touch, and the number that have a candidate elsewhere.
fn wrong(
    tracer: &RayTracer,
    boxes: &[Corners],
    flags: BuildFlags,
    transform: Affine3A,
) -> Result<[usize; 2]> {
    let ctx = tracer.context();
    let elsewhere: Vec<_> = boxes.iter().flat_map(|[low, high]| [*low * 0.5, *high + 3.0]).collect();
    let is_refitted = flags.contains(BuildFlags::ALLOW_UPDATE);
    let first = if is_refitted { &elsewhere[..] } else { boxes.as_flattened() };
    let buffer = ctx.create_buffer(&BufferDesc {
        data: Some(bytemuck::cast_slice(&floats(first))),
        usage: BufferUsage::ACCEL_INPUT,
        ..Default::default()
    })?;
    let (count, of) = (boxes.len() as u32, GeometryFlags::OPAQUE);
    let geometries = [BlasGeometry::Aabbs(Aabbs { buffer: *buffer, offset: 0, stride: 0, count, flags: of })];
    let model = [ctx.create_blas(&BlasDesc { geometries: &geometries, flags, ..Default::default() })?];
    if is_refitted {
        ctx.upload_buffer(*buffer, 0, bytemuck::cast_slice(&floats(boxes.as_flattened())))?;
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.build_blas(&[*model[0]], BuildMode::Refit)?;
        ctx.submit(cmd)?;
    }
    let placed = instances(&[Placed::new(0, transform)], &model);
    let tlas = ctx.create_tlas(&TlasDesc { instances: &placed, ..Default::default() })?;
    let rays = rays(boxes);
    let moved = |ray: &Ray| Ray {
        origin: transform.transform_point3(ray.origin.into()).into(),
        direction: transform.transform_vector3(ray.direction.into()).into(),
        ..*ray
    };
    let records = tracer.trace(&tlas, &rays.iter().map(moved).collect::<Vec<_>>(), How::default())?;
    let found = || rays.iter().zip(&records).map(|(ray, record)| (touched(ray, boxes), record.primitive));
    let missed = found().filter(|(touched, found)| touched & !found != 0).count();
    Ok([missed, found().filter(|(touched, found)| found & !touched != 0).count()])
}

fn floats(corners: &[Vec3]) -> Vec<f32> {
    corners.iter().flat_map(Vec3::to_array).collect()
}

/// Differences of a device's own traversal are printed, but do not fail the test.
#[test]
fn a_ray_that_touches_an_aabb_has_it_as_a_candidate() -> Result<()> {
    let Some(ctx) = device().filter(|ctx| requires_ray_queries(ctx)) else { return Ok(()) };
    let is_ours = ctx.capabilities().ray_query_path == RayQueryPath::Software;
    let tracer = tracer(&ctx)?;
    let mut all = Vec::new();
    for (name, boxes) in models() {
        for flags in FLAGS {
            for transform in transforms() {
                let [missed, in_vain] = wrong(&tracer, &boxes, flags, transform)?;
                if missed + in_vain > 0 {
                    all.push(format!("{name}, {flags:?}: {missed} missed, {in_vain} in vain"));
                }
            }
        }
    }
    eprintln!("{all:#?}");
    assert!(all.is_empty() || !is_ours, "{all:#?}");
    Ok(())
}
