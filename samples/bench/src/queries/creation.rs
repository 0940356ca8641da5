//! What the CPU needs to build the library's trees, and to find them in a folder.

use std::time::Instant;

use lvk::{BuildFlags, Context, FeatureRequest, PrimitiveOrder, RayQueryRequest};

use super::super::error::BenchError;
use super::super::measure::{median_of, since, take_turns};
use super::super::mesh::{Mesh, MeshBuffers};
use super::super::setup::Setup;
use super::super::table::{Table, ms};

/// Creations take long, so there are at most so many of each.
const MOST_RUNS: u32 = 10;

/// Adds rows of creations by the CPU.
pub(super) fn add_rows(
    setup: &Setup,
    software: &Context,
    mesh: &Mesh,
    runs: u32,
    table: &mut Table,
) -> Result<(), BenchError> {
    let folder = tempfile::tempdir()?;
    let keeping = setup.open_tracing(FeatureRequest::Off, RayQueryRequest::Software, Some(folder.path()))?;
    let buffers = [MeshBuffers::new(software, mesh)?, MeshBuffers::new(&keeping, mesh)?];
    create(&keeping, &buffers[1], BuildFlags::FAST_TRACE)?;
    let samples: [Vec<_>; 3] = take_turns(runs.min(MOST_RUNS), |which| match which {
        0 => create(software, &buffers[0], BuildFlags::FAST_TRACE),
        1 => create(software, &buffers[0], BuildFlags::LOW_MEMORY),
        _ => create(&keeping, &buffers[1], BuildFlags::FAST_TRACE),
    })?;
    let [fast_trace, low_memory, kept] = samples.map(|samples| median_of(&samples, |time| *time));
    table.row("build by the CPU, fast trace", [ms(fast_trace)]);
    table.row("build by the CPU, low memory", [ms(low_memory)]);
    table.row("the same from the folder of trees, fast trace", [ms(kept)]);
    Ok(())
}

/// Milliseconds on the host until a structure is built, its inputs read back.
fn create(ctx: &Context, buffers: &MeshBuffers, flags: BuildFlags) -> Result<f64, BenchError> {
    ctx.wait(ctx.flush()?)?;
    let start = Instant::now();
    let blas = buffers.blas(ctx, flags, PrimitiveOrder::Given)?;
    let time = since(start);
    ctx.wait(ctx.flush()?)?;
    drop(blas);
    ctx.wait_idle()?;
    Ok(time)
}
