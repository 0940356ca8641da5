//! From the caller's instances to the records Vulkan reads.

use std::sync::Arc;

use super::blas_refs::{BitSet, BlasRef, BlasRefCollector, BlasRefSet, ResolveBlas};
use super::instance::{INSTANCE_BYTES, TlasInstance, check_instance, is_valid, to_raw};
use crate::error::{Result, check_limit};
use crate::parallel::{core_count, parallel_for};

/// A thread gets at least so many instances: one converts 200 of them in a microsecond, and takes tens of microseconds to
/// start.
const INSTANCES_PER_THREAD: usize = 1 << 17;
/// More threads than this do not write faster.
const MAX_THREADS: usize = 8;

/// Whether the first structure referred to needs no more than an address, as then mostly all do.
pub(crate) fn first_needs_only_address(instances: &[TlasInstance], resolve: ResolveBlas<'_>) -> Result<bool> {
    let Some(first) = instances.first() else { return Ok(true) };
    Ok(!resolve(first.blas)?.needs_kernel())
}

/// What instances refer to that were written with addresses.
pub(crate) enum WrittenRefs {
    /// What was known, all of it.
    Unchanged,
    /// Something else.
    Changed(Arc<BlasRefSet>),
    /// Some need more than an address; what was written means nothing.
    NeedsKernel,
}

/// Checks `instances` and writes them with addresses, on several threads where there are many. `previous` is what was shown
/// before, if that still stands.
#[inline]
pub(crate) fn write_addresses(
    name: &str,
    instances: &[TlasInstance],
    previous: &BlasRefSet,
    seen_refs: &mut BitSet,
    resolve: ResolveBlas<'_>,
    out: &mut [u8],
) -> Result<WrittenRefs> {
    let threads = thread_count(instances.len());
    if threads > 1 {
        let blas_refs = write_on_threads(name, instances, threads, resolve, out)?;
        let other = |blas_refs| WrittenRefs::Changed(Arc::new(BlasRefSet::new(blas_refs)));
        return Ok(blas_refs.map_or(WrittenRefs::NeedsKernel, other));
    }
    let mut collector = BlasRefCollector::new(previous, seen_refs, resolve);
    if !write_chunk(name, 0, instances, &mut collector, out)? {
        return Ok(WrittenRefs::NeedsKernel);
    }
    if collector.is_unchanged() {
        return Ok(WrittenRefs::Unchanged);
    }
    Ok(WrittenRefs::Changed(Arc::new(collector.finish().0)))
}

/// As [`write_addresses`], of a few instances. Answers `false` unless they are as they should, and refer to all that is known,
/// which needs no more than addresses, and to nothing else; then what was written means nothing.
#[inline(never)]
pub(crate) fn write_unchanged(instances: &[TlasInstance], previous: &BlasRefSet, out: &mut [u8]) -> bool {
    // A bit for each structure that is known. More than there are bits are never all met by a few.
    let mut unmet = match previous.refs().len() {
        count @ 1..=64 => u64::MAX >> (64 - count),
        _ => return false,
    };
    for (instance, out) in instances.iter().zip(out.chunks_exact_mut(INSTANCE_BYTES)) {
        let Some((place, address)) = previous.index_and_address(instance.blas).filter(|_| is_valid(instance))
        else {
            return false;
        };
        unmet &= !(1 << place);
        out.copy_from_slice(bytemuck::bytes_of(&to_raw(instance, address)));
    }
    unmet == 0
}

fn write_on_threads(
    name: &str,
    instances: &[TlasInstance],
    threads: usize,
    resolve: ResolveBlas<'_>,
    out: &mut [u8],
) -> Result<Option<Vec<BlasRef>>> {
    let count = instances.len().div_ceil(threads).max(1);
    let write = move |index: usize, instances: &[TlasInstance], out: &mut [u8]| {
        let (previous, mut seen_refs) = (BlasRefSet::default(), BitSet::default());
        let mut collector = BlasRefCollector::new(&previous, &mut seen_refs, resolve);
        let plain = write_chunk(name, index * count, instances, &mut collector, out)?;
        Ok(plain.then(|| collector.into_new_refs()))
    };
    let mut all: Vec<_> = instances.chunks(count).map(|_| None).collect();
    let chunks =
        instances.chunks(count).zip(out.chunks_mut(count * INSTANCE_BYTES)).zip(&mut all).enumerate();
    parallel_for(threads, chunks, |(index, ((instances, out), written))| {
        *written = Some(write(index, instances, out));
    });
    merge_refs(all.into_iter().flatten())
}

