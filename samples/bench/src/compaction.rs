//! Builds, refits and compaction of one large mesh, beside the same by hand-written Vulkan.

use std::rc::Rc;

use lvk::ash::vk;
use lvk::{AccelStructHandle, BuildFlags, BuildMode, Compaction, Context, PrimitiveOrder};

use super::args::MeshArgs;
use super::error::BenchError;
use super::hand_written::{RawCommands, RawDevice, RawStructure, triangle_geometry};
use super::measure::{Stopwatch, median_of, take_turns};
use super::mesh::{Mesh, MeshBuffers};
use super::setup::{Choice, Setup};
use super::table::{Table, bytes, ms, times};

/// Submissions within which a compaction must have happened.
const MOST_SUBMISSIONS: u32 = 100;

/// Compares builds, refits and sizes with those of hand-written code.
pub(super) fn measure(setup: &Setup, args: &MeshArgs) -> Result<Table, BenchError> {
    let ctx = setup.open()?;
    let default_triangles = setup.choose(&ctx, Choice { quick: 2000, cpu: 100_000, gpu: 1_000_000 });
    let runs = setup.runs(&ctx, Choice { quick: 1, cpu: 5, gpu: 40 });
    let mesh = Mesh::new(args, 1, default_triangles)?;
    let headline = setup.headline(&ctx, &format!("compaction: {}", mesh.describe()));
    let mut table = Table::new(headline, &["", "lvk", "hand-written", "ratio"]);
    let bench = Bench::new(&ctx, &mesh, runs)?;
    ctx.wait(ctx.flush()?)?;
    let fast_trace = bench.build(BuildFlags::FAST_TRACE, "build, fast trace", &mut table)?;
    bench.build(BuildFlags::FAST_BUILD, "build, fast build", &mut table)?;
    bench.refit(&mut table)?;
    bench.compact(&mut table)?;
    let rate = f64::from(bench.buffers.triangle_count) / fast_trace / 1e3;
    table.note(format!("fast-trace builds: {rate:.0} M triangles a second"));
    table.note(format!("GPU times, medians of {runs} runs, taken in turns; triangles in the order given"));
    table.note("limits on the H200: builds within 5 % of hand-written ones, a refit at least 3 times faster than a rebuild, bytes as hand-written");
    Ok(table)
}

struct Bench {
    ctx: Context,
    device: Rc<RawDevice>,
    commands: RawCommands,
    stopwatch: Stopwatch,
    buffers: MeshBuffers,
    runs: u32,
}

impl Bench {
    fn new(ctx: &Context, mesh: &Mesh, runs: u32) -> Result<Self, BenchError> {
        let device = RawDevice::new(ctx);
        Ok(Self {
            ctx: ctx.clone(),
            commands: RawCommands::new(&device)?,
            device,
            stopwatch: Stopwatch::new(ctx)?,
            buffers: MeshBuffers::new(ctx, mesh)?,
            runs,
        })
    }

    fn raw(&self, flags: BuildFlags) -> Result<RawStructure, BenchError> {
        let geometry = triangle_geometry(&self.device, &self.buffers)?;
        RawStructure::new(&self.device, geometry, self.buffers.triangle_count, raw_flags(flags))
    }

    /// A row of builds with these flags; answers the milliseconds of one by `lvk`.
    fn build(&self, flags: BuildFlags, name: &str, table: &mut Table) -> Result<f64, BenchError> {
        let blas = self.buffers.blas(&self.ctx, flags, PrimitiveOrder::Given)?;
        let raw = self.raw(flags)?;
        let samples: [Vec<_>; 2] = take_turns(self.runs, |which| match which {
            0 => self.stopwatch.time(|cmd| cmd.build_blas(&[*blas], BuildMode::Rebuild)),
            _ => self.commands.time(|commands| raw.build(commands)),
        })?;
        let [ours, theirs] = samples.map(|samples| median_of(&samples, |timed| timed.gpu));
        table.row(name, [ms(ours), ms(theirs), times(ours / theirs)]);
        Ok(ours)
    }

