//! Serialisation of BLAS to bytes, so that a scene can be kept on disk.

use std::ops::Range;
use std::sync::Arc;

use ash::vk;

use super::Context;
use super::holder::Holder;
use super::plan_blas::{BlasInputs, convert_geometries, new_blas_object};
use super::readback::READBACK;
use crate::accel::AccelStruct;
use crate::accel::blas::{BlasPart, BlasStructures};
use crate::accel::blas_file::{
    BlasFile, BlasFileGeometry, BlasFileGeometryKind, BlasFileIndices, BlasFilePart, decode_blas_file,
    encode_blas_file, encoded_bytes,
};
use crate::accel::desc::BlasDesc;
use crate::accel::flags::BuildFlags;
use crate::accel::geometry::{BlasGeometry, GeometryFlags};
use crate::accel::primitive_map::{covers_mesh, decode_table};
use crate::accel::raw_accel_struct::RawAccelStruct;
use crate::accel::split::PartPlan;
use crate::accel::storage::AccelStorage;
use crate::command::transfer::BufferCopy;
use crate::device_state::DeferredObject;
use crate::error::{Error, Result};
use crate::format::IndexFormat;
use crate::handle::AccelStructHandle;
use crate::resource::buffer::{BufferDesc, InternalUsage, check_host_memory, zeroed_bytes};
use crate::resource::query_pool::QueryPoolDesc;
use crate::resource::{Buffer, QueryPool};

/// Alignment of the addresses of serialised BLAS.
const ALIGNMENT: u64 = 256;
/// Maximum bytes of parts that share one buffer, because devices limit buffer sizes. A larger part has a buffer alone.
const MAX_GROUP_BYTES: u64 = 256 << 20;

/// Result of [`Context::load_or_create_blas`].
pub struct LoadedBlas {
    /// The BLAS.
    pub blas: Holder<AccelStructHandle>,
    /// Reason why the bytes were not used and the BLAS was built instead; `None` if the bytes were used.
    pub rejected: Option<Error>,
}

impl Context {
    /// Serialises a BLAS to bytes for a file. [`load_blas`](Self::load_blas) reads it on the same device with the same
    /// driver (`vkCmdCopyAccelerationStructureToMemoryKHR`). Waits for the GPU.
    ///
    /// With software ray queries only, the bytes work on every device with the same version of the library.
    ///
    /// Keep the file where only the program writes to it: its checksum detects damage, not manipulation.
    ///
    /// The bytes are of one state of the BLAS, also if another thread builds it meanwhile: the GPU copies it first, so its memory is taken twice
    /// for a while, beside [`ContextDesc::accel_budget_bytes`](crate::ContextDesc::accel_budget_bytes).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a TLAS and for a BLAS with opacity micromaps; [`StaleHandle`](Error::StaleHandle).
    pub fn serialize_blas(&self, handle: AccelStructHandle) -> Result<Vec<u8>> {
        let object = self.device_state().store.accel_structs.get(handle)?;
        let blas = object.blas()?;
        if blas.parts.iter().any(|part| part.input.micromaps().next().is_some()) {
            let message = "a BLAS with opacity micromaps cannot be serialised; build it at each start";
            return Err(Error::usage(&object.name, message));
        }
        let geometries = blas.geometries.iter().map(file_geometry).collect();
        if self.device_state().gpu.accel.is_none() {
            let bytes = self.read_software_bytes(blas);
            let driver = bytes.map_err(|error| error.with_owner(READBACK, &object.name))?;
            let parts = vec![BlasFilePart { driver, map: None }];
            return encode(&object, geometries, parts);
        }
        let drivers = self.serialize_parts(&object)?;
        let mut parts = Vec::with_capacity(drivers.len());
        for (driver, shape) in drivers.into_iter().zip(&blas.parts) {
            let map =
                self.read_primitive_map(shape).map_err(|error| error.with_owner(READBACK, &object.name))?;
            parts.push(BlasFilePart { driver, map });
        }
        encode(&object, geometries, parts)
    }

