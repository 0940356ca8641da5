//! Re-braiding: splits overlapping instances into parts (Benthin, Woop, Wald and Afra, "Improved Two-Level BVHs Using
//! Partial Re-Braiding", 2017). A ray then enters only the parts that it hits, not every instance whose bounds it hits.

use std::borrow::Cow;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::encode_instances::{PlacedInstance, transform_bounds_rows};
use crate::accel::primitive_bounds::Bounds;
use crate::software_ray_query::rebraid_parts::RebraidPart;

/// Maximum instances for re-braiding: the pairwise overlap test would take too long for more.
const MAX_INSTANCES: u32 = 512;
/// Minimum extra records, so that a few instances can be split.
const MIN_EXTRA_RECORDS: u32 = 16;

/// Returns the maximum records of `instances` instances after re-braiding, and the capacity of their TLAS.
pub(crate) fn record_capacity(instances: u32) -> u32 {
    let may_be_split = (2..=MAX_INSTANCES).contains(&instances);
    instances + if may_be_split { instances.max(MIN_EXTRA_RECORDS) } else { 0 }
}

/// A record that may be split.
struct RebraidCandidate<'a> {
    instance: &'a PlacedInstance,
    part: &'a RebraidPart,
    record: PlacedInstance,
    is_split: bool,
}

/// Splits the largest overlapping instances if their parts leave empty space. Stops before there are more records than
/// [`record_capacity`] for these instances, or more than `max_records`.
pub(crate) fn rebraid(instances: &[PlacedInstance], max_records: usize) -> Cow<'_, [PlacedInstance]> {
    let most = max_records.min(record_capacity(instances.len() as u32) as usize);
    if most <= instances.len() {
        return instances.into();
    }
    let whole =
        |of| RebraidCandidate { instance: of, part: &of.parts.whole, record: of.clone(), is_split: false };
    let mut candidates: Vec<_> = instances.iter().map(whole).collect();
    let mut count = candidates.len();
    let area = |bounds: &Bounds| bounds.half_area().to_bits(); // in order, as none is negative
    let overlapping = overlapping(instances).into_iter().enumerate().filter(|(_, overlaps)| *overlaps);
    let mut largest: BinaryHeap<_> =
        overlapping.map(|(number, _)| (area(&candidates[number].record.bounds), Reverse(number))).collect();
    while let Some((_, Reverse(number))) = largest.pop() {
        let parts = split_candidate(&candidates[number]);
        if count + parts.len() > most + 1 {
            break;
        }
        let sum: f32 = parts.iter().map(|part| part.record.bounds.half_area()).sum();
        if parts.len() < 2 || sum > candidates[number].record.bounds.half_area() {
            continue;
        }
        candidates[number].is_split = true;
        count += parts.len() - 1;
        for part in parts {
            largest.push((area(&part.record.bounds), Reverse(candidates.len())));
            candidates.push(part);
        }
    }
    candidates.into_iter().filter(|candidate| !candidate.is_split).map(|candidate| candidate.record).collect()
}

/// Returns for each instance true if it overlaps another. Sweeps along the axis of the largest extent.
fn overlapping(instances: &[PlacedInstance]) -> Vec<bool> {
    let whole = instances.iter().fold(Bounds::EMPTY, |all, of| all.union(of.bounds));
    let axis = (whole.high - whole.low).max_position();
    let bounds = |number: usize| &instances[number].bounds;
    let mut order: Vec<_> = (0..instances.len()).collect();
    order.sort_unstable_by(|a, b| bounds(*a).low[axis].total_cmp(&bounds(*b).low[axis]));
    let mut overlap = vec![false; instances.len()];
    for (place, one) in order.iter().enumerate() {
        let near =
            order[place + 1..].iter().take_while(|other| bounds(**other).low[axis] < bounds(*one).high[axis]);
        for other in near {
            if !(overlap[*one] && overlap[*other]) && bounds_overlap(bounds(*one), bounds(*other)) {
                (overlap[*one], overlap[*other]) = (true, true);
            }
        }
    }
    overlap
}

fn bounds_overlap(one: &Bounds, other: &Bounds) -> bool {
    one.low.cmplt(other.high).all() && other.low.cmplt(one.high).all()
}

