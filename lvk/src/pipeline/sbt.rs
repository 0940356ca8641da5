//! Layout of a shader binding table, as plain arithmetic.

use super::sbt_order::PerRegion;
use crate::error::{Result, check_limit};

/// Limits of shader binding tables (`VkPhysicalDeviceRayTracingPipelinePropertiesKHR`), in bytes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SbtLimits {
    /// Size of a shader group handle; 0 in a table of records only.
    pub(crate) handle_bytes: u32,
    /// Alignment of every record.
    pub(crate) handle_alignment: u32,
    /// Alignment of the first record of every region.
    pub(crate) base_alignment: u32,
    /// Largest distance between records.
    pub(crate) max_stride: u32,
}

/// The handles of a pipeline's shader groups in Vulkan's order, and the order of the shader binding table.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GroupHandles<'a> {
    pub(crate) bytes: &'a [u8],
    /// See [`sbt_order`](super::sbt_order::sbt_order).
    pub(crate) order: &'a [usize],
}

/// One region, in bytes from the base-aligned start of the shader binding table; all zero if the region is empty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct SbtRegion {
    /// Start of the first record.
    pub(crate) offset: u64,
    /// Distance between records.
    pub(crate) stride: u64,
    /// Size of all records.
    pub(crate) size: u64,
}

impl SbtRegion {
    /// Returns the start of every record.
    fn records(self) -> impl Iterator<Item = u64> {
        let count = self.size.checked_div(self.stride).unwrap_or(0);
        (0..count).map(move |index| self.offset + index * self.stride)
    }
}

/// Position of every record.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct SbtPlan {
    /// One region of a single record for each ray generation shader. Vulkan takes exactly one record in that region.
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
    /// Returns the start and the largest size of every record, in the order of the table.
    fn records(&self) -> impl Iterator<Item = (u64, u64)> {
        let regions = self.ray_gen.iter().copied().chain([self.miss, self.hit, self.callable]);
        regions.flat_map(|region| region.records().map(move |start| (start, region.stride)))
    }
}

/// Computes the position of all records. Strides are multiples of the handle alignment, and never 0; regions start at multiples of
/// the base alignment.
///
/// `records` holds the caller's bytes, which follow the handle of each group.
///
/// # Errors
/// [`Error::LimitExceeded`](crate::error::Error::LimitExceeded) if a record with its handle is longer than the device's
/// largest stride.
pub(crate) fn plan_sbt(
    pipeline: &str,
    limits: &SbtLimits,
    records: &PerRegion<Vec<&[u8]>>,
) -> Result<SbtPlan> {
    let stride = |records: &Vec<&[u8]>| {
        let longest = records.iter().map(|record| record.len()).max().unwrap_or(0) as u64;
        align_up(longest.saturating_add(limits.handle_bytes.into()).max(1), limits.handle_alignment)
    };
    let strides = records.as_ref().map(stride);
    let names =
        ["ray generation shader record", "miss shader record", "hit group record", "callable shader record"];
    for (what, stride) in names.into_iter().zip(strides.into_array()) {
        check_limit(pipeline, what, stride, limits.max_stride.into())?;
    }
    let mut end = 0;
    let mut place = |count: usize, stride: u64| {
        if count == 0 {
            return SbtRegion::default();
        }
        let offset = align_up(end, limits.base_alignment);
        let size = count as u64 * stride;
        end = offset + size;
        SbtRegion { offset, stride, size }
    };
    Ok(SbtPlan {
        ray_gen: records.ray_gen.iter().map(|_| place(1, strides.ray_gen)).collect(),
        miss: place(records.miss.len(), strides.miss),
        hit: place(records.hit.len(), strides.hit),
        callable: place(records.callable.len(), strides.callable),
        bytes: end,
    })
}