    /// Creates a BLAS from the bytes of [`serialize_blas`](Self::serialize_blas)
    /// (`vkCmdCopyMemoryToAccelerationStructureKHR`). `desc` is the description of the original. Flags, kinds and
    /// counts of its geometries must be the same. So must vertex formats, numbers of vertices, kinds of indices, and
    /// the presence of a matrix. A refit reads the buffers of `desc`.
    ///
    /// # Errors
    /// [`Serialized`](Error::Serialized) for bytes that are damaged, of another mesh, or of another device or driver.
    ///
    /// # Safety
    /// `bytes` come from [`serialize_blas`](Self::serialize_blas), complete or accidentally damaged, but not forged.
    /// Damage is detected, and so are sizes and counts that contradict the mesh; such bytes are rejected. But only the
    /// driver can read the driver's data, and the driver trusts it: forged contents can make the GPU access any
    /// address. Do not load a file that other programs can write to.
    ///
    /// With software ray queries only, forged contents are rejected or harmless: every offset, count and reference is
    /// checked before a shader follows it.
    pub unsafe fn load_blas(&self, desc: &BlasDesc<'_>, bytes: &[u8]) -> Result<Holder<AccelStructHandle>> {
        self.device_state().gpu.check_acceleration_structures()?;
        let blob = decode_blas_file(bytes).map_err(|error| rejected_error(desc, error.to_string()))?;
        check_same_mesh(desc, &blob).map_err(|reason| rejected_error(desc, reason))?;
        if self.device_state().gpu.accel.is_none() {
            return self.load_software_blas(desc, &blob);
        }
        let mut bytes = Vec::with_capacity(blob.parts.len());
        for part in &blob.parts {
            bytes.push(self.check_driver(part).map_err(|reason| rejected_error(desc, reason))?);
        }
        let inputs = self.loaded_inputs(desc, &blob, &bytes)?;
        // SAFETY: the caller vouches for the driver's data; everything else is checked.
        unsafe { self.deserialize(desc, &blob, inputs, &bytes) }
    }

    /// Creates a BLAS like [`load_blas`](Self::load_blas), or like [`create_blas`](Self::create_blas) if there are no
    /// bytes or they cannot be used.
    ///
    /// # Safety
    /// As [`load_blas`](Self::load_blas): the bytes are not forged.
    pub unsafe fn load_or_create_blas(
        &self,
        desc: &BlasDesc<'_>,
        bytes: Option<&[u8]>,
    ) -> Result<LoadedBlas> {
        // SAFETY: the caller vouches for the bytes.
        match bytes.map(|bytes| unsafe { self.load_blas(desc, bytes) }) {
            Some(Ok(blas)) => Ok(LoadedBlas { blas, rejected: None }),
            Some(Err(error @ Error::Serialized { .. })) => {
                log::warn!("{error}; building it anew");
                Ok(LoadedBlas { blas: self.create_blas(desc)?, rejected: Some(error) })
            }
            Some(Err(error)) => Err(error),
            None => Ok(LoadedBlas { blas: self.create_blas(desc)?, rejected: None }),
        }
    }

    /// Returns the driver's data of each part, all of one state of the BLAS.
    fn serialize_parts(&self, object: &Arc<AccelStruct>) -> Result<Vec<Vec<u8>>> {
        let body = self.clone_structures(object)?;
        let sizes = self.serialized_sizes(object, &body)?;
        #[cfg(any(test, feature = "test-hooks"))]
        crate::test_support::submit_hook::run_serialize_hook();
        let mut all = Vec::with_capacity(sizes.len());
        for group in group_by_bytes(&sizes, self.max_group_bytes()) {
            let sizes = &sizes[group.clone()];
            let bytes = self.serialize_group(object, &body, group, sizes);
            all.extend(bytes.map_err(|error| error.with_owner(READBACK, &object.name))?);
        }
        Ok(all)
    }

