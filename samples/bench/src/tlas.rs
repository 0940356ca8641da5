//! TLAS updates, compared with a memory copy plus the driver's build.

use std::rc::Rc;
use std::time::Instant;

use glam::{Affine3A, Quat, Vec3};
use lvk::ash::vk;
use lvk::{
    AccelStructHandle, BufferDesc, BufferHandle, BufferUsage, BuildFlags, BuildMode, CommandBuffer, Context,
    DeviceInstances, Holder, MemoryKind, PrimitiveOrder, TlasDesc, TlasInstance, transform_rows,
};

use crate::args::TlasArgs;
use crate::error::BenchError;
use crate::hand_written::{RawAccelStruct, RawCommands, RawDevice, instance_geometry};
use crate::instance_record::InstanceRecord;
use crate::measure::{Stopwatch, SubmissionTimes, elapsed_ms, interleave, median};
use crate::mesh::MeshBuffers;
use crate::setup::{DefaultBy, Setup};
use crate::synthetic::spheres;
use crate::table::{Table, format_grouped, format_ms, format_ratio};

/// Triangles of the mesh that all instances reference.
const MESH_TRIANGLES: u32 = 1000;

/// Compares updates by `lvk` with a memory copy plus the driver's build, for several instance counts.
pub(super) fn measure(setup: &Setup, args: &TlasArgs) -> Result<Table, BenchError> {
    let ctx = setup.open()?;
    let runs = setup.runs(&ctx, DefaultBy { quick: 1, cpu: 5, gpu: 30 });
    let default: &[u32] =
        setup.default_for(&ctx, DefaultBy { quick: &[2000], cpu: &[100_000], gpu: &[100_000, 1_000_000] });
    let counts = if args.instances.is_empty() { default } else { &args.instances };
    let columns = [
        "",
        "record or copy (CPU)",
        "build (GPU)",
        "sum",
        "until the GPU is done",
        "ratio of sums",
        "ratio until done",
    ];
    let mut table = Table::new(setup.title(&ctx, "tlas: updates"), &columns);
    for count in counts {
        let bench = TlasBench::new(&ctx, *count)?;
        bench.add_rebuild_rows(runs, &mut table)?;
        bench.add_refit_rows(runs, &mut table)?;
    }
    table.add_note(format!("medians of {runs} interleaved runs; all instances reference one mesh"));
    table.add_note("the plain copy writes 64 bytes per instance into mapped memory in one call; the driver builds from there");
    table.add_note(
        "limit: the update from the host takes at most 1.15 times the plain copy and the driver's build",
    );
    Ok(table)
}

/// The inputs of all variants for one instance count.
struct TlasBench {
    ctx: Context,
    stopwatch: Stopwatch,
    commands: RawCommands,
    device: Rc<RawDevice>,
    blas: Holder<AccelStructHandle>,
    instances: Vec<TlasInstance>,
    /// The instance records with BLAS addresses.
    records: Vec<InstanceRecord>,
    /// Host-visible buffer for `records`.
    mapped: Holder<BufferHandle>,
    /// Device-local records with indices into the BLAS list instead of addresses.
    on_device: Holder<BufferHandle>,
    _buffers: MeshBuffers,
}

impl TlasBench {
    fn new(ctx: &Context, count: u32) -> Result<Self, BenchError> {
        let buffers = MeshBuffers::new(ctx, &spheres(MESH_TRIANGLES))?;
        let blas = buffers.blas(ctx, BuildFlags::FAST_TRACE, PrimitiveOrder::Given)?;
        let address = ctx.accel_struct_addresses(*blas)?[0];
        let transforms: Vec<_> = (0..count).map(|number| instance_transform(number, count)).collect();
        let instance =
            |transform: &[f32; 12]| TlasInstance { transform: *transform, ..TlasInstance::new(*blas) };
        let records = |reference| transforms.iter().map(move |rows| InstanceRecord::new(*rows, reference));
        let placed: Vec<InstanceRecord> = records(0).collect();
        let on_device = ctx.create_buffer(&BufferDesc {
            data: Some(bytemuck::cast_slice(&placed)),
            debug_name: "instances",
            ..BufferDesc::default()
        })?;
        let mapped = ctx.create_buffer(&BufferDesc {
            size_bytes: (count as usize * size_of::<InstanceRecord>()) as u64,
            usage: BufferUsage::ACCEL_INPUT,
            memory: MemoryKind::HostVisible,
            debug_name: "mapped instances",
            ..BufferDesc::default()
        })?;
        ctx.wait(ctx.flush()?)?;
        let device = RawDevice::new(ctx);
        Ok(Self {
            stopwatch: Stopwatch::new(ctx)?,
            commands: RawCommands::new(&device)?,
            device,
            instances: transforms.iter().map(instance).collect(),
            records: records(address).collect(),
            mapped,
            on_device,
            blas,
            ctx: ctx.clone(),
            _buffers: buffers,
        })
    }

