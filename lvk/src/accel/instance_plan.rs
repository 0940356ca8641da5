//! From the caller's instances to the records Vulkan reads.

use std::sync::Arc;

use super::blas_refs::{Find, Gather, Marks, Shown, ShownSet};
use super::instance::{INSTANCE_BYTES, TlasInstance, check, is_right, pack};
use crate::error::{Result, check_limit};
use crate::parallel::{cores, share_out};

/// A thread gets at least so many instances: one converts 200 of them in a microsecond, and takes tens of microseconds to
/// start.
const INSTANCES_PER_THREAD: usize = 1 << 17;
/// More threads than this do not write faster.
const MOST_THREADS: usize = 8;

/// Whether the first structure referred to needs no more than an address, as then mostly all do.
pub(crate) fn starts_plain(instances: &[TlasInstance], find: Find<'_>) -> Result<bool> {
    let Some(first) = instances.first() else { return Ok(true) };
    Ok(!Shown::new(first.blas, find(first.blas)?)?.needs_kernel())
}

/// What instances refer to that were written with addresses.
pub(crate) enum Addresses {
    /// What was known, all of it.
    OfKnown,
    /// Something else.
    OfOthers(Arc<ShownSet>),
    /// Some need more than an address; what was written means nothing.
    Insufficient,
}

/// Checks `instances` and writes them with addresses, on several threads where there are many. `known` is what was shown
/// before, if that still stands.
#[inline]
pub(crate) fn write_addresses(
    name: &str,
    instances: &[TlasInstance],
    known: &ShownSet,
    marks: &mut Marks,
    find: Find<'_>,
    out: &mut [u8],
) -> Result<Addresses> {
    let threads = thread_count(instances.len());
    if threads > 1 {
        let shown = write_chunks(name, instances, threads, find, out)?;
        let other = |shown| Addresses::OfOthers(Arc::new(ShownSet::new(shown)));
        return Ok(shown.map_or(Addresses::Insufficient, other));
    }
    let mut gather = Gather::new(known, marks, find);
    if !write_chunk(name, 0, instances, &mut gather, out)? {
        return Ok(Addresses::Insufficient);
    }
    if gather.is_unchanged() {
        return Ok(Addresses::OfKnown);
    }
    Ok(Addresses::OfOthers(Arc::new(gather.finish().0)))
}

/// As [`write_addresses`], of a few instances. Answers `false` unless they are as they should, and refer to all that is known,
/// which needs no more than addresses, and to nothing else; then what was written means nothing.
#[inline(never)]
pub(crate) fn write_alike(instances: &[TlasInstance], known: &ShownSet, out: &mut [u8]) -> bool {
    // A bit for each structure that is known. More than there are bits are never all met by a few.
    let mut unmet = match known.list().len() {
        count @ 1..=64 => u64::MAX >> (64 - count),
        _ => return false,
    };
    for (instance, out) in instances.iter().zip(out.chunks_exact_mut(INSTANCE_BYTES)) {
        let Some((place, address)) = known.address(instance.blas).filter(|_| is_right(instance)) else {
            return false;
        };
        unmet &= !(1 << place);
        out.copy_from_slice(bytemuck::bytes_of(&pack(instance, address)));
    }
    unmet == 0
}

fn write_chunks(
    name: &str,
    instances: &[TlasInstance],
    threads: usize,
    find: Find<'_>,
    out: &mut [u8],
) -> Result<Option<Vec<Shown>>> {
    let count = instances.len().div_ceil(threads).max(1);
    let write = move |index: usize, instances: &[TlasInstance], out: &mut [u8]| {
        let (known, mut marks) = (ShownSet::default(), Marks::default());
        let mut gather = Gather::new(&known, &mut marks, find);
        let plain = write_chunk(name, index * count, instances, &mut gather, out)?;
        Ok(plain.then(|| gather.into_new()))
    };
    let mut all: Vec<_> = instances.chunks(count).map(|_| None).collect();
    let chunks =
        instances.chunks(count).zip(out.chunks_mut(count * INSTANCE_BYTES)).zip(&mut all).enumerate();
    share_out(threads, chunks, |(index, ((instances, out), written))| {
        *written = Some(write(index, instances, out));
    });
    merge(all.into_iter().flatten())
}

