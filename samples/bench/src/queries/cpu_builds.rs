//! Measures BVH builds by the CPU, and loads from the BVH cache.

use std::time::Instant;

use lvk::{BuildFlags, Context, PrimitiveOrder, RayQueryRequest, RayTracingPipelineRequest};

use crate::error::BenchError;
use crate::measure::{elapsed_ms, interleave, median_of};
use crate::mesh::{Mesh, MeshBuffers};
use crate::setup::Setup;
use crate::table::{Table, format_ms};

/// Maximum number of runs, because builds are slow.
const MAX_RUNS: u32 = 10;

/// Adds the rows of BVH builds by the CPU.
pub(super) fn add_cpu_builds(
    setup: &Setup,
    software: &Context,
    mesh: &Mesh,
    runs: u32,
    table: &mut Table,
) -> Result<(), BenchError> {
    let folder = tempfile::tempdir()?;
    let caching =
        setup.open_tracing(RayTracingPipelineRequest::Off, RayQueryRequest::Software, Some(folder.path()))?;
    let buffers = [MeshBuffers::new(software, mesh)?, MeshBuffers::new(&caching, mesh)?];
    build(&caching, &buffers[1], BuildFlags::FAST_TRACE)?;
    let samples: [Vec<_>; 3] = interleave(runs.min(MAX_RUNS), |which| match which {
        0 => build(software, &buffers[0], BuildFlags::FAST_TRACE),
        1 => build(software, &buffers[0], BuildFlags::LOW_MEMORY),
        _ => build(&caching, &buffers[1], BuildFlags::FAST_TRACE),
    })?;
    let [fast_trace, low_memory, cached] = samples.map(|samples| median_of(&samples, |time| *time));
    table.add_row("CPU build, fast trace", [format_ms(fast_trace)]);
    table.add_row("CPU build, low memory", [format_ms(low_memory)]);
    table.add_row("load from the BVH cache, fast trace", [format_ms(cached)]);
    Ok(())
}

/// Returns the CPU milliseconds of a BLAS creation, with the read-back of its inputs.
fn build(ctx: &Context, buffers: &MeshBuffers, flags: BuildFlags) -> Result<f64, BenchError> {
    ctx.wait(ctx.flush()?)?;
    let start = Instant::now();
    let blas = buffers.blas(ctx, flags, PrimitiveOrder::Given)?;
    let time = elapsed_ms(start);
    ctx.wait(ctx.flush()?)?;
    drop(blas);
    ctx.wait_idle()?;
    Ok(time)
}
