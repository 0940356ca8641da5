//! Cost of a BLAS with many triangles.

use std::time::Instant;

use lvk::{AccelStructHandle, BuildFlags, Context, Holder, PrimitiveOrder, TlasDesc, TlasInstance};

use super::backends::Backend;
use super::curve::{Curve, Expected, Unit};
use super::effort::Effort;
use super::group::{Group, GroupKey};
use super::terrain::terrain;
use crate::error::BenchError;
use crate::measure::{elapsed_ms, median_of};
use crate::mesh::{Mesh, MeshBuffers};
use crate::tracer::{RayKind, TracedImage};

pub(super) fn measure(backends: &[Backend], image: [u32; 2], effort: Effort) -> Result<Group, BenchError> {
    let sizes = GroupKey::Triangles.sizes(effort.quick).to_vec();
    let mut curves: Vec<Vec<Curve>> = backends.iter().map(|backend| self::curves(backend.name)).collect();
    for &count in &sizes {
        let mesh = terrain(count);
        for (backend, curves) in backends.iter().zip(&mut curves) {
            let costs = costs(backend, &mesh, image, effort)?;
            curves.iter_mut().zip(costs).for_each(|(curve, cost)| curve.push(count, cost));
        }
    }
    let notes = vec![format!("the rays are the same {} x {} for all numbers", image[0], image[1])];
    Ok(Group { key: GroupKey::Triangles, sizes, curves: curves.concat(), notes })
}

/// Traces of each structure after the first.
const LATER_TRACES: usize = 15;

fn curves(backend: &str) -> Vec<Curve> {
    let curve = |name: &str, unit, expected| Curve::new(format!("{name}, {backend}"), unit, expected);
    vec![
        curve("BLAS created and built", Unit::Milliseconds, Expected::Grows("all are sorted and built")),
        curve("first trace", Unit::Milliseconds, Expected::Grows("depth of the tree, and caches")),
        curve("traced again", Unit::Milliseconds, Expected::Grows("depth of the tree, and caches")),
        curve("memory of the BLAS", Unit::BytesPerTriangle, Expected::Constant),
    ]
}

/// Returns the cost of each curve.
fn costs(backend: &Backend, mesh: &Mesh, image: [u32; 2], effort: Effort) -> Result<[f64; 4], BenchError> {
    let ctx = &backend.ctx;
    let buffers = MeshBuffers::new(ctx, mesh)?;
    ctx.wait(ctx.flush()?)?;
    let mut bytes = f64::NAN;
    let (mut first_traces, mut later_traces) = (Vec::new(), Vec::new());
    let built = effort.median(|| {
        let start = Instant::now();
        let blas = buffers.blas(ctx, BuildFlags::FAST_TRACE, PrimitiveOrder::Auto)?;
        ctx.wait(ctx.flush()?)?;
        let built = elapsed_ms(start);
        let info = ctx.accel_struct_info(*blas)?;
        bytes = (info.structure_bytes + info.table_bytes) as f64 / mesh.triangles.len() as f64;
        let tlas = tlas(ctx, *blas, info.parts)?;
        let traced = TracedImage::new(ctx, mesh, image, tlas.index())?;
        let trace = || backend.stopwatch.time(|cmd| backend.tracer.record(cmd, &traced, RayKind::Primary));
        first_traces.push(trace()?.total);
        // A GPU lowers its clocks while the CPU builds, and raises them again at work.
        for _ in 0..LATER_TRACES {
            later_traces.push(trace()?.total);
        }
        drop((tlas, blas));
        ctx.wait_idle()?;
        Ok(built)
    })?;
    let [first, later] = [&first_traces, &later_traces].map(|traces| median_of(traces, |ms| *ms));
    Ok([built, first, later, bytes])
}

fn tlas(ctx: &Context, blas: AccelStructHandle, parts: u32) -> lvk::Result<Holder<AccelStructHandle>> {
    let instances = [TlasInstance::new(blas)];
    let tlas = ctx.create_tlas(&TlasDesc {
        instances: &instances,
        parts_per_instance: parts,
        ..TlasDesc::default()
    })?;
    ctx.wait(ctx.flush()?)?;
    Ok(tlas)
}
