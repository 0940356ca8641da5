//! Recording of refits of a TLAS with one instance.

use std::time::Instant;

use lvk::{BuildFlags, BuildMode, Context, PrimitiveOrder, TlasDesc, TlasInstance};

use super::row::{Limit, OverheadRow};
use super::{Workload, each_ns};
use crate::error::BenchError;
use crate::measure::{elapsed_ms, interleave, median_of};
use crate::mesh::MeshBuffers;
use crate::synthetic::spheres;

/// Number of TLAS.
const TLAS_COUNT: u32 = 16;
/// Refits of each TLAS in one command buffer.
const TURNS: u32 = 64;

pub(super) fn measure(silent: &Context, workload: Workload) -> Result<Vec<OverheadRow>, BenchError> {
    if !(silent.capabilities().ray_query || silent.capabilities().ray_tracing_pipeline) {
        return Ok(Vec::new());
    }
    let blas = MeshBuffers::new(silent, &spheres(500))?.blas(
        silent,
        BuildFlags::FAST_TRACE,
        PrimitiveOrder::Given,
    )?;
    let instances = [TlasInstance::new(*blas)];
    let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE;
    let desc = TlasDesc { instances: &instances, flags, ..TlasDesc::default() };
    let structures: Vec<_> =
        (0..TLAS_COUNT).map(|_| silent.create_tlas(&desc)).collect::<lvk::Result<_>>()?;
    silent.wait(silent.flush()?)?;
    let record = |turns: u32| {
        let mut cmd = silent.acquire_command_buffer()?;
        let start = Instant::now();
        for _ in 0..turns {
            for tlas in &structures {
                cmd.update_tlas(**tlas, &instances, BuildMode::Refit)?;
            }
        }
        let taken = elapsed_ms(start);
        silent.wait(silent.submit(cmd)?)?;
        Ok(taken)
    };
    let [once, often] = interleave(workload.runs * 20, |which| record(if which == 0 { 1 } else { TURNS }))?;
    let row = |name: String, samples: &[f64], turns, limit| {
        let ours = each_ns(median_of(samples, |ms| *ms), TLAS_COUNT * turns);
        OverheadRow::new(name, ours, "ns", limit)
    };
    Ok(vec![
        row("TLAS refit recorded, library share".to_owned(), &often, TURNS, Limit::AtMost(50.0)),
        row(
            format!("- first refit of each of {TLAS_COUNT} TLAS in a command buffer"),
            &once,
            1,
            Limit::AtMost(50.0),
        ),
    ])
}
