//! An opacity micromap: its memory, its build, and its attachment to the triangles of a BLAS.

use std::sync::Arc;

use ash::ext::opacity_micromap::DeviceFn;
use ash::vk;

use super::geometry::host_or_device_address;
use super::micromap_desc::MicromapPlan;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::memory::allocator::MemoryKind;
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};

/// Alignment that Vulkan requires of maps and records, in bytes.
const INPUT_ALIGNMENT: usize = 256;
/// Bytes of a record (`VkMicromapTriangleEXT`).
const RECORD_BYTES: usize = size_of::<vk::MicromapTriangleEXT>();

/// Maps, records and indices as they lie in one buffer.
#[derive(Debug, PartialEq, Eq)]
struct MicromapInput {
    bytes: Vec<u8>,
    /// Offset of the records in bytes.
    records: u64,
    /// Offset of the indices in bytes.
    indices: u64,
}

impl MicromapInput {
    fn new(plan: &MicromapPlan) -> Self {
        let mut bytes = plan.data.clone();
        bytes.resize(bytes.len().next_multiple_of(INPUT_ALIGNMENT), 0);
        let records = bytes.len() as u64;
        for record in &plan.records {
            bytes.extend(record.data_offset.to_le_bytes());
            bytes.extend(record.subdivision_level.to_le_bytes());
            bytes.extend(record.format.to_le_bytes());
        }
        let indices = bytes.len() as u64;
        bytes.extend(plan.indices.iter().flat_map(|index| index.to_le_bytes()));
        Self { bytes, records, indices }
    }
}

/// A build of a micromap in Vulkan's form, except for its memory.
#[derive(Debug, Clone, Copy, Default)]
struct MicromapBuild<'a> {
    counts: &'a [vk::MicromapUsageEXT],
    target: vk::MicromapEXT,
    /// Addresses of maps, records and scratch memory.
    data: u64,
    records: u64,
    scratch: u64,
}

impl MicromapBuild<'_> {
    fn info(&self) -> vk::MicromapBuildInfoEXT<'_> {
        vk::MicromapBuildInfoEXT::default()
            .ty(vk::MicromapTypeEXT::OPACITY_MICROMAP)
            .flags(vk::BuildMicromapFlagsEXT::PREFER_FAST_TRACE)
            .mode(vk::BuildMicromapModeEXT::BUILD)
            .dst_micromap(self.target)
            .usage_counts(self.counts)
            .data(host_or_device_address(self.data))
            .scratch_data(vk::DeviceOrHostAddressKHR { device_address: self.scratch })
            .triangle_array(host_or_device_address(self.records))
            .triangle_array_stride(RECORD_BYTES as u64)
    }

    /// Queries the sizes of the micromap and its scratch memory (`vkGetMicromapBuildSizesEXT`).
    fn query_sizes(
        &self,
        functions: &DeviceFn,
        device: vk::Device,
    ) -> vk::MicromapBuildSizesInfoEXT<'static> {
        let mut sizes = vk::MicromapBuildSizesInfoEXT::default();
        let kind = vk::AccelerationStructureBuildTypeKHR::DEVICE;
        // SAFETY: the device has the extension; addresses are not read by a size query.
        unsafe { (functions.get_micromap_build_sizes_ext)(device, kind, &self.info(), &mut sizes) };
        sizes
    }

    /// Records the build (`vkCmdBuildMicromapsEXT`).
    ///
    /// # Safety
    /// The command buffer is in the recording state. Micromap, inputs and scratch memory are alive, aligned and large
    /// enough, and barriers separate them from other commands.
    unsafe fn record(&self, functions: &DeviceFn, commands: vk::CommandBuffer) {
        // SAFETY: the caller ensures the conditions.
        unsafe { (functions.cmd_build_micromaps_ext)(commands, 1, &self.info()) };
    }
}

/// Returns the bytes of a micromap and of the scratch memory of its build.
pub(crate) fn query_sizes(gpu: &Gpu, plan: &MicromapPlan) -> Result<[u64; 2]> {
    let sized = MicromapBuild { counts: &plan.map_counts, ..MicromapBuild::default() };
    let sizes = sized.query_sizes(gpu.micromap_functions()?, gpu.device.handle());
    Ok([sizes.micromap_size, sizes.build_scratch_size])
}

/// A micromap with its memory, destroyed on drop. A BLAS whose triangles have it holds it.
pub(crate) struct Micromap {
    raw: vk::MicromapEXT,
    pub(crate) name: String,
    /// Memory of the micromap, whose identity stands for it in barriers.
    pub(crate) storage: Buffer,
    inputs: Buffer,
    /// Offsets of records and indices in `inputs`.
    records: u64,
    indices: u64,
    pub(crate) triangle_count: u32,
    pub(crate) scratch_bytes: u64,
    map_counts: Vec<vk::MicromapUsageEXT>,
    triangle_counts: Vec<vk::MicromapUsageEXT>,
    gpu: Arc<Gpu>,
}