/// Writes the handle of each group and the caller's bytes into the table. Bytes outside of the records become zero.
///
/// Bytes that do not fit into `out` and handles missing from `handles` are left out.
pub(crate) fn write_sbt(
    plan: &SbtPlan,
    limits: &SbtLimits,
    handles: &GroupHandles<'_>,
    records: &PerRegion<Vec<&[u8]>>,
    out: &mut [u8],
) {
    out.fill(0);
    let handle_bytes = limits.handle_bytes as usize;
    let records = records.as_ref().into_array().into_iter().flatten();
    for (((start, stride), group), record) in plan.records().zip(handles.order).zip(records) {
        let first = group.saturating_mul(handle_bytes);
        let Some(handle) = handles.bytes.get(first..first.saturating_add(handle_bytes)) else { continue };
        copy_at(out, start, handle);
        let room = (stride as usize).saturating_sub(handle_bytes).min(record.len());
        copy_at(out, start + handle_bytes as u64, &record[..room]);
    }
}

/// Returns the size of the table's buffer. The table fits even after the buffer's address is rounded up to the base
/// alignment.
pub(crate) fn sbt_buffer_bytes(plan: &SbtPlan, base_alignment: u32) -> u64 {
    plan.bytes + u64::from(base_alignment.saturating_sub(1))
}

