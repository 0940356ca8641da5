//! BLAS builds, refits and compaction of one large mesh, compared with hand-written Vulkan.

use std::rc::Rc;

use lvk::ash::vk;
use lvk::{AccelStructHandle, BuildFlags, BuildMode, Compaction, Context, PrimitiveOrder};

use crate::args::MeshArgs;
use crate::error::BenchError;
use crate::hand_written::{RawAccelStruct, RawCommands, RawDevice, triangle_geometry};
use crate::measure::{Stopwatch, interleave, median_of};
use crate::mesh::{Mesh, MeshBuffers};
use crate::setup::{DefaultBy, Setup};
use crate::table::{Table, format_bytes, format_ms, format_ratio};

/// Number of submissions within which a compaction must finish.
const MAX_SUBMISSIONS: u32 = 100;

/// Compares builds, refits and sizes with hand-written Vulkan.
pub(super) fn measure(setup: &Setup, args: &MeshArgs) -> Result<Table, BenchError> {
    let ctx = setup.open()?;
    let default_triangles = setup.default_for(&ctx, DefaultBy { quick: 2000, cpu: 100_000, gpu: 1_000_000 });
    let runs = setup.runs(&ctx, DefaultBy { quick: 1, cpu: 5, gpu: 40 });
    let mesh = Mesh::new(args, 1, default_triangles)?;
    let title = setup.title(&ctx, &format!("compaction: {}", mesh.describe()));
    let mut table = Table::new(title, &["", "lvk", "hand-written", "ratio"]);
    let bench = CompactionBench::new(&ctx, &mesh, runs)?;
    ctx.wait(ctx.flush()?)?;
    let fast_trace = bench.build(BuildFlags::FAST_TRACE, "build, fast trace", &mut table)?;
    bench.build(BuildFlags::FAST_BUILD, "build, fast build", &mut table)?;
    bench.refit(&mut table)?;
    bench.compact(&mut table)?;
    let rate = f64::from(bench.buffers.triangle_count) / fast_trace / 1e3;
    table.add_note(format!("fast-trace builds: {rate:.0} M triangles per second"));
    table.add_note(format!("GPU times, medians of {runs} interleaved runs; triangles in the given order"));
    table.add_note("limits on the H200: builds within 5 % of hand-written builds, a refit at least 3 times as fast as a rebuild, the same sizes as hand-written");
    Ok(table)
}

struct CompactionBench {
    ctx: Context,
    device: Rc<RawDevice>,
    commands: RawCommands,
    stopwatch: Stopwatch,
    buffers: MeshBuffers,
    runs: u32,
}

impl CompactionBench {
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

    fn raw(&self, flags: BuildFlags) -> Result<RawAccelStruct, BenchError> {
        let geometry = triangle_geometry(&self.device, &self.buffers)?;
        RawAccelStruct::new(&self.device, geometry, self.buffers.triangle_count, raw_flags(flags))
    }

    /// Adds the row of builds with these flags. Returns the milliseconds of one build by `lvk`.
    fn build(&self, flags: BuildFlags, name: &str, table: &mut Table) -> Result<f64, BenchError> {
        let blas = self.buffers.blas(&self.ctx, flags, PrimitiveOrder::Given)?;
        let raw = self.raw(flags)?;
        let samples: [Vec<_>; 2] = interleave(self.runs, |which| match which {
            0 => self.stopwatch.time(|cmd| cmd.build_blas(&[*blas], BuildMode::Rebuild)),
            _ => self.commands.time(|commands| raw.build(commands)),
        })?;
        let [ours, theirs] = samples.map(|samples| median_of(&samples, |timed| timed.gpu));
        table.add_row(name, [format_ms(ours), format_ms(theirs), format_ratio(ours / theirs)]);
        Ok(ours)
    }