impl Micromap {
    /// Creates a micromap (`vkCreateMicromapEXT`) that is not built yet.
    pub(crate) fn new(gpu: &Arc<Gpu>, name: &str, plan: MicromapPlan) -> Result<Self> {
        let functions = gpu.micromap_functions()?;
        let [micromap_bytes, scratch_bytes] = query_sizes(gpu, &plan)?;
        let input = MicromapInput::new(&plan);
        let desc = BufferDesc {
            size_bytes: input.bytes.len() as u64,
            usage: BufferUsage::ACCEL_INPUT,
            memory: MemoryKind::HostVisible,
            data: None,
            debug_name: name,
        };
        let inputs = Buffer::new(gpu, &desc, InternalUsage::MICROMAP_INPUT)?;
        inputs.write(0, &input.bytes);
        let desc = BufferDesc {
            size_bytes: micromap_bytes.max(1),
            usage: BufferUsage::STORAGE,
            memory: MemoryKind::Device,
            ..desc
        };
        let storage = Buffer::new(gpu, &desc, InternalUsage::MICROMAP_STORAGE)?;
        let info = vk::MicromapCreateInfoEXT::default()
            .buffer(storage.raw)
            .size(micromap_bytes)
            .ty(vk::MicromapTypeEXT::OPACITY_MICROMAP);
        let mut raw = vk::MicromapEXT::null();
        // SAFETY: the buffer has the usage and the size; offset 0 is aligned.
        let made = unsafe {
            (functions.create_micromap_ext)(gpu.device.handle(), &info, std::ptr::null(), &mut raw)
        };
        made.result().map_err(Error::vulkan("vkCreateMicromapEXT", name))?;
        gpu.name(raw, name);
        Ok(Self {
            raw,
            name: name.to_owned(),
            storage,
            inputs,
            records: input.records,
            indices: input.indices,
            triangle_count: plan.indices.len() as u32,
            scratch_bytes,
            map_counts: plan.map_counts,
            triangle_counts: plan.triangle_counts,
            gpu: Arc::clone(gpu),
        })
    }

    /// Creates the scratch memory of the build.
    pub(crate) fn new_scratch(&self) -> Result<Buffer> {
        let desc = BufferDesc {
            size_bytes: self.scratch_bytes.max(1),
            usage: BufferUsage::STORAGE,
            debug_name: &self.name,
            ..BufferDesc::default()
        };
        let alignment = self.gpu.caps.limits.scratch_alignment.into();
        Buffer::new(&self.gpu, &desc, InternalUsage { alignment, ..InternalUsage::NONE })
    }

    /// Records the build (`vkCmdBuildMicromapsEXT`).
    ///
    /// # Safety
    /// The command buffer is in the recording state, and barriers separate micromap and scratch memory from other
    /// commands. The scratch memory is that of [`new_scratch`](Self::new_scratch).
    pub(crate) unsafe fn record_build(&self, commands: vk::CommandBuffer, scratch: &Buffer) -> Result<()> {
        let build = MicromapBuild {
            counts: &self.map_counts,
            target: self.raw,
            data: self.inputs.address,
            records: self.inputs.address + self.records,
            scratch: scratch.address,
        };
        // SAFETY: the caller ensures the conditions; the inputs were written when the micromap was created.
        unsafe { build.record(self.gpu.micromap_functions()?, commands) };
        Ok(())
    }
}

impl Drop for Micromap {
    fn drop(&mut self) {
        if let Ok(functions) = self.gpu.micromap_functions() {
            let device = self.gpu.device.handle();
            // SAFETY: the owners have waited until the GPU is done with the micromap.
            unsafe { (functions.destroy_micromap_ext)(device, self.raw, std::ptr::null()) };
        }
    }
}

/// A micromap as a geometry refers to it. The address of `raw` stays the same in an [`Arc`].
pub(crate) struct OpacityAttachment {
    raw: vk::AccelerationStructureTrianglesOpacityMicromapEXT<'static>,
    pub(crate) micromap: Arc<Micromap>,
}

impl OpacityAttachment {
    pub(crate) fn new(micromap: &Arc<Micromap>) -> Arc<Self> {
        let indices = micromap.inputs.address + micromap.indices;
        let raw = attachment(micromap.raw, indices, &micromap.triangle_counts);
        Arc::new(Self { raw, micromap: Arc::clone(micromap) })
    }

    /// Appends the micromap to triangles. The caller keeps the attachment as long as the triangles are used.
    pub(crate) fn attach(
        self: &Arc<Self>,
        triangles: &mut vk::AccelerationStructureGeometryTrianglesDataKHR<'static>,
    ) {
        triangles.p_next = std::ptr::from_ref(&self.raw).cast();
    }
}

