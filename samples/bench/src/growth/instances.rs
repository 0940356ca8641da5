//! Cost of a TLAS with many instances.

use std::time::Instant;

use glam::{Affine3A, Quat, Vec3};
use lvk::{
    AccelStructHandle, BuildFlags, BuildMode, Context, Holder, PrimitiveOrder, TlasDesc, TlasInstance,
    transform_rows,
};

use super::backends::Backend;
use super::curve::{Curve, Expected, Unit};
use super::effort::{Effort, counted};
use super::group::{Group, GroupKey};
use super::terrain::terrain;
use crate::error::BenchError;
use crate::measure::{elapsed_ms, median_of};
use crate::mesh::{Mesh, MeshBuffers};
use crate::tracer::{RayKind, TracedImage};

/// Triangles of the mesh that all instances reference.
const MESH_TRIANGLES: u64 = 128;

pub(super) fn measure(backends: &[Backend], image: [u32; 2], effort: Effort) -> Result<Group, BenchError> {
    let sizes = GroupKey::Instances.sizes(effort.quick).to_vec();
    let mut all = Vec::new();
    for backend in backends {
        let mut curves = curves(backend.name);
        let mesh = terrain(MESH_TRIANGLES);
        let buffers = MeshBuffers::new(&backend.ctx, &mesh)?;
        let blas = buffers.blas(&backend.ctx, BuildFlags::FAST_TRACE, PrimitiveOrder::Given)?;
        backend.ctx.wait(backend.ctx.flush()?)?;
        for &count in &sizes {
            let costs = costs(backend, (&mesh, *blas), count, image, effort)?;
            curves.iter_mut().zip(costs).for_each(|(curve, cost)| curve.push(count, cost));
        }
        all.extend(curves);
    }
    let notes = vec![
        "an update encodes all instances and builds the whole structure anew or refits it, as Vulkan's command does: there is no \
         command that changes one instance"
            .to_owned(),
        format!("the rays are the same {} x {} for all numbers, and so is the size of the scene", image[0], image[1]),
    ];
    Ok(Group { key: GroupKey::Instances, sizes, curves: all, notes })
}

fn curves(backend: &str) -> Vec<Curve> {
    let built = Expected::Grows("all are encoded and built");
    let traced = Expected::Grows("depth of the tree, and caches");
    let curve = |name: &str, expected| Curve::new(format!("{name}, {backend}"), Unit::Milliseconds, expected);
    vec![
        curve("created and built", built),
        curve("one moved, refit", built),
        curve("all moved, rebuilt", built),
        curve("of it the CPU", Expected::Grows("all are encoded")),
        curve("the same rays traced", traced),
        curve("the same rays, GPU time", traced),
    ]
}

/// Returns the milliseconds of each curve.
fn costs(
    backend: &Backend,
    (mesh, blas): (&Mesh, AccelStructHandle),
    count: u64,
    image: [u32; 2],
    effort: Effort,
) -> Result<[f64; 6], BenchError> {
    let ctx = &backend.ctx;
    let mut instances: Vec<_> = (0..count).map(|number| instance(blas, number, count, 0.0)).collect();
    let built = effort.median(|| {
        let start = Instant::now();
        let tlas = create(ctx, &instances)?;
        let taken = elapsed_ms(start);
        drop(tlas);
        ctx.wait_idle()?;
        Ok(taken)
    })?;
    let tlas = create(ctx, &instances)?;
    let traced = TracedImage::new(ctx, mesh, image, tlas.index())?;
    let mut gpu_times = Vec::new();
    let trace = effort.median(|| {
        let times = backend.stopwatch.time(|cmd| backend.tracer.record(cmd, &traced, RayKind::Primary))?;
        gpu_times.push(times.gpu);
        Ok(times.total)
    })?;
    let mut turn = 0.0;
    let mut moved = |which: std::ops::Range<u64>, mode, until: Until| {
        effort.median(|| {
            turn += 0.1;
            which.clone().for_each(|i| instances[i as usize] = instance(blas, i, count, turn));
            let start = Instant::now();
            let mut cmd = ctx.acquire_command_buffer()?;
            cmd.update_tlas(*tlas, &instances, mode)?;
            let submitted = ctx.submit(cmd)?;
            let cpu = elapsed_ms(start);
            ctx.wait(submitted)?;
            Ok(if until == Until::Submitted { cpu } else { elapsed_ms(start) })
        })
    };
    let middle = count / 2;
    let one = moved(middle..middle + 1, BuildMode::Refit, Until::Done)?;
    let all = moved(0..count, BuildMode::Rebuild, Until::Done)?;
    let cpu = moved(0..count, BuildMode::Rebuild, Until::Submitted)?;
    Ok([built, one, all, cpu, trace, median_of(counted(&gpu_times), |ms| *ms)])
}

/// The end of a measured time.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Until {
    Submitted,
    Done,
}

fn create(ctx: &Context, instances: &[TlasInstance]) -> lvk::Result<Holder<AccelStructHandle>> {
    let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE;
    let tlas = ctx.create_tlas(&TlasDesc { instances, flags, ..TlasDesc::default() })?;
    ctx.wait(ctx.flush()?)?;
    Ok(tlas)
}

fn instance(blas: AccelStructHandle, number: u64, count: u64, turn: f32) -> TlasInstance {
    TlasInstance { transform: placement(number, count, turn), ..TlasInstance::new(blas) }
}

/// Returns the transform into a cell of a grid that fills the square of the terrain, turned by some radians.
fn placement(number: u64, count: u64, turn: f32) -> [f32; 12] {
    let side = (count as f64).sqrt().ceil().max(1.0) as u64;
    let cell = 2.0 / side as f32;
    let [x, z] = [number % side, number / side].map(|step| (step as f32 + 0.5) * cell - 1.0);
    let rotation = Quat::from_rotation_y(0.37 * number as f32 + turn);
    let place =
        Affine3A::from_scale_rotation_translation(Vec3::splat(0.4 * cell), rotation, Vec3::new(x, 0.0, z));
    transform_rows(&place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instances_of_any_number_fill_the_same_square() {
        for count in [1, 4, 100, 1_000] {
            for number in [0, count - 1] {
                let rows = placement(number, count, 0.0);
                let reach = 0.5657 * 2.0 / (count as f64).sqrt().ceil() as f32;
                assert!(rows[3].abs() + reach < 1.5 && rows[11].abs() + reach < 1.5, "{rows:?}");
            }
        }
    }
}
