//! From the caller's instances to the records Vulkan reads.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;
use std::sync::Arc;

use super::instance::{INSTANCE_BYTES, TlasInstance, check, pack};
use super::structure::AccelStruct;
use super::tlas::{Entry, Shown};
use crate::barrier::IdHasher;
use crate::error::{Error, Result, check_limit};
use crate::handle::AccelStructHandle;

/// Finds the structure of a handle.
pub(crate) type Find<'a> = &'a (dyn Fn(AccelStructHandle) -> Result<Arc<AccelStruct>> + Sync);

/// A thread gets at least so many instances: one converts 200 of them in a microsecond, and takes tens of microseconds to
/// start.
const INSTANCES_PER_THREAD: usize = 1 << 17;
/// More threads than this do not write faster.
const MOST_THREADS: usize = 8;

/// Structures that were referred to, each once.
#[derive(Default)]
struct Known {
    places: HashMap<AccelStructHandle, u32, BuildHasherDefault<IdHasher>>,
    last: Option<(AccelStructHandle, u32)>,
    shown: Vec<Shown>,
    /// What instances refer to, where they refer to an address.
    addresses: Vec<u64>,
    /// Whether an address does not do for some: it has parts, maps, or may move.
    needs_kernel: bool,
}

impl Known {
    /// The place of a structure among those shown.
    fn place(&mut self, handle: AccelStructHandle, find: Find<'_>) -> Result<u32> {
        if let Some((last, place)) = self.last
            && last == handle
        {
            return Ok(place);
        }
        let place = match self.places.get(&handle) {
            Some(place) => *place,
            None => self.add(handle, find(handle)?)?,
        };
        self.last = Some((handle, place));
        Ok(place)
    }

    fn add(&mut self, handle: AccelStructHandle, blas: Arc<AccelStruct>) -> Result<u32> {
        let body = blas.blas()?.body();
        let place = self.shown.len() as u32;
        let shown = Shown { blas, body };
        self.needs_kernel |= shown.needs_kernel();
        self.addresses.push(shown.body.structures.first().map_or(0, |structure| structure.address));
        self.shown.push(shown);
        self.places.insert(handle, place);
        Ok(place)
    }
}

/// Whether the first structure referred to needs no more than an address, as then mostly all do.
pub(crate) fn starts_plain(instances: &[TlasInstance], find: Find<'_>) -> Result<bool> {
    let Some(first) = instances.first() else { return Ok(true) };
    let blas = find(first.blas)?;
    let body = blas.blas()?.body();
    Ok(!Shown { blas, body }.needs_kernel())
}

/// Checks `instances` and writes them with addresses, on several threads where there are many. Answers the structures
/// they refer to, or nothing where some need more than an address; then what was written means nothing.
pub(crate) fn write_addresses(
    name: &str,
    instances: &[TlasInstance],
    find: Find<'_>,
    out: &mut [u8],
) -> Result<Option<Vec<Shown>>> {
    let threads = thread_count(instances.len());
    if threads == 1 {
        return write_chunk(name, 0, instances, find, out);
    }
    let count = instances.len().div_ceil(threads).max(1);
    std::thread::scope(|scope| {
        let mut chunks = instances.chunks(count).zip(out.chunks_mut(count * INSTANCE_BYTES)).enumerate();
        let own = chunks.next();
        let workers: Vec<_> = chunks
            .map(|(index, (instances, out))| {
                scope.spawn(move || write_chunk(name, index * count, instances, find, out))
            })
            .collect();
        let mut all = Vec::new();
        if let Some((index, (instances, out))) = own {
            all.push(write_chunk(name, index * count, instances, find, out));
        }
        let lost = |_| Err(Error::usage(name, "a thread that converted instances ended early"));
        all.extend(workers.into_iter().map(|worker| worker.join().unwrap_or_else(lost)));
        merge(all)
    })
}

/// Counting cores reads files on Linux, some 10 us: only where there is work for several.
fn thread_count(instances: usize) -> usize {
    let wanted = (instances / INSTANCES_PER_THREAD).min(MOST_THREADS);
    if wanted < 2 {
        return 1;
    }
    std::thread::available_parallelism().map_or(1, usize::from).min(wanted)
}