/// Counting cores reads files on Linux, some 10 us: only where there is work for several.
#[inline]
fn thread_count(instances: usize) -> usize {
    let wanted = (instances / INSTANCES_PER_THREAD).min(MAX_THREADS);
    if wanted < 2 {
        return 1;
    }
    core_count().min(wanted)
}

/// Answers `false` where some need more than an address.
#[inline]
fn write_chunk(
    name: &str,
    first: usize,
    instances: &[TlasInstance],
    collector: &mut BlasRefCollector<'_>,
    out: &mut [u8],
) -> Result<bool> {
    let mut last = None;
    for (index, (instance, out)) in instances.iter().zip(out.chunks_exact_mut(INSTANCE_BYTES)).enumerate() {
        let address = match last {
            Some((handle, address)) if handle == instance.blas => address,
            _ => {
                let address = collector.add_for_address(instance.blas)?;
                if collector.needs_kernel {
                    return Ok(false);
                }
                address
            }
        };
        last = Some((instance.blas, address));
        check_instance(name, first + index, instance)?;
        let raw = to_raw(instance, address);
        out.copy_from_slice(bytemuck::bytes_of(&raw));
    }
    Ok(true)
}

/// What all chunks show, each structure once; the first error where there is one.
fn merge_refs(chunks: impl Iterator<Item = Result<Option<Vec<BlasRef>>>>) -> Result<Option<Vec<BlasRef>>> {
    let mut all: Vec<BlasRef> = Vec::new();
    let mut seen = std::collections::HashSet::new();
    let mut needs_kernel = false;
    for chunk in chunks {
        match chunk? {
            None => needs_kernel = true,
            Some(blas_refs) => {
                all.extend(blas_refs.into_iter().filter(|blas_ref| seen.insert(blas_ref.id.0)))
            }
        }
    }
    Ok((!needs_kernel).then_some(all))
}

/// Memory for plans, used again.
#[derive(Default)]
pub(crate) struct PlanMemory {
    pub(crate) seen: BitSet,
    /// The place of what each instance refers to.
    pub(crate) ref_indices: Vec<u32>,
}

/// What a list of instances refers to, and how many Vulkan is given.
pub(crate) struct InstancePlan {
    pub(crate) blas_refs: Arc<BlasRefSet>,
    /// For each instance its place in `blas_refs`.
    ref_indices: Vec<u32>,
    /// Instances with those for further parts of split meshes.
    pub(crate) built_count: u32,
}

impl InstancePlan {
    /// Finds the structures of `instances`, which are to be shown by the structure `name`. `previous` is what was shown
    /// before, if that still stands.
    pub(crate) fn new(
        name: &str,
        instances: &[TlasInstance],
        previous: &Arc<BlasRefSet>,
        memory: &mut PlanMemory,
        resolve: ResolveBlas<'_>,
    ) -> Result<Self> {
        let mut refers = std::mem::take(&mut memory.ref_indices);
        let mut collector = BlasRefCollector::new(previous, &mut memory.seen, resolve);
        refers.clear();
        refers.reserve(instances.len());
        let mut last = None;
        for instance in instances {
            let place = match last {
                Some((handle, place)) if handle == instance.blas => place,
                _ => collector.add(instance.blas)? as u32,
            };
            last = Some((instance.blas, place));
            refers.push(place);
        }
        let blas_refs = if collector.is_unchanged() {
            Arc::clone(previous)
        } else {
            let (blas_refs, moved) = collector.finish();
            refers.iter_mut().for_each(|place| *place = moved[*place as usize]);
            Arc::new(blas_refs)
        };
        let spans = blas_refs.part_spans();
        let built: u64 = if spans.iter().all(|[_, parts]| *parts == 1) {
            refers.len() as u64
        } else {
            refers.iter().map(|place| u64::from(spans[*place as usize][1])).sum()
        };
        check_limit(name, "number of instances, parts of split meshes included", built, u32::MAX.into())?;
        Ok(Self { blas_refs, ref_indices: refers, built_count: built as u32 })
    }

    /// The memory of the plan, to be used again.
    pub(crate) fn into_ref_indices(self) -> Vec<u32> {
        self.ref_indices
    }