    /// Adds the rows of a rebuild and a refit of a BLAS with `ALLOW_UPDATE`.
    fn refit(&self, table: &mut Table) -> Result<(), BenchError> {
        let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE;
        let blas = self.buffers.blas(&self.ctx, flags, PrimitiveOrder::Given)?;
        let raw = self.raw(flags)?;
        self.commands.time(|commands| raw.build(commands))?;
        let samples: [Vec<_>; 4] = interleave(self.runs, |which| match which {
            0 => self.stopwatch.time(|cmd| cmd.build_blas(&[*blas], BuildMode::Rebuild)),
            1 => self.commands.time(|commands| raw.build(commands)),
            2 => self.stopwatch.time(|cmd| cmd.build_blas(&[*blas], BuildMode::Refit)),
            _ => self.commands.time(|commands| raw.refit(commands)),
        })?;
        let [build, raw_build, refit, raw_refit] =
            samples.map(|samples| median_of(&samples, |timed| timed.gpu));
        table.add_row(
            "rebuild, updates allowed",
            [format_ms(build), format_ms(raw_build), format_ratio(build / raw_build)],
        );
        table.add_row("refit", [format_ms(refit), format_ms(raw_refit), format_ratio(refit / raw_refit)]);
        table.add_row("rebuild / refit", [format_ratio(build / refit), format_ratio(raw_build / raw_refit)]);
        Ok(())
    }

    /// Adds the rows of the sizes before and after compaction.
    fn compact(&self, table: &mut Table) -> Result<(), BenchError> {
        let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION;
        let raw = self.raw(flags)?;
        self.commands.time(|commands| raw.build(commands))?;
        let raw_sizes = [raw.bytes, raw.compacted_bytes(&self.commands)?];
        let blas = self.buffers.blas(&self.ctx, flags, PrimitiveOrder::Given)?;
        self.ctx.wait(self.ctx.flush()?)?;
        self.ctx.wait_idle()?;
        let held = self.ctx.accel_memory().structure_bytes;
        let sizes = compact_and_wait(&self.ctx, *blas)?;
        let freed = held.saturating_sub(self.ctx.accel_memory().structure_bytes);
        self.size_row("before compaction", sizes[0], raw_sizes[0], table);
        self.size_row("after compaction", sizes[1], raw_sizes[1], table);
        let saved =
            |[before, after]: [u64; 2]| format!("{:.2} %", 100.0 * (1.0 - after as f64 / before as f64));
        table.add_row("saved", [saved(sizes), saved(raw_sizes)]);
        table.add_row("freed to the allocator", [format_bytes(freed)]);
        Ok(())
    }

    fn size_row(&self, name: &str, ours: u64, theirs: u64, table: &mut Table) {
        let each = |bytes: u64| bytes as f64 / f64::from(self.buffers.triangle_count);
        table.add_row(
            name,
            [format_bytes(ours), format_bytes(theirs), format_ratio(ours as f64 / theirs as f64)],
        );
        table.add_row(
            format!("{name}, per triangle"),
            [format!("{:.2} B", each(ours)), format!("{:.2} B", each(theirs))],
        );
    }
}

/// Compacts a BLAS, waits, and returns its sizes in bytes before and after.
pub(super) fn compact_and_wait(ctx: &Context, blas: AccelStructHandle) -> Result<[u64; 2], BenchError> {
    ctx.compact(&[blas])?;
    for _ in 0..MAX_SUBMISSIONS {
        ctx.wait(ctx.flush()?)?;
        if let Compaction::Done { before_bytes, after_bytes } = ctx.accel_struct_info(blas)?.compaction {
            // The library frees the old BLAS once the GPU has finished the copy.
            ctx.wait_idle()?;
            return Ok([before_bytes, after_bytes]);
        }
    }
    let device = ctx.capabilities().device_name.clone();
    Err(BenchError::NoCompaction { device, tries: MAX_SUBMISSIONS })
}

/// Converts the flags to Vulkan's.
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