fn write_chunk(
    name: &str,
    first: usize,
    instances: &[TlasInstance],
    find: Find<'_>,
    out: &mut [u8],
) -> Result<Option<Vec<Shown>>> {
    let mut known = Known::default();
    for (index, (instance, out)) in instances.iter().zip(out.chunks_exact_mut(INSTANCE_BYTES)).enumerate() {
        let place = known.place(instance.blas, find)?;
        if known.needs_kernel {
            return Ok(None);
        }
        check(name, first + index, instance)?;
        let raw = pack(instance, known.addresses[place as usize]);
        out.copy_from_slice(bytemuck::bytes_of(&raw));
    }
    Ok(Some(known.shown))
}

/// What all chunks show, each structure once; the first error where there is one.
fn merge(chunks: Vec<Result<Option<Vec<Shown>>>>) -> Result<Option<Vec<Shown>>> {
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

/// What a list of instances refers to, and how many Vulkan is given.
pub(crate) struct InstancePlan {
    /// Each structure once.
    pub(crate) shown: Vec<Shown>,
    /// For each instance its place in `shown`.
    refers: Vec<u32>,
    /// Instances with those for further parts of split meshes.
    pub(crate) built_count: u32,
}

/// Instances that name entries, see [`InstanceSource`](super::tlas::InstanceSource).
pub(crate) struct EntryList {
    /// One for each part of each structure.
    pub(crate) entries: Vec<Entry>,
    /// Of the instances behind the caller's: whose further parts they are.
    pub(crate) owners: Vec<u32>,
    /// Of the same: the entry.
    further: Vec<u32>,
    /// First entry of each structure.
    firsts: Vec<u32>,
}

impl InstancePlan {
    /// Finds the structures of `instances`, which are to be shown by the structure `name`.
    pub(crate) fn new(name: &str, instances: &[TlasInstance], find: Find<'_>) -> Result<Self> {
        let mut known = Known::default();
        let places = instances.iter().map(|instance| known.place(instance.blas, find));
        let refers = places.collect::<Result<Vec<_>>>()?;
        let shown = known.shown;
        let parts: Vec<u64> = shown.iter().map(|shown| shown.body.structures.len() as u64).collect();
        let built: u64 = if parts.iter().all(|count| *count == 1) {
            refers.len() as u64
        } else {
            refers.iter().map(|place| parts[*place as usize]).sum()
        };
        check_limit(name, "number of instances, parts of split meshes included", built, u32::MAX.into())?;
        Ok(Self { shown, refers, built_count: built as u32 })
    }

    /// Numbers the parts of everything shown, and the instances behind the caller's own.
    pub(crate) fn entries(&self) -> EntryList {
        let mut list =
            EntryList { entries: Vec::new(), owners: Vec::new(), further: Vec::new(), firsts: Vec::new() };
        for (shown, of) in (0..).zip(&self.shown) {
            list.firsts.push(list.entries.len() as u32);
            let parts = 0..of.body.structures.len() as u32;
            list.entries.extend(parts.map(|first| Entry { shown, first, count: 1 }));
        }
        for (owner, place) in (0..).zip(&self.refers) {
            let first = list.firsts[*place as usize];
            let parts = self.shown[*place as usize].body.structures.len() as u32;
            for part in 1..parts {
                list.owners.push(owner);
                list.further.push(first + part);
            }
        }
        list
    }

    /// Checks the instances and writes them with entry numbers, those of further parts behind the caller's.
    pub(crate) fn write_entries(
        &self,
        name: &str,
        instances: &[TlasInstance],
        list: &EntryList,
        out: &mut [u8],
    ) -> Result<()> {
        let firsts: Vec<u64> = list.firsts.iter().map(|first| u64::from(*first)).collect();
        let (own, further) = out.split_at_mut(instances.len() * INSTANCE_BYTES);
        let records = instances.iter().zip(&self.refers).zip(own.chunks_exact_mut(INSTANCE_BYTES));
        for (index, ((instance, place), out)) in records.enumerate() {
            check(name, index, instance)?;
            let raw = pack(instance, firsts[*place as usize]);
            out.copy_from_slice(bytemuck::bytes_of(&raw));
        }
        let places = list.owners.iter().zip(&list.further);
        for ((owner, entry), out) in places.zip(further.chunks_exact_mut(INSTANCE_BYTES)) {
            let raw = pack(&instances[*owner as usize], u64::from(*entry));
            out.copy_from_slice(bytemuck::bytes_of(&raw));
        }
        Ok(())
    }
}