/// Counting cores reads files on Linux, some 10 us: only where there is work for several.
#[inline]
fn thread_count(instances: usize) -> usize {
    let wanted = (instances / INSTANCES_PER_THREAD).min(MOST_THREADS);
    if wanted < 2 {
        return 1;
    }
    cores().min(wanted)
}

/// Answers `false` where some need more than an address.
#[inline]
fn write_chunk(
    name: &str,
    first: usize,
    instances: &[TlasInstance],
    gather: &mut Gather<'_>,
    out: &mut [u8],
) -> Result<bool> {
    let mut last = None;
    for (index, (instance, out)) in instances.iter().zip(out.chunks_exact_mut(INSTANCE_BYTES)).enumerate() {
        let address = match last {
            Some((handle, address)) if handle == instance.blas => address,
            _ => {
                let address = gather.address(instance.blas)?;
                if gather.needs_kernel {
                    return Ok(false);
                }
                address
            }
        };
        last = Some((instance.blas, address));
        check(name, first + index, instance)?;
        let raw = pack(instance, address);
        out.copy_from_slice(bytemuck::bytes_of(&raw));
    }
    Ok(true)
}

/// What all chunks show, each structure once; the first error where there is one.
fn merge(chunks: impl Iterator<Item = Result<Option<Vec<Shown>>>>) -> Result<Option<Vec<Shown>>> {
    let mut all: Vec<Shown> = Vec::new();
    let mut seen = std::collections::HashSet::new();
    let mut needs_kernel = false;
    for chunk in chunks {
        match chunk? {
            None => needs_kernel = true,
            Some(shown) => all.extend(shown.into_iter().filter(|shown| seen.insert(shown.blas.id.0))),
        }
    }
    Ok((!needs_kernel).then_some(all))
}

/// Memory for plans, used again.
#[derive(Default)]
pub(crate) struct PlanMemory {
    pub(crate) marks: Marks,
    /// The place of what each instance refers to.
    pub(crate) refers: Vec<u32>,
}

/// What a list of instances refers to, and how many Vulkan is given.
pub(crate) struct InstancePlan {
    pub(crate) shown: Arc<ShownSet>,
    /// For each instance its place in `shown`.
    refers: Vec<u32>,
    /// Instances with those for further parts of split meshes.
    pub(crate) built_count: u32,
}

impl InstancePlan {
    /// Finds the structures of `instances`, which are to be shown by the structure `name`. `known` is what was shown
    /// before, if that still stands.
    pub(crate) fn new(
        name: &str,
        instances: &[TlasInstance],
        known: &Arc<ShownSet>,
        memory: &mut PlanMemory,
        find: Find<'_>,
    ) -> Result<Self> {
        let mut refers = std::mem::take(&mut memory.refers);
        let mut gather = Gather::new(known, &mut memory.marks, find);
        refers.clear();
        refers.reserve(instances.len());
        let mut last = None;
        for instance in instances {
            let place = match last {
                Some((handle, place)) if handle == instance.blas => place,
                _ => gather.place(instance.blas)? as u32,
            };
            last = Some((instance.blas, place));
            refers.push(place);
        }
        let shown = if gather.is_unchanged() {
            Arc::clone(known)
        } else {
            let (shown, moved) = gather.finish();
            refers.iter_mut().for_each(|place| *place = moved[*place as usize]);
            Arc::new(shown)
        };
        let spans = shown.spans();
        let built: u64 = if spans.iter().all(|[_, parts]| *parts == 1) {
            refers.len() as u64
        } else {
            refers.iter().map(|place| u64::from(spans[*place as usize][1])).sum()
        };
        check_limit(name, "number of instances, parts of split meshes included", built, u32::MAX.into())?;
        Ok(Self { shown, refers, built_count: built as u32 })
    }