    /// Of the instances behind the caller's: whose further parts they are, and which.
    fn extra_parts(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let owners = (0..).zip(&self.ref_indices);
        owners.flat_map(|(owner, place)| {
            let [first, parts] = self.blas_refs.part_spans()[*place as usize];
            (1..parts).map(move |part| (owner, first + part))
        })
    }

    /// How many instances stand behind the caller's.
    pub(crate) fn extra_part_count(&self) -> u32 {
        self.built_count.saturating_sub(self.ref_indices.len() as u32)
    }

    /// Writes whose further parts the instances behind the caller's are.
    pub(crate) fn write_extra_part_owners(&self, out: &mut [u8]) {
        for ((owner, _), out) in self.extra_parts().zip(out.chunks_exact_mut(size_of::<u32>())) {
            out.copy_from_slice(bytemuck::bytes_of(&owner));
        }
    }

    /// Checks the instances and writes them with numbers of [parts](BlasRefSet::part_addresses), those of further parts behind the
    /// caller's.
    pub(crate) fn write_part_indices(
        &self,
        name: &str,
        instances: &[TlasInstance],
        out: &mut [u8],
    ) -> Result<()> {
        let (own, further) = out.split_at_mut(instances.len() * INSTANCE_BYTES);
        let spans = self.blas_refs.part_spans();
        let records = instances.iter().zip(&self.ref_indices).zip(own.chunks_exact_mut(INSTANCE_BYTES));
        for (index, ((instance, place), out)) in records.enumerate() {
            check_instance(name, index, instance)?;
            let [first, _] = spans[*place as usize];
            out.copy_from_slice(bytemuck::bytes_of(&to_raw(instance, first.into())));
        }
        if self.extra_part_count() == 0 {
            return Ok(());
        }
        for ((owner, part), out) in self.extra_parts().zip(further.chunks_exact_mut(INSTANCE_BYTES)) {
            let raw = to_raw(&instances[owner as usize], part.into());
            out.copy_from_slice(bytemuck::bytes_of(&raw));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::accel::blas::{Blas, BlasStructures};
    use crate::accel::flags::BuildFlags;
    use crate::barrier::ResourceId;
    use crate::handle::AccelStructHandle;
    use crate::pool::HandlePool;

    fn blas() -> Blas {
        let body = BlasStructures { structures: Vec::new(), compacted_from: None, rebuildable: true };
        Blas::new(Vec::new(), None, Vec::new(), body, None)
    }

    proptest! {
        /// Against the general way, from what any list before has shown.
        #[test]
        fn a_few_instances_are_written_alike_only_if_they_show_what_is_known(
            count in 1..20_usize,
            before in prop::collection::vec(any::<prop::sample::Index>(), 0..20),
            after in prop::collection::vec(any::<prop::sample::Index>(), 1..17),
            same in any::<bool>(),
            wrong in prop::option::weighted(0.2, any::<prop::sample::Index>()),
        ) {
            let pool = HandlePool::<AccelStructHandle, Blas>::new(7);
            let handles: Vec<_> = (0..count).map(|_| pool.insert(blas())).collect();
            let resolve = |handle| {
                Ok(BlasRef::new(handle, ResourceId(0), BuildFlags::empty(), pool.get(handle)?))
            };
            let handle = |index: &prop::sample::Index| *index.get(&handles);
            let blas_refs = before.iter().map(handle);
            let previous = {
                let (nothing, mut seen_refs) = (BlasRefSet::default(), BitSet::default());
                let mut collector = BlasRefCollector::new(&nothing, &mut seen_refs, &resolve);
                blas_refs.clone().for_each(|handle| drop(collector.add(handle)));
                collector.finish().0
            };
            let list: Vec<_> = if same && !before.is_empty() { blas_refs.collect() } else { after.iter().map(handle).collect() };
            let mut instances: Vec<_> = list.into_iter().map(TlasInstance::new).collect();
            if let Some(index) = wrong {
                let place = index.index(instances.len());
                instances[place].custom_index = 1 << 24;
            }
            let room = || vec![0; instances.len() * INSTANCE_BYTES];
            let (mut ours, mut general, mut seen_refs) = (room(), room(), BitSet::default());
            let expected = write_addresses("t", &instances, &previous, &mut seen_refs, &resolve, &mut general);
            let is_known = matches!(expected, Ok(WrittenRefs::Unchanged));
            prop_assert_eq!(write_unchanged(&instances, &previous, &mut ours), is_known);
            prop_assert!(!is_known || ours == general);
        }
    }
}