    /// Copies the structures (`vkCmdCopyAccelerationStructureKHR`). Other threads may build the BLAS until the driver's data are read, and a
    /// build may change their size. The copy goes ahead of all later submissions.
    fn clone_structures(&self, object: &Arc<AccelStruct>) -> Result<Arc<BlasStructures>> {
        let (shared, blas) = (self.device_state(), object.blas()?);
        // The copy is gone soon, and so does not count against the budget of the application.
        let storage = AccelStorage::new(u64::MAX);
        let (from, to) = self.record_in_prologue(|cmd| {
            let from = blas.structures();
            let ty = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
            let copy = |part: &RawAccelStruct| {
                RawAccelStruct::new(&shared.gpu, &storage, &object.name, ty, part.bytes)
            };
            let structures = from.structures.iter().map(copy).collect::<Result<Vec<_>>>()?;
            let to = Arc::new(BlasStructures { structures, compacted_from: None, rebuildable: false });
            cmd.clone_structures(object, &from, &to)?;
            Ok((from, to))
        })?;
        for used in [from, Arc::clone(&to)] {
            shared.free_later(DeferredObject::BlasStorage(used));
        }
        Ok(to)
    }

    fn serialized_sizes(&self, object: &AccelStruct, body: &Arc<BlasStructures>) -> Result<Vec<u64>> {
        let count = body.structures.len() as u32;
        let desc = QueryPoolDesc { count, debug_name: &object.name, ..Default::default() };
        let ty = vk::QueryType::ACCELERATION_STRUCTURE_SERIALIZATION_SIZE_KHR;
        let pool = Arc::new(QueryPool::with_type(&self.device_state().gpu, &desc, ty)?);
        let mut cmd = self.acquire_command_buffer()?;
        cmd.write_size_properties(object, body, &pool, 0, ty)?;
        self.device_state().free_later(DeferredObject::QueryPool(Arc::clone(&pool)));
        self.device_state().free_later(DeferredObject::BlasStorage(Arc::clone(body)));
        self.wait(self.submit(cmd)?)?;
        let values = self.device_state().submitter.explain_loss(pool.values(0, count))?;
        let sizes: Option<Vec<_>> = values.into_iter().collect();
        sizes.ok_or_else(|| Error::usage(&object.name, "the device returned no size for a serialised BLAS"))
    }

    /// Serialises parts that share one buffer.
    fn serialize_group(
        &self,
        object: &AccelStruct,
        body: &Arc<BlasStructures>,
        group: Range<usize>,
        sizes: &[u64],
    ) -> Result<Vec<Vec<u8>>> {
        let places = AlignedOffsets::new(sizes);
        let buffer = self.blob_buffer(&object.name, places.total)?;
        let base = buffer.address.next_multiple_of(ALIGNMENT);
        let addresses: Vec<_> = places.offsets.iter().map(|offset| base + offset).collect();
        let mut bytes = zeroed_bytes("serialize_blas", &object.name, places.total)?;
        self.read_back(places.total, &mut bytes, |cmd, target| {
            self.device_state().free_later(DeferredObject::Buffer(Arc::clone(&buffer)));
            self.device_state().free_later(DeferredObject::BlasStorage(Arc::clone(body)));
            cmd.serialize_parts(object, &body.structures[group], &buffer, &addresses)?;
            cmd.copy_buffer_objects(
                &buffer,
                target,
                &[BufferCopy { source_offset: base - buffer.address, target_offset: 0, size: places.total }],
            )
        })?;
        let part = |(offset, size): (&u64, &u64)| -> Result<Vec<u8>> {
            let mut part = zeroed_bytes("serialize_blas", &object.name, *size)?;
            part.copy_from_slice(&bytes[*offset as usize..][..*size as usize]);
            Ok(part)
        };
        places.offsets.iter().zip(sizes).map(part).collect()
    }

