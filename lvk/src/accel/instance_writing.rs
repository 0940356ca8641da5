//! Writes lists of instances with the addresses of their BLAS, as Vulkan and the library's own builds read them.

use std::sync::Arc;

use super::blas_refs::{BitSet, BlasRef, BlasRefCollector, BlasRefSet, ResolveBlas};
use super::instance::{INSTANCE_BYTES, TlasInstance, check_instance, is_valid, to_raw};
use crate::error::Result;
#[cfg(feature = "software-ray-query")]
use crate::handle::AccelStructHandle;
use crate::parallel::{core_count, parallel_for};

/// Minimum number of instances for each thread. A thread converts 200 of them in a microsecond, and takes tens of
/// microseconds to start.
const INSTANCES_PER_THREAD: usize = 1 << 14;
/// Maximum number of threads. More do not write faster.
const MAX_THREADS: usize = 8;

/// True if the BLAS of the first instance can be written with its address alone. Then usually all of them can.
pub(crate) fn first_needs_only_address(instances: &[TlasInstance], resolve: ResolveBlas<'_>) -> Result<bool> {
    let Some(first) = instances.first() else { return Ok(true) };
    Ok(!resolve(first.blas)?.needs_kernel())
}

/// Result of writing instances with BLAS addresses.
pub(crate) enum WrittenRefs {
    /// The instances reference exactly the BLAS of the previous set.
    Unchanged,
    /// The instances reference another set of BLAS.
    Changed(Arc<BlasRefSet>),
    /// Some BLAS need more than an address; the written data is invalid.
    NeedsKernel,
}

/// Checks `instances` and writes them with BLAS addresses. Long lists are written by several threads. `previous` is
/// the BLAS set of the TLAS so far, or empty if that is no longer current.
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

/// Checks `instances` and writes them with the addresses that `resolve` returns for their BLAS. Long lists are written by several
/// threads.
#[cfg(feature = "software-ray-query")]
pub(crate) fn write_plain_addresses(
    name: &str,
    instances: &[TlasInstance],
    resolve: &(dyn Fn(AccelStructHandle) -> Result<u64> + Sync),
    out: &mut [u8],
) -> Result<()> {
    let write = |first: usize, instances: &[TlasInstance], out: &mut [u8]| {
        let mut last = None;
        for (index, (instance, out)) in instances.iter().zip(out.chunks_exact_mut(INSTANCE_BYTES)).enumerate()
        {
            check_instance(name, first + index, instance)?;
            let address = match last {
                Some((handle, address)) if handle == instance.blas => address,
                _ => resolve(instance.blas)?,
            };
            last = Some((instance.blas, address));
            out.copy_from_slice(bytemuck::bytes_of(&to_raw(instance, address)));
        }
        Ok(())
    };
    write_in_chunks(instances, thread_count(instances.len()), out, write).into_iter().collect()
}

/// As [`write_addresses`], for a few instances. Returns `false` unless all instances are valid and reference exactly
/// the BLAS of `previous`. The caller makes sure that these need no more than addresses. After `false` the written
/// data is invalid.
#[inline(never)]
pub(crate) fn write_unchanged(instances: &[TlasInstance], previous: &BlasRefSet, out: &mut [u8]) -> bool {
    // One bit for each BLAS of the set. A few instances cannot reference more BLAS than there are bits.
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
    let write = |first: usize, instances: &[TlasInstance], out: &mut [u8]| {
        let (previous, mut seen_refs) = (BlasRefSet::default(), BitSet::default());
        let mut collector = BlasRefCollector::new(&previous, &mut seen_refs, resolve);
        let plain = write_chunk(name, first, instances, &mut collector, out)?;
        Ok(plain.then(|| collector.into_new_refs()))
    };
    merge_refs(write_in_chunks(instances, threads, out, write).into_iter())
}

