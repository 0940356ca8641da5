//! Layout of a shader binding table, as plain arithmetic.

use crate::error::{Result, check_limit};

/// What a device asks of shader binding tables (`VkPhysicalDeviceRayTracingPipelinePropertiesKHR`), in bytes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SbtLimits {
    /// Size of a shader group handle.
    pub(crate) handle_bytes: u32,
    /// Alignment of every record.
    pub(crate) handle_alignment: u32,
    /// Alignment of the first record of every region.
    pub(crate) base_alignment: u32,
    /// Largest distance between records.
    pub(crate) max_stride: u32,
}

/// Shader groups of a pipeline, in the order of their handles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SbtGroups<'a> {
    /// Number of ray generation shaders.
    pub(crate) ray_gen: u32,
    /// Number of miss shaders.
    pub(crate) miss: u32,
    /// Bytes of user data behind the handle, for each hit group.
    pub(crate) hit_records: &'a [usize],
    /// Number of callable shaders.
    pub(crate) callable: u32,
}

/// One region, in bytes from the base-aligned start of the table; all zero where there is no such shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct SbtRegion {
    /// Start of the first record.
    pub(crate) offset: u64,
    /// Distance between records.
    pub(crate) stride: u64,
    /// All records.
    pub(crate) size: u64,
}

impl SbtRegion {
    fn record_count(&self) -> u64 {
        self.size.checked_div(self.stride).unwrap_or(0)
    }

    fn record(&self, index: u64) -> u64 {
        self.offset + index * self.stride
    }
}

/// Where every record goes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct SbtPlan {
    /// One region of a single record for each ray generation shader, since Vulkan takes exactly one record there.
    pub(crate) ray_gen: Vec<SbtRegion>,
    /// Miss shaders.
    pub(crate) miss: SbtRegion,
    /// Hit groups.
    pub(crate) hit: SbtRegion,
    /// Callable shaders.
    pub(crate) callable: SbtRegion,
    /// Size of the whole table.
    pub(crate) bytes: u64,
}

impl SbtPlan {
    /// Start of every record, in the order of the group handles.
    fn records(&self) -> impl Iterator<Item = u64> {
        let tables = [self.miss, self.hit, self.callable];
        let regions = self.ray_gen.iter().copied().chain(tables);
        regions.flat_map(|region| (0..region.record_count()).map(move |index| region.record(index)))
    }
}

/// Places all records: strides are multiples of the handle alignment, regions start at multiples of the base alignment.
///
/// # Errors
/// [`Error::LimitExceeded`](crate::error::Error::LimitExceeded) if a record with its handle is longer than the
/// device's largest stride.
pub(crate) fn plan_sbt(limits: &SbtLimits, groups: &SbtGroups<'_>) -> Result<SbtPlan> {
    let longest = groups.hit_records.iter().copied().max().unwrap_or(0);
    let plain = stride(limits, 0);
    let hit_stride = stride(limits, longest);
    check_limit("shader binding table", "hit group record", hit_stride, u64::from(limits.max_stride))?;
    let mut end = 0;
    let mut place = |count: u64, stride: u64| {
        if count == 0 {
            return SbtRegion::default();
        }
        let offset = align_up(end, limits.base_alignment);
        end = offset + count * stride;
        SbtRegion { offset, stride, size: count * stride }
    };
    Ok(SbtPlan {
        ray_gen: (0..groups.ray_gen).map(|_| place(1, plain)).collect(),
        miss: place(u64::from(groups.miss), plain),
        hit: place(groups.hit_records.len() as u64, hit_stride),
        callable: place(u64::from(groups.callable), plain),
        bytes: end,
    })
}

/// Fills the table: `handles` holds the group handles one behind the other in the order ray generation, miss, hit,
/// callable; `records` the user data of each hit group. Bytes that belong to no record become zero.
///
/// What does not fit into `out`, or is missing from `handles`, is left out.
pub(crate) fn write_sbt(
    plan: &SbtPlan,
    limits: &SbtLimits,
    handles: &[u8],
    records: &[&[u8]],
    out: &mut [u8],
) {
    out.fill(0);
    let handle_bytes = limits.handle_bytes.max(1) as usize;
    for (at, handle) in plan.records().zip(handles.chunks_exact(handle_bytes)) {
        copy_at(out, at, handle);
    }
    for (index, record) in (0..plan.hit.record_count()).zip(records) {
        let room = (plan.hit.stride as usize).saturating_sub(handle_bytes).min(record.len());
        copy_at(out, plan.hit.record(index) + handle_bytes as u64, &record[..room]);
    }
}

/// Bytes to allocate so that the table still fits once the buffer's address is rounded up to the base alignment.
pub(crate) fn sbt_buffer_bytes(plan: &SbtPlan, base_alignment: u32) -> u64 {
    plan.bytes + u64::from(base_alignment.saturating_sub(1))
}

fn stride(limits: &SbtLimits, record_bytes: usize) -> u64 {
    align_up((record_bytes as u64).saturating_add(u64::from(limits.handle_bytes)), limits.handle_alignment)
}

/// Saturates instead of wrapping: a size near the top of the range is over every limit anyway.
fn align_up(value: u64, alignment: u32) -> u64 {
    value.checked_next_multiple_of(u64::from(alignment.max(1))).unwrap_or(u64::MAX)
}