    /// Reads the words of a part's primitive map.
    fn read_primitive_map(&self, shape: &BlasPart) -> Result<Option<Vec<u32>>> {
        let Some(map) = &shape.map else { return Ok(None) };
        let ranges = &shape.input.ranges;
        let count = ranges.iter().map(|range| range.primitive_count as usize).sum::<usize>();
        check_host_memory("serialize_blas", READBACK, 4 * (ranges.len() + count))?;
        let mut words = vec![0_u32; ranges.len() + count];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut words);
        let size = bytes.len() as u64;
        self.read_back(size, bytes, |cmd, target| {
            self.device_state().free_later(DeferredObject::BufferRef(Arc::clone(&map.table)));
            cmd.copy_buffer_objects(
                &map.table,
                target,
                &[BufferCopy { source_offset: 0, target_offset: 0, size }],
            )
        })?;
        Ok(Some(words))
    }

    /// Creates a buffer for serialised parts, with space to align its address.
    fn blob_buffer(&self, name: &str, bytes: u64) -> Result<Arc<Buffer>> {
        let desc = BufferDesc { size_bytes: bytes + ALIGNMENT, debug_name: name, ..Default::default() };
        Ok(Arc::new(Buffer::new(&self.device_state().gpu, &desc, InternalUsage::NONE)?))
    }

    /// Checks by the header of a part that the driver can read it. Returns the size of its acceleration structure in
    /// bytes.
    fn check_driver(&self, part: &BlasFilePart) -> Result<u64, String> {
        let damaged = || "the driver's header is damaged".to_owned();
        let version = part.version_data().ok_or_else(damaged)?;
        let structure = driver_structure_bytes(part);
        let info = vk::AccelerationStructureVersionInfoKHR::default().version_data(version);
        let gpu = &self.device_state().gpu;
        let ext = gpu.accel_functions().map_err(|error| error.to_string())?;
        // SAFETY: the version data has the 32 bytes Vulkan reads.
        let answer = unsafe { ext.get_device_acceleration_structure_compatibility(&info) };
        if answer != vk::AccelerationStructureCompatibilityKHR::COMPATIBLE {
            return Err(format!(
                "another device or driver wrote it, '{}' cannot read it",
                gpu.caps.device_name
            ));
        }
        structure.ok_or_else(damaged)
    }

    /// # Safety
    /// The driver wrote the parts' data.
    unsafe fn deserialize(
        &self,
        desc: &BlasDesc<'_>,
        blob: &BlasFile,
        inputs: BlasInputs,
        bytes: &[u64],
    ) -> Result<Holder<AccelStructHandle>> {
        let shared = self.device_state();
        let (name, ty) = (desc.debug_name, vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL);
        let fits = |(shape, bytes): (&BlasPart, &u64)| shape.sizes.structure_bytes <= *bytes;
        let rebuildable = inputs.parts.iter().zip(bytes).all(fits);
        let structure =
            |bytes: &u64| RawAccelStruct::new(&shared.gpu, &shared.accel_storage, name, ty, *bytes);
        let structures = bytes.iter().map(structure).collect::<Result<Vec<_>>>()?;
        let body = BlasStructures { structures, compacted_from: None, rebuildable };
        // The file contains the driver's data only, so BVHs for software ray queries are built again.
        let built = self.software_blobs(std::slice::from_ref(desc))?.pop().flatten();
        let software = self.software_blas(desc, built.as_ref())?;
        let handle = shared.store.accel_structs.insert(new_blas_object(desc, inputs, body, software));
        let holder = Holder::new(self, handle, 0);
        let object = shared.store.accel_structs.get(handle)?;
        built.map(|built| self.upload_software_blob(&object, &built)).transpose()?;
        self.record_in_prologue(|cmd| cmd.build_software_blas(&object))?;
        let sizes: Vec<_> = blob.parts.iter().map(|part| part.driver.len() as u64).collect();
        for group in group_by_bytes(&sizes, self.max_group_bytes()) {
            let (first, parts) = (group.start, &blob.parts[group.clone()]);
            // SAFETY: the caller's promise; the acceleration structures have the sizes that the data states.
            unsafe { self.deserialize_group(&object, first, parts, &sizes[group]) }?;
        }
        self.record_in_prologue(|cmd| cmd.prepare_deserialized(&object))?;
        Ok(holder)
    }

    /// Deserialises parts from `first` on, which share one buffer.
    ///
    /// # Safety
    /// The driver wrote the parts' data, and the acceleration structures have the sizes that the data states.
    unsafe fn deserialize_group(
        &self,
        object: &Arc<AccelStruct>,
        first: usize,
        parts: &[BlasFilePart],
        sizes: &[u64],
    ) -> Result<()> {
        let places = AlignedOffsets::new(sizes);
        let buffer = self.blob_buffer(&object.name, places.total)?;
        let base = buffer.address.next_multiple_of(ALIGNMENT);
        let addresses: Vec<_> = places.offsets.iter().map(|offset| base + offset).collect();
        let start = base - buffer.address;
        let mut drivers = parts.iter().zip(&places.offsets);
        let uploaded = drivers
            .try_for_each(|(part, offset)| self.upload_to_buffer(&buffer, start + offset, &part.driver));
        let recorded = uploaded.and_then(|()| {
            // SAFETY: the caller's promise; the addresses are those of the parts.
            self.record_in_prologue(|cmd| unsafe {
                cmd.deserialize_parts(object, first, &buffer, &addresses)
            })
        });
        self.device_state().free_later(DeferredObject::Buffer(buffer));
        recorded
    }

    /// Returns the maximum bytes of parts that share one buffer.
    fn max_group_bytes(&self) -> u64 {
        MAX_GROUP_BYTES.min(self.device_state().gpu.caps.limits.max_accel_structure_bytes)
    }

    /// Returns the input of a loaded BLAS, with the tables of its parts. `bytes` holds the size of each part.
    fn loaded_inputs(&self, desc: &BlasDesc<'_>, blob: &BlasFile, bytes: &[u64]) -> Result<BlasInputs> {
        let shared = self.device_state();
        let (transforms, whole) = convert_geometries(shared, desc)?;
        if whole.micromaps().next().is_some() {
            return Err(rejected_error(desc, "its description has opacity micromaps"));
        }
        let counts: Vec<_> = desc.geometries.iter().map(BlasGeometry::primitive_count).collect();
        let plans = part_plans_from_file(blob, &counts).ok_or_else(|| {
            rejected_error(desc, "its parts are not those of the mesh, each primitive once")
        })?;
        let mut parts = Vec::with_capacity(plans.len());
        for (plan, bytes) in plans.iter().zip(bytes) {
            let shape = match plan {
                None => BlasPart { input: whole.clone(), map: None, sizes: whole.query_sizes(&shared.gpu)? },
                Some(plan) => self.new_part(desc, &whole, plan)?,
            };
            let most = shape.sizes.structure_bytes;
            if *bytes > most {
                let reason = format!("a part is to take {bytes} bytes, where a build takes at most {most}");
                return Err(rejected_error(desc, reason));
            }
            parts.push(shape);
        }
        Ok(BlasInputs { transforms, parts })
    }
}

