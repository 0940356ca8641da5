//! Ray intervals (Tmin, Tmax): hits at their ends, just beside them, and rays without length. Every number is exact
//! in f32.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{GeometryFlags, Result};
use lvk_tests::device;
use lvk_tests::hit_check::{HitCheck, rays_for};
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Part, Placed, RayScene};
use lvk_tests::ray_tracer::{How, MISSED, Method, RayTracer};
use lvk_tests::rays::Ray;

/// Distances of the squares, along the ray of [`towards`].
const DISTANCES: [f32; 4] = [0.5, 1.0, 4.0, 64.0];

/// Squares across the z axis, opaque ones and others by turns; the last one is made by an instance of another scale.
fn squares() -> RayScene {
    let square = |z: f32| Mesh {
        positions: vec![[-4.0, -4.0, z], [4.0, -4.0, z], [4.0, 4.0, z], [-4.0, 4.0, z]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let [a, b, c, d] = DISTANCES;
    let see_through = |part| Part { flags: GeometryFlags::empty(), ..part };
    let part = |z: f32| Part::new(square(z), Layout::Indexed16);
    let models = vec![vec![part(a * 2.0), see_through(part(b * 2.0)), part(c * 2.0)], vec![part(d / 4.0)]];
    let scaled = Placed::new(1, Affine3A::from_scale(Vec3::new(1.0, 2.0, 8.0)));
    RayScene { models, placed: vec![Placed::new(0, Affine3A::IDENTITY), scaled] }
}

/// A ray whose direction is two long.
fn towards((t_min, t_max): (f32, f32)) -> Ray {
    Ray { t_min, t_max, ..Ray::new(Vec3::new(1.0, 2.0, 0.0), Vec3::Z * 2.0) }
}

/// The hits of rays that share all but their ends, `None` for a miss.
fn distances(tracer: &RayTracer, ranges: &[(f32, f32)], how: How) -> Result<Vec<Option<f32>>> {
    let rays: Vec<_> = ranges.iter().copied().map(towards).collect();
    let scene = squares();
    let gpu = scene.upload(tracer.context())?;
    let records = tracer.trace(&gpu.tlas, &rays, how)?;
    Ok(records.iter().map(|record| (record.kind != MISSED).then_some(record.t)).collect())
}

/// Every first square between the ends, which do not count themselves.
fn expected((t_min, t_max): (f32, f32)) -> Option<f32> {
    DISTANCES.into_iter().find(|t| t_min < *t && *t < t_max)
}

fn check(ranges: &[(f32, f32)]) -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let expected: Vec<_> = ranges.iter().copied().map(expected).collect();
    assert!(expected.contains(&None) && expected.iter().any(Option::is_some), "both happen");
    for method in Method::available(&ctx) {
        let tracer = RayTracer::new(&ctx, method)?;
        let found = distances(&tracer, ranges, How::default())?;
        for ((range, found), expected) in ranges.iter().zip(found).zip(&expected) {
            assert_eq!(found, *expected, "{range:?} by {method:?}");
        }
        let shadows = distances(&tracer, ranges, How::shadows())?;
        for ((range, found), expected) in ranges.iter().zip(shadows).zip(&expected) {
            assert_eq!(found.is_some(), expected.is_some(), "shadow of {range:?} by {method:?}");
        }
    }
    Ok(())
}

#[test]
fn a_hit_a_hair_inside_counts_and_one_outside_does_not() -> Result<()> {
    let beside = DISTANCES.iter().flat_map(|t| {
        let (before, after) = (t.next_down(), t.next_up());
        [(before, after), (after, 1e4), (0.0, before), (before, 1e4), (0.0, after), (after, after.next_up())]
    });
    check(&beside.collect::<Vec<_>>())
}

/// Triangles are hit between the ends of a ray, not at them ("Ray Intersection Candidate Determination").
#[test]
fn a_hit_at_an_end_does_not_count() -> Result<()> {
    let at = DISTANCES.iter().flat_map(|t| [(*t, 1e4), (0.0, *t), (*t, t.next_up()), (t.next_down(), *t)]);
    let between = DISTANCES.windows(2).map(|pair| (pair[0], pair[1]));
    check(&at.chain(between).collect::<Vec<_>>())
}

#[test]
fn a_ray_without_length_hits_nothing() -> Result<()> {
    let points = DISTANCES.iter().flat_map(|t| [(*t, *t), (t.next_up(), t.next_up()), (t * 1.5, t * 1.5)]);
    let some = [(0.0, 0.0), (0.0, 1e4)];
    check(&points.chain(some).collect::<Vec<_>>())
}

#[test]
fn a_ray_may_be_endless() -> Result<()> {
    let endless = DISTANCES.iter().flat_map(|t| [(t.next_down(), f32::INFINITY), (*t, f32::MAX)]);
    check(&endless.chain([(0.0, f32::INFINITY), (65.0, f32::INFINITY)]).collect::<Vec<_>>())
}

/// Distances are as long as directions are short, and in the space of a large instance directions are shorter.
#[test]
fn directions_may_be_very_short() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    for scale in [1.0, 1e6] {
        let scaled = Affine3A::from_scale(Vec3::splat(scale));
        let rotation = Quat::from_rotation_x(0.8);
        let turned = Affine3A::from_scale_rotation_translation(Vec3::splat(0.7), rotation, Vec3::ONE);
        let placed = vec![Placed::new(0, scaled), Placed::new(0, scaled * turned)];
        let scene = RayScene { placed, ..RayScene::single(Mesh::torus(8), Layout::Indexed16) };
        let gpu = scene.upload(&ctx)?;
        let reference = scene.reference();
        let across = |i: u16| Vec3::new(0.03 * f32::from(i) - 1.3, -4.0, 0.2) * scale;
        let along_axis = (0..90).map(|i| Ray { t_max: 1e8, ..Ray::new(across(i), Vec3::Y) });
        let rays: Vec<_> = rays_for(&reference).into_iter().chain(along_axis).collect();
        for length in [1e-10, 1e-6, 1e-3] {
            for (method, tracer) in check.tracers() {
                let mut records = tracer.trace(&gpu.tlas, &shortened(&rays, length), How::default())?;
                records.iter_mut().for_each(|record| record.t *= length);
                let what = format!("directions of {length:e}, scaled by {scale:e}, by {method:?}");
                HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff))
                    .assert(&what);
            }
        }
    }
    Ok(())
}

/// Rays as long as these by directions that are so much shorter.
fn shortened(rays: &[Ray], length: f32) -> Vec<Ray> {
    let short = |ray: &Ray| Ray {
        t_min: ray.t_min / length,
        t_max: ray.t_max / length,
        direction: ray.direction.map(|part| part * length),
        ..*ray
    };
    rays.iter().map(short).collect()
}
