//! Updates of a top-level structure of one instance, recorded.

use std::time::Instant;

use lvk::{BuildFlags, BuildMode, Context, PrimitiveOrder, TlasDesc, TlasInstance};

use super::row::{Limit, Row};
use super::{Amount, each_ns};
use crate::error::BenchError;
use crate::measure::{median_of, since, take_turns};
use crate::mesh::MeshBuffers;
use crate::synthetic::spheres;

/// Structures that are updated in turn.
const STRUCTURES: u32 = 16;
/// How often, in one command buffer.
const TURNS: u32 = 64;

pub(super) fn measure(silent: &Context, amount: Amount) -> Result<Vec<Row>, BenchError> {
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
        (0..STRUCTURES).map(|_| silent.create_tlas(&desc)).collect::<lvk::Result<_>>()?;
    silent.wait(silent.flush()?)?;
    let record = |turns: u32| {
        let mut cmd = silent.acquire_command_buffer()?;
        let start = Instant::now();
        for _ in 0..turns {
            for tlas in &structures {
                cmd.update_tlas(**tlas, &instances, BuildMode::Refit)?;
            }
        }
        let taken = since(start);
        silent.wait(silent.submit(cmd)?)?;
        Ok(taken)
    };
    let [once, often] = take_turns(amount.runs * 20, |which| record(if which == 0 { 1 } else { TURNS }))?;
    let row = |what: String, samples: &[f64], turns, limit| {
        let ours = each_ns(median_of(samples, |ms| *ms), STRUCTURES * turns);
        Row { what, ours, other: None, unit: "ns", limit }
    };
    Ok(vec![
        row("refit of a TLAS recorded, own share".to_owned(), &often, TURNS, Limit::Most(50.0)),
        row(format!("- the first of each of {STRUCTURES} in a command buffer"), &once, 1, Limit::Most(50.0)),
    ])
}
