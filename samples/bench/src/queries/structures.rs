//! What structures take, in bytes and milliseconds.

use std::time::{Duration, Instant};

use lvk::{AccelStructHandle, BuildFlags, BuildMode, Context, Holder, PrimitiveOrder};

use super::super::compaction::compacted;
use super::super::error::BenchError;
use super::super::measure::{Stopwatch, all_take_turns, median_of};
use super::super::mesh::{Mesh, MeshBuffers};
use super::super::setup::Setup;
use super::super::table::{Table, grouped, ms};
use super::creation;
use super::devices::Devices;
use super::instances::{COUNT, Instances};

const UPDATED: BuildFlags = BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE);
const SMALL_UPDATED: BuildFlags = BuildFlags::LOW_MEMORY.union(BuildFlags::ALLOW_UPDATE);
const SMALL_FAST_BUILD: BuildFlags = BuildFlags::LOW_MEMORY.union(BuildFlags::FAST_BUILD);

/// Structures whose bytes are told.
const KINDS: [(BuildFlags, &str); 6] = [
    (BuildFlags::FAST_TRACE, "fast trace"),
    (UPDATED, "fast trace, updates allowed"),
    (BuildFlags::LOW_MEMORY, "low memory"),
    (SMALL_UPDATED, "low memory, updates allowed"),
    (BuildFlags::FAST_BUILD, "fast build"),
    (SMALL_FAST_BUILD, "fast build, low memory"),
];

/// Measures the structures of software alone, beside those of the driver alone where it has any.
pub(super) fn table(setup: &Setup, devices: &Devices, mesh: &Mesh, runs: u32) -> Result<Table, BenchError> {
    let mut table = Table::new("### Structures".to_owned(), &["", "software", "driver"]);
    let contexts = std::iter::once(&devices.software).chain(devices.driver());
    let makers = contexts.map(|ctx| Maker::new(ctx, mesh)).collect::<Result<Vec<_>, _>>()?;
    for (flags, name) in KINDS {
        let cells = makers.iter().map(|maker| maker.bytes(&maker.blas(flags)?));
        table.row(format!("bytes a triangle, {name}"), cells.collect::<lvk::Result<Vec<_>>>()?);
    }
    if let Some(driver) = makers.get(1) {
        table.row("bytes a triangle, fast trace, compacted", [String::new(), driver.compacted_bytes()?]);
    }
    creation::add_rows(setup, &devices.software, mesh, runs, &mut table)?;
    builds(&makers, runs, &mut table)?;
    instances(&makers, runs, &mut table)?;
    notes(runs, &mut table);
    Ok(table)
}

/// Makes structures of the mesh in one context.
struct Maker {
    ctx: Context,
    buffers: MeshBuffers,
    stopwatch: Stopwatch,
}

impl Maker {
    fn new(ctx: &Context, mesh: &Mesh) -> Result<Self, BenchError> {
        let buffers = MeshBuffers::new(ctx, mesh)?;
        Ok(Self { ctx: ctx.clone(), buffers, stopwatch: Stopwatch::new(ctx)? })
    }

    /// A structure that is built.
    fn blas(&self, flags: BuildFlags) -> lvk::Result<Holder<AccelStructHandle>> {
        let blas = self.buffers.blas(&self.ctx, flags, PrimitiveOrder::Given)?;
        self.ctx.wait(self.ctx.flush()?)?;
        Ok(blas)
    }

    fn bytes(&self, blas: &Holder<AccelStructHandle>) -> lvk::Result<String> {
        let info = self.ctx.accel_struct_info(**blas)?;
        Ok(self.each(info.structure_bytes + info.table_bytes))
    }

    fn compacted_bytes(&self) -> Result<String, BenchError> {
        let blas = self.blas(BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION)?;
        Ok(self.each(compacted(&self.ctx, *blas)?[1]))
    }

    /// Bytes a triangle.
    fn each(&self, bytes: u64) -> String {
        format!("{:.2} B", bytes as f64 / f64::from(self.buffers.triangle_count))
    }
}

