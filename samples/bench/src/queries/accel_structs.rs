//! Sizes and build times of acceleration structures.

use std::time::{Duration, Instant};

use lvk::{AccelStructHandle, BuildFlags, BuildMode, Context, Holder, PrimitiveOrder};

use super::contexts::Contexts;
use super::cpu_builds;
use super::instances::{COUNT, Instances};
use crate::compaction::compact_and_wait;
use crate::error::BenchError;
use crate::measure::{Stopwatch, interleave_all, median_of};
use crate::mesh::{Mesh, MeshBuffers};
use crate::setup::Setup;
use crate::table::{Table, format_grouped, format_ms};

const UPDATED: BuildFlags = BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE);
const SMALL_UPDATED: BuildFlags = BuildFlags::LOW_MEMORY.union(BuildFlags::ALLOW_UPDATE);
const SMALL_FAST_BUILD: BuildFlags = BuildFlags::LOW_MEMORY.union(BuildFlags::FAST_BUILD);

/// BLAS kinds whose sizes are printed.
const KINDS: [(BuildFlags, &str); 6] = [
    (BuildFlags::FAST_TRACE, "fast trace"),
    (UPDATED, "fast trace, updates allowed"),
    (BuildFlags::LOW_MEMORY, "low memory"),
    (SMALL_UPDATED, "low memory, updates allowed"),
    (BuildFlags::FAST_BUILD, "fast build"),
    (SMALL_FAST_BUILD, "fast build, low memory"),
];

/// Measures the acceleration structures of the software implementation and of the driver, if the driver has any.
pub(super) fn table(setup: &Setup, contexts: &Contexts, mesh: &Mesh, runs: u32) -> Result<Table, BenchError> {
    let mut table = Table::new("### Acceleration structures".to_owned(), &["", "software", "driver"]);
    let all_contexts = std::iter::once(&contexts.software).chain(contexts.driver());
    let makers = all_contexts.map(|ctx| BlasMaker::new(ctx, mesh)).collect::<Result<Vec<_>, _>>()?;
    for (flags, name) in KINDS {
        let cells = makers.iter().map(|maker| maker.blas_size(&maker.blas(flags)?));
        table.add_row(format!("bytes per triangle, {name}"), cells.collect::<lvk::Result<Vec<_>>>()?);
    }
    if let Some(driver) = makers.get(1) {
        table
            .add_row("bytes per triangle, fast trace, compacted", [String::new(), driver.compacted_bytes()?]);
    }
    cpu_builds::add_cpu_builds(setup, &contexts.software, mesh, runs, &mut table)?;
    add_build_rows(&makers, runs, &mut table)?;
    add_tlas_row(&makers, runs, &mut table)?;
    add_notes(runs, &mut table);
    Ok(table)
}

/// Builds BLAS of the mesh in one context.
struct BlasMaker {
    ctx: Context,
    buffers: MeshBuffers,
    stopwatch: Stopwatch,
}

impl BlasMaker {
    fn new(ctx: &Context, mesh: &Mesh) -> Result<Self, BenchError> {
        let buffers = MeshBuffers::new(ctx, mesh)?;
        Ok(Self { ctx: ctx.clone(), buffers, stopwatch: Stopwatch::new(ctx)? })
    }

    /// Creates a BLAS and waits for its build.
    fn blas(&self, flags: BuildFlags) -> lvk::Result<Holder<AccelStructHandle>> {
        let blas = self.buffers.blas(&self.ctx, flags, PrimitiveOrder::Given)?;
        self.ctx.wait(self.ctx.flush()?)?;
        Ok(blas)
    }

    fn blas_size(&self, blas: &Holder<AccelStructHandle>) -> lvk::Result<String> {
        let info = self.ctx.accel_struct_info(**blas)?;
        Ok(self.bytes_per_triangle(info.structure_bytes + info.table_bytes))
    }

    fn compacted_bytes(&self) -> Result<String, BenchError> {
        let blas = self.blas(BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION)?;
        Ok(self.bytes_per_triangle(compact_and_wait(&self.ctx, *blas)?[1]))
    }

    /// Formats bytes per triangle.
    fn bytes_per_triangle(&self, bytes: u64) -> String {
        format!("{:.2} B", bytes as f64 / f64::from(self.buffers.triangle_count))
    }
}

