//! Cost of a BLAS with many triangles.

use std::time::Instant;

use lvk::{
    AccelStructHandle, BuildFlags, CommandBuffer, Context, Holder, PrimitiveOrder, TlasDesc, TlasInstance,
};

use super::backends::Backend;
use super::curve::{Curve, Expected, Unit};
use super::effort::Effort;
use super::group::{Group, GroupKey};
use super::terrain::terrain;
use crate::error::BenchError;
use crate::measure::{SubmissionTimes, elapsed_ms, median_of};
use crate::mesh::{Mesh, MeshBuffers};
use crate::tracer::{RayKind, TracedImage};

pub(super) fn measure(backends: &[Backend], image: [u32; 2], effort: Effort) -> Result<Group, BenchError> {
    let sizes = GroupKey::Triangles.sizes(effort.quick).to_vec();
    let mut curves: Vec<Vec<Curve>> = backends.iter().map(|backend| self::curves(backend.name)).collect();
    let small = terrain(WARM_UP_TRIANGLES);
    let warm_ups = backends.iter().map(|backend| WarmUp::new(backend, &small, image, effort));
    let warm_ups = warm_ups.collect::<Result<Vec<_>, _>>()?;
    for &count in &sizes {
        let mesh = terrain(count);
        for (warm_up, curves) in warm_ups.iter().zip(&mut curves) {
            let costs = costs(warm_up, &mesh, image, effort)?;
            curves.iter_mut().zip(costs).for_each(|(curve, cost)| curve.push(count, cost));
        }
    }
    let notes = vec![
        format!("the rays are the same {} x {} for all numbers", image[0], image[1]),
        "before the first trace a GPU traces another structure for as long as the build took, a second at most: its clocks may fall while the CPU builds"
            .to_owned(),
    ];
    Ok(Group { key: GroupKey::Triangles, sizes, curves: curves.concat(), notes })
}

/// Traces of each structure after the first.
const LATER_TRACES: usize = 15;
/// Triangles of the structure that is traced before others are.
const WARM_UP_TRIANGLES: u64 = 1_000;
/// Milliseconds in which the clocks of a GPU rise, at most. An H200 that was idle for 2 s takes 0.2 to 0.4 s from 345 to 1,980 MHz.
const LONGEST_WARM_UP: f64 = 1_000.0;

/// A small structure. A GPU that traces it is at work, as in the frames of a program, when a measured trace begins.
struct WarmUp<'a> {
    backend: &'a Backend,
    traced: TracedImage,
    /// False where there is nothing to warm up.
    is_needed: bool,
    _structures: [Holder<AccelStructHandle>; 2],
    _buffers: MeshBuffers,
}

impl<'a> WarmUp<'a> {
    fn new(backend: &'a Backend, mesh: &Mesh, image: [u32; 2], effort: Effort) -> Result<Self, BenchError> {
        let ctx = &backend.ctx;
        let buffers = MeshBuffers::new(ctx, mesh)?;
        let blas = buffers.blas(ctx, BuildFlags::FAST_TRACE, PrimitiveOrder::Auto)?;
        let tlas = tlas(ctx, *blas, ctx.accel_struct_info(*blas)?.parts)?;
        let traced = TracedImage::new(ctx, mesh, image, tlas.index())?;
        let is_needed = !effort.quick && !ctx.capabilities().is_cpu;
        Ok(Self { backend, traced, is_needed, _structures: [tlas, blas], _buffers: buffers })
    }

    /// Traces for these milliseconds, in which the GPU was idle, or for [`LONGEST_WARM_UP`].
    fn run(&self, idle_ms: f64) -> Result<(), BenchError> {
        let start = Instant::now();
        while self.is_needed && elapsed_ms(start) < idle_ms.min(LONGEST_WARM_UP) {
            trace(self.backend, &self.traced)?;
        }
        Ok(())
    }
}

fn trace(backend: &Backend, traced: &TracedImage) -> Result<SubmissionTimes, BenchError> {
    let trace = |cmd: &mut CommandBuffer| backend.tracer.record(cmd, traced, RayKind::Primary);
    backend.stopwatch.time(trace)
}

fn curves(backend: &str) -> Vec<Curve> {
    let curve = |name: &str, unit, expected| Curve::new(format!("{name}, {backend}"), unit, expected);
    vec![
        curve("BLAS created and built", Unit::Milliseconds, Expected::Grows("all are sorted and built")),
        curve("first trace", Unit::Milliseconds, Expected::Grows("depth of the tree, and caches")),
        curve("traced again", Unit::Milliseconds, Expected::Grows("depth of the tree, and caches")),
        curve("traced again, GPU time", Unit::Milliseconds, Expected::Grows("depth of the tree, and caches")),
        curve("memory of the BLAS", Unit::BytesPerTriangle, Expected::Constant),
    ]
}

/// Returns the cost of each curve.
fn costs(warm_up: &WarmUp<'_>, mesh: &Mesh, image: [u32; 2], effort: Effort) -> Result<[f64; 5], BenchError> {
    let backend = warm_up.backend;
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
        warm_up.run(built)?;
        first_traces.push(trace(backend, &traced)?.total);
        for _ in 0..LATER_TRACES {
            later_traces.push(trace(backend, &traced)?);
        }
        drop((tlas, blas));
        ctx.wait_idle()?;
        Ok(built)
    })?;
    let first = median_of(&first_traces, |ms| *ms);
    let again = median_of(&later_traces, |times| times.total);
    let gpu = median_of(&later_traces, |times| times.gpu);
    Ok([built, first, again, gpu, bytes])
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