/// Rounds up to a multiple of `alignment`. Saturates instead of wrapping, since a size near the top of the range
/// exceeds every limit.
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
        let handle = prop::sample::select(vec![16_u32, 32, 64]);
        let base = prop::sample::select(vec![32_u32, 64, 128, 256]);
        (prop_oneof![Just(0), 8..=64_u32], handle, base).prop_map(
            |(handle_bytes, handle_alignment, base_alignment)| SbtLimits {
                handle_bytes,
                handle_alignment,
                base_alignment,
                max_stride: 4096,
            },
        )
    }

    /// Records of the groups of all four regions; no byte is 0.
    fn groups() -> impl Strategy<Value = PerRegion<Vec<Vec<u8>>>> {
        let records = || prop::collection::vec(prop::collection::vec(1..=255_u8, 0..200), 0..5);
        (records(), records(), records(), records()).prop_map(|(ray_gen, miss, hit, callable)| PerRegion {
            ray_gen,
            miss,
            hit,
            callable,
        })
    }

    fn slices(records: &PerRegion<Vec<Vec<u8>>>) -> PerRegion<Vec<&[u8]>> {
        records.as_ref().map(|records| records.iter().map(Vec::as_slice).collect())
    }

    fn plain(counts: [usize; 4]) -> PerRegion<Vec<&'static [u8]>> {
        let [ray_gen, miss, hit, callable] = counts.map(|count| vec![&[][..]; count]);
        PerRegion { ray_gen, miss, hit, callable }
    }

    /// Handles that differ from each other in every byte; none is 0.
    fn handles(count: usize, limits: &SbtLimits) -> Vec<u8> {
        (0..count).flat_map(|index| vec![index as u8 + 1; limits.handle_bytes as usize]).collect()
    }

    proptest! {
        #[test]
        fn regions_are_aligned_and_apart(limits in limits(), groups in groups()) {
            let plan = plan_sbt("p", &limits, &slices(&groups)).unwrap();
            let mut regions = plan.ray_gen.clone();
            prop_assert!(regions.iter().all(|region| region.size == region.stride));
            let counts = groups.as_ref().map(Vec::len);
            prop_assert_eq!(regions.len(), counts.ray_gen);
            let shared =
                [(plan.miss, counts.miss), (plan.hit, counts.hit), (plan.callable, counts.callable)];
            for (region, count) in shared {
                prop_assert_eq!(region.size, count as u64 * region.stride);
                prop_assert_eq!(region == SbtRegion::default(), count == 0);
                regions.push(region);
            }
            let mut end = 0;
            for region in regions.iter().filter(|region| region.size > 0) {
                prop_assert_eq!(region.offset % u64::from(limits.base_alignment), 0);
                prop_assert_eq!(region.stride % u64::from(limits.handle_alignment), 0);
                prop_assert!(region.offset >= end);
                end = region.offset + region.size;
            }
            prop_assert_eq!(end, plan.bytes);
        }

        #[test]
        fn every_record_is_complete_and_alone(limits in limits(), groups in groups(), turn in 0..20_usize) {
            let groups = slices(&groups);
            let plan = plan_sbt("p", &limits, &groups).unwrap();
            let all: Vec<&[u8]> = groups.clone().into_array().concat();
            let mut order: Vec<usize> = (0..all.len()).collect();
            order.rotate_left(turn.min(all.len()));
            let bytes = handles(all.len(), &limits);
            let mut out = vec![0xEE; plan.bytes as usize];
            write_sbt(&plan, &limits, &GroupHandles { bytes: &bytes, order: &order }, &groups, &mut out);

            let mut starts: Vec<u64> = plan.ray_gen.iter().map(|region| region.offset).collect();
            let shared = [(plan.miss, groups.miss.len()), (plan.hit, groups.hit.len()),
                          (plan.callable, groups.callable.len())];
            for (region, count) in shared {
                starts.extend((0..count as u64).map(|index| region.offset + index * region.stride));
            }
            let mut expected = vec![0; plan.bytes as usize];
            for ((start, record), group) in starts.iter().zip(&all).zip(&order) {
                let start = *start as usize;
                let handle = vec![*group as u8 + 1; limits.handle_bytes as usize];
                let whole = [&handle[..], *record].concat();
                prop_assert!(expected[start..start + whole.len()].iter().all(|byte| *byte == 0));
                expected[start..start + whole.len()].copy_from_slice(&whole);
            }
            prop_assert_eq!(out, expected);
        }

        #[test]
        fn table_fits_behind_any_rounded_address(limits in limits(), miss in 1..9_usize, address in 0..100_000_u64) {
            let plan = plan_sbt("p", &limits, &plain([1, miss, 1, 0])).unwrap();
            let start = address.next_multiple_of(u64::from(limits.base_alignment));
            let end = address + sbt_buffer_bytes(&plan, limits.base_alignment);
            prop_assert!(start + plan.bytes <= end);
        }

        #[test]
        fn short_inputs_are_left_out(limits in limits(), handle_bytes in 0..200_usize, room in 0..300_usize) {
            let mut groups = plain([1, 2, 2, 1]);
            groups.hit[0] = &[9; 9];
            let plan = plan_sbt("p", &limits, &groups).unwrap();
            groups.miss[1] = &[9; 500];
            let mut out = vec![0xEE; room];
            let bytes = vec![7; handle_bytes];
            let handles = GroupHandles { bytes: &bytes, order: &[0, usize::MAX, 1, 2, 9] };
            write_sbt(&plan, &limits, &handles, &groups, &mut out);
            prop_assert!(out.iter().all(|byte| [0, 7, 9].contains(byte)));
        }
    }

    #[test]
    fn usual_desktop_limits() {
        let limits =
            SbtLimits { handle_bytes: 32, handle_alignment: 32, base_alignment: 64, max_stride: 4096 };
        let mut groups = plain([2, 2, 2, 0]);
        groups.hit[1] = &[1; 16];
        let plan = plan_sbt("p", &limits, &groups).unwrap();
        let region = |offset, stride, size| SbtRegion { offset, stride, size };
        assert_eq!(plan.ray_gen, [region(0, 32, 32), region(64, 32, 32)]);
        assert_eq!(plan.miss, region(128, 32, 64));
        assert_eq!(plan.hit, region(192, 64, 128));
        assert_eq!((plan.callable, plan.bytes), (SbtRegion::default(), 320));
    }

    #[test]
    fn too_long_a_record_names_the_region_and_the_limit() {
        let limits =
            SbtLimits { handle_bytes: 32, handle_alignment: 32, base_alignment: 64, max_stride: 4096 };
        let (fits, long) = ([0; 4064], [0; 4065]);
        let with = |record| {
            let none = plain([1, 1, 1, 1]);
            [
                ("ray generation shader record", PerRegion { ray_gen: vec![record], ..none.clone() }),
                ("miss shader record", PerRegion { miss: vec![record], ..none.clone() }),
                ("hit group record", PerRegion { hit: vec![record], ..none.clone() }),
                ("callable shader record", PerRegion { callable: vec![record], ..none }),
            ]
        };
        for (name, groups) in with(&long) {
            let error = plan_sbt("p", &limits, &groups).unwrap_err();
            assert!(
                matches!(error, Error::LimitExceeded { what, limit: 4096, .. } if what == name),
                "{error}"
            );
        }
        for (_, groups) in with(&fits) {
            plan_sbt("p", &limits, &groups).unwrap();
        }
    }
}