/// Returns the micromap in Vulkan's form, with 32-bit indices at an address. The caller keeps the counts.
fn attachment(
    micromap: vk::MicromapEXT,
    indices: u64,
    counts: &[vk::MicromapUsageEXT],
) -> vk::AccelerationStructureTrianglesOpacityMicromapEXT<'static> {
    let mut raw = vk::AccelerationStructureTrianglesOpacityMicromapEXT::default()
        .index_type(vk::IndexType::UINT32)
        .index_buffer(host_or_device_address(indices))
        .index_stride(size_of::<i32>() as u64)
        .micromap(micromap);
    raw.usage_counts_count = counts.len() as u32;
    raw.p_usage_counts = counts.as_ptr();
    raw
}

#[cfg(test)]
mod tests {
    use ash::vk::Handle;

    use super::super::micromap_desc::{
        OpacityFormat, OpacityMap, OpacityMicromapDesc, OpacityState, TriangleOpacity,
    };
    use super::*;
    use crate::gpu::caps::limits::MicromapLimits;
    use crate::test_support::micromap_functions::{RecordedBuild, recording_functions, take_recorded};

    fn plan() -> MicromapPlan {
        use OpacityState::{Opaque, Transparent, UnknownOpaque};
        let maps = [
            OpacityMap {
                format: OpacityFormat::FourStates,
                level: 1,
                states: &[Opaque, UnknownOpaque, Transparent, Opaque],
            },
            OpacityMap { format: OpacityFormat::TwoStates, level: 0, states: &[Opaque] },
        ];
        let triangles = [
            TriangleOpacity::Map(0),
            TriangleOpacity::Uniform(Transparent),
            TriangleOpacity::Map(1),
            TriangleOpacity::Map(0),
        ];
        let desc = OpacityMicromapDesc { maps: &maps, triangles: &triangles, debug_name: "leaf" };
        let limits = MicromapLimits { max_two_state_level: 1, max_four_state_level: 1 };
        MicromapPlan::new(&desc, &limits).unwrap_or_default()
    }

    fn numbers(usages: &[vk::MicromapUsageEXT]) -> Vec<[u32; 3]> {
        usages.iter().map(|usage| [usage.count, usage.subdivision_level, usage.format]).collect()
    }

    #[test]
    fn maps_records_and_indices_lie_in_one_buffer() {
        let input = MicromapInput::new(&plan());
        assert_eq!((input.records, input.indices), (256, 272));
        assert_eq!(input.bytes[..2], [0b0100_1101, 1]);
        assert_eq!(input.bytes[256..272], [0, 0, 0, 0, 1, 0, 2, 0, 1, 0, 0, 0, 0, 0, 1, 0]);
        let indices: Vec<i32> =
            input.bytes[272..].chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
        assert_eq!(indices, [0, -1, 1, 0]);
    }

    #[test]
    fn vulkan_gets_counts_addresses_and_the_stride_for_sizes_and_builds() {
        let (plan, functions) = (plan(), recording_functions());
        let build = MicromapBuild {
            counts: &plan.map_counts,
            target: vk::MicromapEXT::from_raw(7),
            data: 0x1000,
            records: 0x1100,
            scratch: 0x2000,
        };
        let sizes = build.query_sizes(&functions, vk::Device::null());
        assert_eq!((sizes.micromap_size, sizes.build_scratch_size), (4096, 512));
        // SAFETY: the functions only record their arguments.
        unsafe { build.record(&functions, vk::CommandBuffer::null()) };
        let expected = RecordedBuild {
            target: 7,
            counts: vec![[1, 0, 1], [1, 1, 2]],
            data: 0x1000,
            records: 0x1100,
            stride: 8,
            scratch: 0x2000,
        };
        assert_eq!(take_recorded(), [expected.clone(), expected]);
    }

    #[test]
    fn a_geometry_points_to_the_micromap_with_the_counts_of_its_triangles() {
        let plan = plan();
        let raw = attachment(vk::MicromapEXT::from_raw(9), 0x3000, &plan.triangle_counts);
        let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR {
            p_next: std::ptr::from_ref(&raw).cast(),
            ..Default::default()
        };
        // SAFETY: the chain holds one structure of this type.
        let found =
            unsafe { *triangles.p_next.cast::<vk::AccelerationStructureTrianglesOpacityMicromapEXT<'_>>() };
        assert_eq!(found.s_type, vk::StructureType::ACCELERATION_STRUCTURE_TRIANGLES_OPACITY_MICROMAP_EXT);
        assert_eq!((found.micromap.as_raw(), found.index_type), (9, vk::IndexType::UINT32));
        // SAFETY: both are the fields that the function wrote.
        let (indices, counts) = unsafe {
            let counts = std::slice::from_raw_parts(found.p_usage_counts, found.usage_counts_count as usize);
            (found.index_buffer.device_address, numbers(counts))
        };
        assert_eq!((indices, found.index_stride, found.base_triangle), (0x3000, 4, 0));
        assert_eq!(counts, [[1, 0, 1], [2, 1, 2]]);
    }
}