    /// The memory of the plan, to be used again.
    pub(crate) fn into_refers(self) -> Vec<u32> {
        self.refers
    }

    /// Of the instances behind the caller's: whose further parts they are, and which.
    fn further(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let owners = (0..).zip(&self.refers);
        owners.flat_map(|(owner, place)| {
            let [first, parts] = self.shown.spans()[*place as usize];
            (1..parts).map(move |part| (owner, first + part))
        })
    }

    /// How many instances stand behind the caller's.
    pub(crate) fn further_count(&self) -> u32 {
        self.built_count.saturating_sub(self.refers.len() as u32)
    }

    /// Writes whose further parts the instances behind the caller's are.
    pub(crate) fn write_owners(&self, out: &mut [u8]) {
        for ((owner, _), out) in self.further().zip(out.chunks_exact_mut(size_of::<u32>())) {
            out.copy_from_slice(bytemuck::bytes_of(&owner));
        }
    }

    /// Checks the instances and writes them with numbers of [parts](ShownSet::parts), those of further parts behind the
    /// caller's.
    pub(crate) fn write_numbers(&self, name: &str, instances: &[TlasInstance], out: &mut [u8]) -> Result<()> {
        let (own, further) = out.split_at_mut(instances.len() * INSTANCE_BYTES);
        let spans = self.shown.spans();
        let records = instances.iter().zip(&self.refers).zip(own.chunks_exact_mut(INSTANCE_BYTES));
        for (index, ((instance, place), out)) in records.enumerate() {
            check(name, index, instance)?;
            let [first, _] = spans[*place as usize];
            out.copy_from_slice(bytemuck::bytes_of(&pack(instance, first.into())));
        }
        if self.further_count() == 0 {
            return Ok(());
        }
        for ((owner, part), out) in self.further().zip(further.chunks_exact_mut(INSTANCE_BYTES)) {
            let raw = pack(&instances[owner as usize], part.into());
            out.copy_from_slice(bytemuck::bytes_of(&raw));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::accel::accel_struct::{AccelKind, AccelStruct};
    use crate::accel::blas::{Blas, BlasBody};
    use crate::accel::flags::{AccelStructSizes, BuildFlags};
    use crate::handle::AccelStructHandle;
    use crate::store::Pool;

    fn blas() -> AccelStruct {
        let body = BlasBody { structures: Vec::new(), compacted_from: None, rebuildable: true };
        let blas = Blas::new(Vec::new(), None, Vec::new(), body, None);
        AccelStruct::new("mesh", BuildFlags::empty(), AccelStructSizes::default(), AccelKind::Blas(blas))
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
            let pool = Pool::<AccelStructHandle, AccelStruct>::new(7);
            let handles: Vec<_> = (0..count).map(|_| pool.insert(blas())).collect();
            let find = |handle| pool.get(handle);
            let handle = |index: &prop::sample::Index| *index.get(&handles);
            let shown = before.iter().map(handle);
            let known = {
                let (nothing, mut marks) = (ShownSet::default(), Marks::default());
                let mut gather = Gather::new(&nothing, &mut marks, &find);
                shown.clone().for_each(|handle| drop(gather.place(handle)));
                gather.finish().0
            };
            let list: Vec<_> = if same && !before.is_empty() { shown.collect() } else { after.iter().map(handle).collect() };
            let mut instances: Vec<_> = list.into_iter().map(TlasInstance::new).collect();
            if let Some(index) = wrong {
                let place = index.index(instances.len());
                instances[place].custom_index = 1 << 24;
            }
            let room = || vec![0; instances.len() * INSTANCE_BYTES];
            let (mut ours, mut general, mut marks) = (room(), room(), Marks::default());
            let expected = write_addresses("t", &instances, &known, &mut marks, &find, &mut general);
            let is_known = matches!(expected, Ok(Addresses::OfKnown));
            prop_assert_eq!(write_alike(&instances, &known, &mut ours), is_known);
            prop_assert!(!is_known || ours == general);
        }
    }
}