/// Adds the rows of builds and refits by the GPU.
fn add_build_rows(makers: &[BlasMaker], runs: u32, table: &mut Table) -> Result<(), BenchError> {
    use BuildMode::{Rebuild, Refit};
    for (flags, name) in
        [(BuildFlags::FAST_BUILD, "fast build"), (SMALL_FAST_BUILD, "fast build, low memory")]
    {
        let blas = build_all(makers, flags)?;
        table.add_row(format!("GPU build, {name}"), time_builds(makers, &blas, Rebuild, runs)?);
    }
    let small = build_all(&makers[..1], SMALL_UPDATED)?;
    table.add_row("GPU refit of a CPU build, low memory", time_builds(&makers[..1], &small, Refit, runs)?);
    let blas = build_all(makers, UPDATED)?;
    table
        .add_row("GPU refit of a CPU build, fast trace", time_builds(&makers[..1], &blas[..1], Refit, runs)?);
    table.add_row("GPU rebuild, fast trace, updates allowed", time_builds(makers, &blas, Rebuild, runs)?);
    table.add_row("GPU refit of a GPU build", time_builds(makers, &blas, Refit, runs)?);
    let cells = makers.iter().zip(&blas).map(|(maker, blas)| maker.blas_size(blas));
    table.add_row("bytes per triangle after a GPU build", cells.collect::<lvk::Result<Vec<_>>>()?);
    Ok(())
}

fn build_all(makers: &[BlasMaker], flags: BuildFlags) -> lvk::Result<Vec<Holder<AccelStructHandle>>> {
    makers.iter().map(|maker| maker.blas(flags)).collect()
}

/// Returns the GPU milliseconds of interleaved builds.
fn time_builds(
    makers: &[BlasMaker],
    blas: &[Holder<AccelStructHandle>],
    mode: BuildMode,
    runs: u32,
) -> Result<Vec<String>, BenchError> {
    let build = |which: usize| makers[which].stopwatch.time(|cmd| cmd.build_blas(&[*blas[which]], mode));
    warm_up_gpu(&makers[0].ctx, || build(0).map(drop))?;
    let samples = interleave_all(makers.len(), runs, build)?;
    Ok(samples.iter().map(|samples| format_ms(median_of(samples, |timed| timed.gpu))).collect())
}

/// Runs `work` on a GPU for half a second to raise its clocks, which the GPU lowers while the CPU builds.
fn warm_up_gpu(ctx: &Context, mut work: impl FnMut() -> Result<(), BenchError>) -> Result<(), BenchError> {
    const DURATION: Duration = Duration::from_millis(500);
    let start = Instant::now();
    while !ctx.capabilities().is_cpu && start.elapsed() < DURATION {
        work()?;
    }
    Ok(())
}

/// Adds the row of the TLAS.
fn add_tlas_row(makers: &[BlasMaker], runs: u32, table: &mut Table) -> Result<(), BenchError> {
    let scenes: Vec<_> = makers.iter().map(|maker| Instances::new(&maker.ctx)).collect::<lvk::Result<_>>()?;
    let rebuild = |which: usize| scenes[which].rebuild(&makers[which].stopwatch);
    warm_up_gpu(&makers[0].ctx, || rebuild(0).map(drop))?;
    let samples = interleave_all(makers.len(), runs, rebuild)?;
    let cells = samples.iter().map(|samples| format_ms(median_of(samples, |time| *time)));
    table.add_row(format!("GPU rebuild of {} instances", format_grouped(COUNT.into())), cells);
    Ok(())
}

fn add_notes(runs: u32, table: &mut Table) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    table.add_note(format!(
        "CPU builds: {cores} cores, CPU time of a creation with the read-back of the mesh; GPU builds: GPU time; medians of \
         up to {runs} runs, on a GPU after half a second of the same work"
    ));
    table.add_note("a GPU rebuild of a CPU build with updates allowed reuses its memory");
    table.add_note("aim: at most 56 B per triangle, 28 B with low memory; a CPU build of living_room on two cores at most 450 ms");
    table.add_note("aim on the H200: a rebuild at most 5 ms, a refit 1 ms, the 10,000 instances 0.5 ms");
}