/// Adds rows of builds and refits on the GPU.
fn builds(makers: &[Maker], runs: u32, table: &mut Table) -> Result<(), BenchError> {
    use BuildMode::{Rebuild, Refit};
    for (flags, name) in
        [(BuildFlags::FAST_BUILD, "fast build"), (SMALL_FAST_BUILD, "fast build, low memory")]
    {
        let blas = all(makers, flags)?;
        table.row(format!("build by the GPU, {name}"), timed(makers, &blas, Rebuild, runs)?);
    }
    let small = all(&makers[..1], SMALL_UPDATED)?;
    table.row("refit of what the CPU built, low memory", timed(&makers[..1], &small, Refit, runs)?);
    let blas = all(makers, UPDATED)?;
    table.row("refit of what the CPU built, fast trace", timed(&makers[..1], &blas[..1], Refit, runs)?);
    table.row("rebuild by the GPU, fast trace, updates allowed", timed(makers, &blas, Rebuild, runs)?);
    table.row("refit of what the GPU built", timed(makers, &blas, Refit, runs)?);
    let cells = makers.iter().zip(&blas).map(|(maker, blas)| maker.bytes(blas));
    table.row("bytes a triangle after that", cells.collect::<lvk::Result<Vec<_>>>()?);
    Ok(())
}

fn all(makers: &[Maker], flags: BuildFlags) -> lvk::Result<Vec<Holder<AccelStructHandle>>> {
    makers.iter().map(|maker| maker.blas(flags)).collect()
}

/// Milliseconds of builds that take turns.
fn timed(
    makers: &[Maker],
    blas: &[Holder<AccelStructHandle>],
    mode: BuildMode,
    runs: u32,
) -> Result<Vec<String>, BenchError> {
    let build = |which: usize| makers[which].stopwatch.time(|cmd| cmd.build_blas(&[*blas[which]], mode));
    raise_clocks(&makers[0].ctx, || build(0).map(drop))?;
    let samples = all_take_turns(makers.len(), runs, build)?;
    Ok(samples.iter().map(|samples| ms(median_of(samples, |timed| timed.gpu))).collect())
}

/// Has a GPU work for so long that its clocks are up: it lowers them while the host has work between two of its own.
fn raise_clocks(ctx: &Context, mut work: impl FnMut() -> Result<(), BenchError>) -> Result<(), BenchError> {
    const ENOUGH: Duration = Duration::from_millis(500);
    let start = Instant::now();
    while !ctx.capabilities().is_cpu && start.elapsed() < ENOUGH {
        work()?;
    }
    Ok(())
}

/// Adds the row of a top-level structure.
fn instances(makers: &[Maker], runs: u32, table: &mut Table) -> Result<(), BenchError> {
    let scenes: Vec<_> = makers.iter().map(|maker| Instances::new(&maker.ctx)).collect::<lvk::Result<_>>()?;
    let rebuild = |which: usize| scenes[which].rebuild(&makers[which].stopwatch);
    raise_clocks(&makers[0].ctx, || rebuild(0).map(drop))?;
    let samples = all_take_turns(makers.len(), runs, rebuild)?;
    let cells = samples.iter().map(|samples| ms(median_of(samples, |time| *time)));
    table.row(format!("rebuild of {} instances by the GPU", grouped(COUNT.into())), cells);
    Ok(())
}

fn notes(runs: u32, table: &mut Table) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    table.note(format!(
        "builds by the CPU: {cores} cores, host time of a creation, which reads the mesh back; by the GPU: GPU time; \
         medians of up to {runs} runs, after half a second of such work on a GPU"
    ));
    table.note("a structure that the CPU built with updates allowed is rebuilt in its own room");
    table.note("aim: at most 56 B a triangle, with low memory 28 B; a build of living_room by two cores of the CPU at most 600 ms");
    table.note("aim on the H200: a rebuild at most 5 ms, a refit 1 ms, the 10,000 instances 0.5 ms");
}