/// Returns the bytes of a file with these parts of a BLAS.
fn encode(
    object: &AccelStruct,
    geometries: Vec<BlasFileGeometry>,
    parts: Vec<BlasFilePart>,
) -> Result<Vec<u8>> {
    let file = BlasFile { flags: object.flags.bits(), geometries, parts };
    check_host_memory("serialize_blas", &object.name, encoded_bytes(&file))?;
    Ok(encode_blas_file(&file))
}

/// Returns the size in bytes of the acceleration structure that the driver's header states. Returns `None` for a header
/// that contradicts the data, or is not that of a BLAS.
pub(crate) fn driver_structure_bytes(part: &BlasFilePart) -> Option<u64> {
    let number = |at: usize| Some(u64::from_le_bytes(part.driver.get(at..at + 8)?.try_into().ok()?));
    let (written, structure, handles) = (number(32)?, number(40)?, number(48)?);
    let is_bottom_level = handles == 0;
    (written == part.driver.len() as u64 && structure != 0 && is_bottom_level).then_some(structure)
}

/// Returns the primitives of each part, or `None` for a part that is the unchanged mesh. Returns `None` if the parts do
/// not make up the mesh.
pub(crate) fn part_plans_from_file(blob: &BlasFile, counts: &[u32]) -> Option<Vec<Option<PartPlan>>> {
    if let [BlasFilePart { map: None, .. }] = &blob.parts[..] {
        return Some(vec![None]);
    }
    let lists = |part: &BlasFilePart| decode_table(part.map.as_ref()?, counts);
    let parts: Vec<_> = blob.parts.iter().map(lists).collect::<Option<_>>()?;
    let complete = !parts.is_empty() && covers_mesh(&parts, counts);
    complete.then(|| parts.into_iter().map(|geometries| Some(PartPlan { geometries })).collect())
}

