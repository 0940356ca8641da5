//! Builds of acceleration structures.

use gpu_allocator::MemoryLocation;
use lvk::ash::vk;

use super::commands::Commands;
use super::device::Device;
use super::memory::Buffer;
use super::ray_structures::{BuildInput, Structure, instances, record_builds, triangles};
use crate::instance_record::InstanceRecord;
use crate::peers::peer::{Failure, RowRun, Sample};
use crate::peers::workload::Workload;

/// BLAS of many meshes, built by one command.
pub(super) struct BlasBuilds {
    device: Device,
    commands: Commands,
    inputs: Vec<BuildInput>,
    built: Vec<Structure>,
    scratch: Buffer,
    _positions: Vec<Buffer>,
}

impl BlasBuilds {
    pub(super) fn new(device: Device, work: &Workload) -> Result<Self, Failure> {
        device.accel()?;
        let positions =
            (0..work.meshes).map(|number| positions(&device, work, number)).collect::<Result<Vec<_>, _>>()?;
        let input = |buffer: &Buffer| triangles(&device, buffer.address, None, 3 * work.mesh_triangles);
        let inputs = positions.iter().map(input).collect::<Result<Vec<_>, _>>()?;
        let bytes = inputs.iter().map(|input| input.scratch_bytes).sum();
        let scratch = scratch(&device, bytes)?;
        let commands = Commands::new(&device)?;
        Ok(Self { device, commands, inputs, built: Vec::new(), scratch, _positions: positions })
    }
}

impl RowRun for BlasBuilds {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let (device, commands) = (&self.device, &mut self.commands);
        self.built.drain(..).try_for_each(|structure| structure.destroy(device))?;
        let mut built = Vec::with_capacity(self.inputs.len());
        let submit = || {
            for input in &self.inputs {
                built.push(Structure::new(device, input)?);
            }
            let list = commands.begin(device)?;
            record_builds(device, list, &built, &self.inputs, self.scratch.address)?;
            commands.submit(device)?;
            Ok(commands)
        };
        let sample = Sample::take(submit, |commands| commands.wait(device));
        self.built = built;
        sample
    }
}

/// A TLAS whose instances the host writes anew for each build.
pub(super) struct TlasBuild {
    device: Device,
    commands: Commands,
    blas: Structure,
    tlas: Structure,
    input: BuildInput,
    records: Buffer,
    scratch: Buffer,
    count: u32,
    turn: u32,
    _positions: Buffer,
}

impl TlasBuild {
    pub(super) fn new(device: Device, work: &Workload) -> Result<Self, Failure> {
        device.accel()?;
        let positions = positions(&device, work, 0)?;
        let mesh = triangles(&device, positions.address, None, 3 * work.mesh_triangles)?;
        let count = work.instances;
        let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
        let records = Buffer::new(&device, 64 * u64::from(count), usage, MemoryLocation::CpuToGpu)?;
        let input = instances(&device, records.address, count)?;
        let scratch = scratch(&device, input.scratch_bytes.max(mesh.scratch_bytes))?;
        let mut commands = Commands::new(&device)?;
        let blas = Structure::new(&device, &mesh)?;
        let list = commands.begin(&device)?;
        record_builds(&device, list, std::slice::from_ref(&blas), &[mesh], scratch.address)?;
        commands.submit(&device)?;
        commands.wait(&device)?;
        let tlas = Structure::new(&device, &input)?;
        let turn = 0;
        Ok(Self { device, commands, blas, tlas, input, records, scratch, count, turn, _positions: positions })
    }
}

impl RowRun for TlasBuild {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.turn += 1;
        let (device, commands) = (&self.device, &mut self.commands);
        let submit = || {
            let records = self.records.mapped()?;
            let (records, _) = records.as_chunks_mut::<64>();
            for (number, bytes) in (0..self.count).zip(records) {
                let transform = Workload::instance_transform(number, self.turn);
                let record = InstanceRecord::new(transform, self.blas.address);
                bytes.copy_from_slice(bytemuck::bytes_of(&record));
            }
            let list = commands.begin(device)?;
            let (structures, inputs) = (std::slice::from_ref(&self.tlas), std::slice::from_ref(&self.input));
            record_builds(device, list, structures, inputs, self.scratch.address)?;
            commands.submit(device)?;
            Ok(commands)
        };
        Sample::take(submit, |commands| commands.wait(device))
    }
}

fn positions(device: &Device, work: &Workload, number: u32) -> Result<Buffer, Failure> {
    let positions = work.mesh_positions(number);
    let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
    Buffer::with_bytes(device, bytemuck::cast_slice(&positions), usage)
}

/// Creates scratch memory whose address is aligned.
fn scratch(device: &Device, bytes: u64) -> Result<Buffer, Failure> {
    let bytes = bytes + device.scratch_alignment();
    Buffer::new(device, bytes, vk::BufferUsageFlags::STORAGE_BUFFER, MemoryLocation::GpuOnly)
}