/// Writes a list in as many chunks as there are threads, each on one of them. `write` gets the number of a chunk's first instance.
/// Returns what it returns for each chunk, in order.
fn write_in_chunks<R: Send>(
    instances: &[TlasInstance],
    threads: usize,
    out: &mut [u8],
    write: impl Fn(usize, &[TlasInstance], &mut [u8]) -> R + Sync,
) -> Vec<R> {
    let count = instances.len().div_ceil(threads).max(1);
    let mut written: Vec<_> = instances.chunks(count).map(|_| None).collect();
    let chunks =
        instances.chunks(count).zip(out.chunks_mut(count * INSTANCE_BYTES)).zip(&mut written).enumerate();
    parallel_for(threads, chunks, |(chunk, ((instances, out), written))| {
        *written = Some(write(chunk * count, instances, out));
    });
    written.into_iter().flatten().collect()
}

/// Counting cores reads files on Linux, some 10 us. So it happens only if there is work for several threads.
#[inline]
fn thread_count(instances: usize) -> usize {
    let wanted = (instances / INSTANCES_PER_THREAD).min(MAX_THREADS);
    if wanted < 2 {
        return 1;
    }
    core_count().min(wanted)
}

/// Returns `false` if any BLAS needs more than an address.
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

/// Merges the BLAS references of all chunks without duplicates. Returns the first error if there is one.
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test")]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::accel::blas::{Blas, BlasStructures};
    use crate::accel::flags::BuildFlags;
    use crate::barrier::ResourceId;
    use crate::handle::AccelStructHandle;
    use crate::pool::HandlePool;

    /// Lists that several threads write have the bytes of single instances, and errors name the instance in the whole list.
    #[cfg(feature = "software-ray-query")]
    #[test]
    fn long_lists_are_written_as_single_instances() {
        use crate::error::Error;
        use crate::handle::Handle;

        let handles = [1, 2, 3].map(AccelStructHandle::from_bits);
        let place = |handle| handles.iter().position(|own| *own == handle).unwrap() as u64;
        let address = |handle: AccelStructHandle| Ok(0x1000 * (place(handle) + 1));
        for count in [0, 1, 2 * INSTANCES_PER_THREAD - 1, 3 * INSTANCES_PER_THREAD + 5] {
            let mut instances: Vec<_> = (0..count)
                .map(|number| TlasInstance {
                    custom_index: number as u32,
                    ..TlasInstance::new(handles[number / 7 % 3])
                })
                .collect();
            let mut out = vec![0; count * INSTANCE_BYTES];
            write_plain_addresses("t", &instances, &address, &mut out).unwrap();
            for (instance, out) in instances.iter().zip(out.chunks_exact(INSTANCE_BYTES)) {
                let raw = to_raw(instance, address(instance.blas).unwrap());
                assert_eq!(out, bytemuck::bytes_of(&raw));
            }
            let Some(last) = instances.last_mut() else { continue };
            last.custom_index = 1 << 24;
            let error = write_plain_addresses("t", &instances, &address, &mut out).unwrap_err().to_string();
            assert!(error.contains(&format!("instance {}:", count - 1)), "{error}");
        }
        let lost = |_| Err(Error::usage("b", "it is gone"));
        let mut out = [0; INSTANCE_BYTES];
        let error = write_plain_addresses("t", &[TlasInstance::new(handles[0])], &lost, &mut out);
        assert!(matches!(error, Err(Error::InvalidUsage { .. })));
    }

    fn blas() -> Blas {
        let body = BlasStructures { structures: Vec::new(), compacted_from: None, rebuildable: true };
        Blas::new(Vec::new(), None, Vec::new(), body, None)
    }

    proptest! {
        /// Compares the fast path with the general one, with the BLAS set of any earlier list.
        #[test]
        fn a_few_instances_are_written_alike_only_if_they_show_what_is_known(
            count in 1..20_usize,
            before in prop::collection::vec(any::<prop::sample::Index>(), 0..20),
            after in prop::collection::vec(any::<prop::sample::Index>(), 1..17),
            same in any::<bool>(),
            wrong in prop::option::weighted(0.2, any::<prop::sample::Index>()),
        ) {
            let pool = HandlePool::<AccelStructHandle, Blas>::new(7, |_| "");
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