fn rejected_error(desc: &BlasDesc<'_>, reason: impl Into<String>) -> Error {
    Error::Serialized { object: desc.debug_name.to_owned(), reason: reason.into() }
}

/// Groups parts of these sizes into groups of at most `most` bytes. A larger part has a group alone.
fn group_by_bytes(sizes: &[u64], most: u64) -> Vec<Range<usize>> {
    let (mut groups, mut start, mut sum) = (Vec::new(), 0, 0_u64);
    for (index, size) in sizes.iter().map(|size| size.next_multiple_of(ALIGNMENT)).enumerate() {
        sum = sum.saturating_add(size);
        if index > start && sum > most {
            groups.push(start..index);
            (start, sum) = (index, size);
        }
    }
    if start < sizes.len() {
        groups.push(start..sizes.len());
    }
    groups
}

/// The offset of each of several blobs.
struct AlignedOffsets {
    offsets: Vec<u64>,
    total: u64,
}

impl AlignedOffsets {
    fn new(sizes: &[u64]) -> Self {
        let mut total = 0;
        let mut place = |size: &u64| {
            let offset = total;
            total += size.next_multiple_of(ALIGNMENT);
            offset
        };
        let offsets = sizes.iter().map(&mut place).collect();
        Self { offsets, total }
    }
}

fn file_geometry(geometry: &BlasGeometry) -> BlasFileGeometry {
    let kind = match geometry {
        BlasGeometry::Triangles(triangles) => BlasFileGeometryKind::Triangles {
            vertex_format: triangles.vertex_format.raw().as_raw().cast_unsigned(),
            vertex_count: triangles.vertex_count,
            indices: match triangles.indices.map(|indices| indices.format) {
                // Acceleration structures are not built from 8-bit indices.
                None | Some(IndexFormat::U8) => BlasFileIndices::None,
                Some(IndexFormat::U16) => BlasFileIndices::U16,
                Some(IndexFormat::U32) => BlasFileIndices::U32,
            },
            is_transformed: triangles.transform.is_some(),
        },
        BlasGeometry::Aabbs(_) => BlasFileGeometryKind::Boxes,
    };
    let flags: GeometryFlags = geometry.flags();
    BlasFileGeometry { kind, primitive_count: geometry.primitive_count(), flags: flags.bits() }
}

fn check_same_mesh(desc: &BlasDesc<'_>, blob: &BlasFile) -> Result<(), String> {
    if blob.flags != desc.flags.bits() {
        let found = BuildFlags::from_bits_retain(blob.flags);
        return Err(format!("it was built with {found:?}, not with {:?}", desc.flags));
    }
    let wanted: Vec<_> = desc.geometries.iter().map(file_geometry).collect();
    if blob.geometries != wanted {
        return Err("it was built from other geometries".to_owned());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Groups contain each part once and in order, are as large as allowed, and hold one part only if it must be
        /// alone.
        #[test]
        fn groups_are_as_large_as_they_may_be(
            sizes in prop::collection::vec(1..5_000_u64, 0..40),
            most in 256..20_000_u64
        ) {
            let groups = group_by_bytes(&sizes, most);
            let listed: Vec<usize> = groups.iter().cloned().flatten().collect();
            prop_assert_eq!(listed, (0..sizes.len()).collect::<Vec<_>>());
            let bytes = |group: Range<usize>| AlignedOffsets::new(&sizes[group]).total;
            for group in &groups {
                prop_assert!(group.len() == 1 || bytes(group.clone()) <= most);
            }
            for pair in groups.windows(2) {
                prop_assert!(bytes(pair[0].start..pair[1].start + 1) > most, "there was room for one more");
            }
        }
    }
}