fn copy_at(out: &mut [u8], at: u64, bytes: &[u8]) {
    let start = at as usize;
    if let Some(place) = out.get_mut(start..start.saturating_add(bytes.len())) {
        place.copy_from_slice(bytes);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::error::Error;

    fn limits() -> impl Strategy<Value = SbtLimits> {
        let bytes = prop::sample::select(vec![8_u32, 16, 24, 32, 48, 64]);
        let handle = prop::sample::select(vec![16_u32, 32, 64]);
        let base = prop::sample::select(vec![32_u32, 64, 128, 256]);
        (bytes, handle, base).prop_map(|(handle_bytes, handle_alignment, base_alignment)| SbtLimits {
            handle_bytes,
            handle_alignment,
            base_alignment,
            max_stride: 4096,
        })
    }

    fn groups() -> impl Strategy<Value = (u32, u32, Vec<Vec<u8>>, u32)> {
        let record = prop::collection::vec(1..=255_u8, 0..200);
        (0..4_u32, 0..5_u32, prop::collection::vec(record, 0..6), 0..4_u32)
    }

    fn handles(count: usize, limits: &SbtLimits) -> Vec<u8> {
        (0..count).flat_map(|index| vec![index as u8 + 1; limits.handle_bytes as usize]).collect()
    }

    proptest! {
        #[test]
        fn every_record_is_aligned_complete_and_alone(
            limits in limits(), (ray_gen, miss, records, callable) in groups()
        ) {
            let hit_records: Vec<usize> = records.iter().map(Vec::len).collect();
            let groups = SbtGroups { ray_gen, miss, hit_records: &hit_records, callable };
            let plan = plan_sbt(&limits, &groups).unwrap();
            let count = (ray_gen + miss + callable) as usize + records.len();
            let starts: Vec<u64> = plan.records().collect();
            prop_assert_eq!(starts.len(), count);

            let mut regions = plan.ray_gen.clone();
            prop_assert!(regions.iter().all(|region| region.size == region.stride));
            regions.extend([plan.miss, plan.hit, plan.callable]);
            let mut end = 0;
            for region in regions.iter().filter(|region| region.size > 0) {
                prop_assert_eq!(region.offset % u64::from(limits.base_alignment), 0);
                prop_assert_eq!(region.stride % u64::from(limits.handle_alignment), 0);
                prop_assert!(region.offset >= end);
                end = region.offset + region.size;
            }
            prop_assert_eq!(end, plan.bytes);

            let mut out = vec![0xEE; plan.bytes as usize];
            let data: Vec<&[u8]> = records.iter().map(Vec::as_slice).collect();
            write_sbt(&plan, &limits, &handles(count, &limits), &data, &mut out);
            let mut expected = vec![0; plan.bytes as usize];
            for (index, start) in starts.iter().enumerate() {
                let start = *start as usize;
                let mut record = handles(count, &limits)[index * limits.handle_bytes as usize..]
                    [..limits.handle_bytes as usize].to_vec();
                if let Some(hit) = index.checked_sub((ray_gen + miss) as usize) {
                    record.extend(records.get(hit).into_iter().flatten());
                }
                expected[start..start + record.len()].copy_from_slice(&record);
            }
            prop_assert_eq!(out, expected);
        }

        #[test]
        fn table_fits_behind_any_rounded_address(limits in limits(), miss in 1..9_u32, address in 0..100_000_u64) {
            let groups = SbtGroups { ray_gen: 1, miss, hit_records: &[5], callable: 0 };
            let plan = plan_sbt(&limits, &groups).unwrap();
            let start = address.next_multiple_of(u64::from(limits.base_alignment));
            let end = address + sbt_buffer_bytes(&plan, limits.base_alignment);
            prop_assert!(start + plan.bytes <= end);
        }

        #[test]
        fn short_inputs_are_left_out(limits in limits(), handle_bytes in 0..200_usize, room in 0..300_usize) {
            let groups = SbtGroups { ray_gen: 1, miss: 2, hit_records: &[9, 0], callable: 1 };
            let plan = plan_sbt(&limits, &groups).unwrap();
            let mut out = vec![0xEE; room];
            write_sbt(&plan, &limits, &vec![7; handle_bytes], &[&[9; 500]], &mut out);
            prop_assert!(out.iter().all(|byte| [0, 7, 9].contains(byte)));
        }
    }

    #[test]
    fn usual_desktop_limits() {
        let limits =
            SbtLimits { handle_bytes: 32, handle_alignment: 32, base_alignment: 64, max_stride: 4096 };
        let groups = SbtGroups { ray_gen: 2, miss: 2, hit_records: &[0, 16], callable: 0 };
        let plan = plan_sbt(&limits, &groups).unwrap();
        let region = |offset, stride, size| SbtRegion { offset, stride, size };
        assert_eq!(plan.ray_gen, [region(0, 32, 32), region(64, 32, 32)]);
        assert_eq!(plan.miss, region(128, 32, 64));
        assert_eq!(plan.hit, region(192, 64, 128));
        assert_eq!((plan.callable, plan.bytes), (SbtRegion::default(), 320));
    }

    #[test]
    fn too_long_a_record_names_the_limit() {
        let limits =
            SbtLimits { handle_bytes: 32, handle_alignment: 32, base_alignment: 64, max_stride: 4096 };
        for bytes in [4065, usize::MAX] {
            let groups = SbtGroups { ray_gen: 1, miss: 0, hit_records: &[bytes], callable: 0 };
            let error = plan_sbt(&limits, &groups).unwrap_err();
            assert!(matches!(error, Error::LimitExceeded { what: "hit group record", limit: 4096, .. }));
        }
        let groups = SbtGroups { ray_gen: 1, miss: 0, hit_records: &[4064], callable: 0 };
        assert_eq!(plan_sbt(&limits, &groups).unwrap().hit.stride, 4096);
    }
}