    fn count(&self) -> u32 {
        self.instances.len() as u32
    }

    fn tlas(&self, flags: BuildFlags) -> lvk::Result<Holder<AccelStructHandle>> {
        let tlas = self.ctx.create_tlas(&TlasDesc {
            instances: &self.instances,
            flags,
            debug_name: "many instances",
            ..TlasDesc::default()
        })?;
        self.ctx.wait(self.ctx.flush()?)?;
        Ok(tlas)
    }

    fn raw(&self, flags: vk::BuildAccelerationStructureFlagsKHR) -> Result<RawAccelStruct, BenchError> {
        let geometry = instance_geometry(self.ctx.buffer_address(*self.mapped)?);
        RawAccelStruct::new(&self.device, geometry, self.count(), flags)
    }

    /// Copies the records into mapped memory and runs the driver's build.
    fn copy_and_build(&self, build: impl FnOnce(vk::CommandBuffer)) -> Result<SubmissionTimes, BenchError> {
        let start = Instant::now();
        self.ctx.upload_buffer(*self.mapped, 0, bytemuck::cast_slice(&self.records))?;
        let copy = elapsed_ms(start);
        let timed = self.commands.time(build)?;
        Ok(SubmissionTimes { record: copy, total: copy + timed.total, ..timed })
    }

    fn update_on_device(
        &self,
        cmd: &mut CommandBuffer,
        tlas: AccelStructHandle,
        mode: BuildMode,
    ) -> lvk::Result<()> {
        let blas = [*self.blas];
        let instances =
            DeviceInstances { buffer: *self.on_device, offset: 0, count: self.count(), blas: &blas };
        cmd.update_tlas_from_buffer(tlas, &instances, mode)
    }

    fn add_rebuild_rows(&self, runs: u32, table: &mut Table) -> Result<(), BenchError> {
        let tlas = self.tlas(BuildFlags::FAST_TRACE)?;
        let raw = self.raw(vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE)?;
        let mode = BuildMode::Rebuild;
        let samples: [Vec<_>; 3] = interleave(runs, |which| match which {
            0 => self.copy_and_build(|commands| raw.build(commands)),
            1 => self.stopwatch.time(|cmd| cmd.update_tlas(*tlas, &self.instances, mode)),
            _ => self.stopwatch.time(|cmd| self.update_on_device(cmd, *tlas, mode)),
        })?;
        self.add_rows("rebuild", samples, table);
        Ok(())
    }

    fn add_refit_rows(&self, runs: u32, table: &mut Table) -> Result<(), BenchError> {
        use vk::BuildAccelerationStructureFlagsKHR as Raw;
        let tlas = self.tlas(BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE)?;
        let raw = self.raw(Raw::PREFER_FAST_TRACE | Raw::ALLOW_UPDATE)?;
        self.copy_and_build(|commands| raw.build(commands))?;
        let mode = BuildMode::Refit;
        let samples: [Vec<_>; 3] = interleave(runs, |which| match which {
            0 => self.copy_and_build(|commands| raw.refit(commands)),
            1 => self.stopwatch.time(|cmd| cmd.update_tlas(*tlas, &self.instances, mode)),
            _ => self.stopwatch.time(|cmd| self.update_on_device(cmd, *tlas, mode)),
        })?;
        self.add_rows("refit", samples, table);
        Ok(())
    }

    fn add_rows(&self, mode: &str, samples: [Vec<SubmissionTimes>; 3], table: &mut Table) {
        let medians = samples.map(|samples| median(&samples));
        let names = ["plain copy + driver", "lvk, from the host", "lvk, from a buffer"];
        let sum = |timed: &SubmissionTimes| timed.record + timed.gpu;
        for (name, timed) in names.iter().zip(&medians) {
            let name = format!("{mode} of {}: {name}", format_grouped(u64::from(self.count())));
            let ratios = [sum(timed) / sum(&medians[0]), timed.total / medians[0].total];
            let figures = [timed.record, timed.gpu, sum(timed), timed.total];
            table.add_row(name, figures.map(format_ms).into_iter().chain(ratios.map(format_ratio)));
        }
    }
}

/// Returns the transform of a rotated and scaled instance in a cube of instances.
pub(super) fn instance_transform(number: u32, count: u32) -> [f32; 12] {
    let side = f64::from(count).cbrt().ceil() as u32;
    let position = [number % side, number / side % side, number / side / side].map(|cell| 20.0 * cell as f32);
    let turn = Quat::from_rotation_y(0.37 * number as f32);
    transform_rows(&Affine3A::from_scale_rotation_translation(Vec3::splat(0.5), turn, position.into()))
}