    /// Rows of a rebuild and a refit of a structure that allows both.
    fn refit(&self, table: &mut Table) -> Result<(), BenchError> {
        let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE;
        let blas = self.buffers.blas(&self.ctx, flags, PrimitiveOrder::Given)?;
        let raw = self.raw(flags)?;
        self.commands.time(|commands| raw.build(commands))?;
        let samples: [Vec<_>; 4] = take_turns(self.runs, |which| match which {
            0 => self.stopwatch.time(|cmd| cmd.build_blas(&[*blas], BuildMode::Rebuild)),
            1 => self.commands.time(|commands| raw.build(commands)),
            2 => self.stopwatch.time(|cmd| cmd.build_blas(&[*blas], BuildMode::Refit)),
            _ => self.commands.time(|commands| raw.refit(commands)),
        })?;
        let [build, raw_build, refit, raw_refit] =
            samples.map(|samples| median_of(&samples, |timed| timed.gpu));
        table.row("rebuild, updates allowed", [ms(build), ms(raw_build), times(build / raw_build)]);
        table.row("refit", [ms(refit), ms(raw_refit), times(refit / raw_refit)]);
        table.row("rebuild / refit", [times(build / refit), times(raw_build / raw_refit)]);
        Ok(())
    }

    /// Rows of sizes before and after compaction.
    fn compact(&self, table: &mut Table) -> Result<(), BenchError> {
        let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION;
        let raw = self.raw(flags)?;
        self.commands.time(|commands| raw.build(commands))?;
        let raw_sizes = [raw.bytes, raw.compacted_bytes(&self.commands)?];
        let blas = self.buffers.blas(&self.ctx, flags, PrimitiveOrder::Given)?;
        self.ctx.wait(self.ctx.flush()?)?;
        self.ctx.wait_idle()?;
        let held = self.ctx.accel_memory().structure_bytes;
        let sizes = compacted(&self.ctx, *blas)?;
        let freed = held.saturating_sub(self.ctx.accel_memory().structure_bytes);
        self.size_row("before compaction", sizes[0], raw_sizes[0], table);
        self.size_row("after compaction", sizes[1], raw_sizes[1], table);
        let saved =
            |[before, after]: [u64; 2]| format!("{:.2} %", 100.0 * (1.0 - after as f64 / before as f64));
        table.row("saved", [saved(sizes), saved(raw_sizes)]);
        table.row("given back to the allocator", [bytes(freed)]);
        Ok(())
    }

    fn size_row(&self, name: &str, ours: u64, theirs: u64, table: &mut Table) {
        let each = |bytes: u64| bytes as f64 / f64::from(self.buffers.triangle_count);
        table.row(name, [bytes(ours), bytes(theirs), times(ours as f64 / theirs as f64)]);
        table.row(
            format!("{name}, a triangle"),
            [format!("{:.2} B", each(ours)), format!("{:.2} B", each(theirs))],
        );
    }
}

/// Compacts a structure and answers its bytes before and after.
pub(super) fn compacted(ctx: &Context, blas: AccelStructHandle) -> Result<[u64; 2], BenchError> {
    ctx.compact(&[blas])?;
    for _ in 0..MOST_SUBMISSIONS {
        ctx.wait(ctx.flush()?)?;
        if let Compaction::Done { before_bytes, after_bytes } = ctx.accel_struct_info(blas)?.compaction {
            // What was replaced goes once the GPU is done with the copy.
            ctx.wait_idle()?;
            return Ok([before_bytes, after_bytes]);
        }
    }
    let device = ctx.capabilities().device_name.clone();
    Err(BenchError::NoCompaction { device, tries: MOST_SUBMISSIONS })
}

/// The same flags for the hand-written side.
fn raw_flags(flags: BuildFlags) -> vk::BuildAccelerationStructureFlagsKHR {
    use vk::BuildAccelerationStructureFlagsKHR as Raw;
    let pairs = [
        (BuildFlags::FAST_TRACE, Raw::PREFER_FAST_TRACE),
        (BuildFlags::FAST_BUILD, Raw::PREFER_FAST_BUILD),
        (BuildFlags::ALLOW_UPDATE, Raw::ALLOW_UPDATE),
        (BuildFlags::ALLOW_COMPACTION, Raw::ALLOW_COMPACTION),
    ];
    pairs.iter().filter(|(flag, _)| flags.contains(*flag)).fold(Raw::empty(), |all, (_, raw)| all | *raw)
}