/// Returns a record for each part of a candidate.
fn split_candidate<'a>(candidate: &RebraidCandidate<'a>) -> Vec<RebraidCandidate<'a>> {
    let part = |part: &'a RebraidPart| {
        let mut record = candidate.instance.clone();
        record.instance.entry = part.reference;
        record.bounds = transform_bounds_rows(&record.instance.object_to_world, part.bounds);
        RebraidCandidate { instance: candidate.instance, part, record, is_split: false }
    };
    candidate.instance.parts.children_of(candidate.part).iter().map(part).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;
    use std::sync::Arc;

    use glam::{Affine3A, Quat, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::accel::instance::TlasInstance;
    use crate::accel::transform::transform_rows;
    use crate::handle::{AccelStructHandle, Handle};
    use crate::software_ray_query::bvh::encode_instances::{InstancedBlas, place_instance};
    use crate::software_ray_query::bvh::subtrees::tests::{primitives, row, structure};

    /// Instances of one BLAS of 300 AABBs.
    fn placed(transforms: &[Affine3A]) -> (Vec<u8>, Vec<PlacedInstance>) {
        let boxes = row(300, Vec3::ZERO);
        let (bytes, parts) = structure(&boxes);
        let blas = InstancedBlas { address: 256, parts: Arc::new(parts) };
        let instance = |transform: &Affine3A| TlasInstance {
            transform: transform_rows(transform),
            ..TlasInstance::new(AccelStructHandle::from_bits(1))
        };
        let all =
            (0..).zip(transforms).filter_map(|(number, of)| place_instance(number, &instance(of), &blas));
        (bytes, all.collect())
    }

    fn transforms() -> impl Strategy<Value = Vec<Affine3A>> {
        let vector = |most: f32| prop::array::uniform3(-most..most).prop_map(Vec3::from_array);
        let scale = prop::sample::select(vec![Vec3::ONE, Vec3::new(-1.0, 2.0, 0.5)]);
        let one = (vector(1.0), 0.0..6.0_f32, vector(200.0), scale).prop_map(|(axis, angle, to, scale)| {
            let turn = Quat::from_axis_angle((axis + 1e-3).normalize(), angle);
            Affine3A::from_scale_rotation_translation(scale, turn, to)
        });
        prop::collection::vec(one, 0..20)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(30))]
        #[test]
        fn every_primitive_of_every_instance_is_in_one_record(transforms in transforms(), max_records in 0..60_usize) {
            let (bytes, instances) = placed(&transforms);
            let records = rebraid(&instances, max_records);
            let capacity = record_capacity(instances.len() as u32) as usize;
            prop_assert!(records.len() <= instances.len().max(max_records.min(capacity)));
            let mut seen = HashMap::new();
            for record in &*records {
                let matrix = transforms[record.instance.number as usize];
                for held in primitives(&bytes, record.instance.entry) {
                    *seen.entry((record.instance.number, held.primitive)).or_insert(0) += 1;
                    for corner in 0..8 {
                        let pick = Vec3::new((corner & 1) as f32, (corner >> 1 & 1) as f32, (corner >> 2) as f32);
                        let at = matrix.transform_point3(held.low + (held.high - held.low) * pick);
                        prop_assert!(at.cmpge(record.bounds.low).all() && at.cmple(record.bounds.high).all());
                    }
                }
            }
            prop_assert_eq!(seen.len(), 300 * instances.len());
            prop_assert!(seen.values().all(|count| *count == 1));
        }
    }

    #[test]
    fn only_overlapping_instances_are_divided() {
        let at = |x: f32| Affine3A::from_translation(Vec3::new(x, 0.0, 0.0));
        let apart = placed(&[at(0.0), at(400.0), at(800.0)]).1;
        assert_eq!(rebraid(&apart, 60).len(), 3);
        assert_eq!(rebraid(&placed(&[at(0.0)]).1, 60).len(), 1);
        let (_, in_a_row) = placed(&[at(0.0), at(20.0), at(10.0), at(900.0), at(30.0), at(5.0)]);
        let records = rebraid(&in_a_row, 100);
        assert!(records.len() > 6 && records.len() <= 22, "{}", records.len());
        assert_eq!(records.iter().filter(|record| record.instance.number == 3).count(), 1);
        assert!(records.iter().any(|record| record.instance.entry != 0));
    }

    #[test]
    fn overlaps_along_every_axis_are_noticed() {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            let at = |place: f32| Affine3A::from_translation(axis * place);
            // The BLAS is 300 long, 900 high and 3 deep.
            let instances =
                placed(&[at(5_000.0), at(0.0), at(9_000.0), at(2.0), at(-4_000.0), at(8_999.0)]).1;
            assert_eq!(overlapping(&instances), [false, true, true, true, false, true]);
        }
    }

    #[test]
    fn the_capacity_is_twice_the_instances_if_they_are_few() {
        let rooms = [0, 1, 2, 128, 512, 513, 1024, 10_000, u32::MAX].map(record_capacity);
        assert_eq!(rooms, [0, 1, 18, 256, 1024, 513, 1024, 10_000, u32::MAX]);
    }
}
