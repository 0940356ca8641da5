//! What is counted at a sample: the library's own counts, and those of the process.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use lvk::test_hooks::{descriptor_slots, graphics_part_count, memory_blocks, staging_bytes, waiting_objects};
use lvk::{Context, Result};
use lvk_tests::process::{file_descriptor_count, heap_bytes, resident_bytes, thread_names};

use super::flat::{Quantity, Rule};

/// Longest wait for the threads of finished background work to end.
const THREADS_END: Duration = Duration::from_secs(5);

/// Counts everything, with the GPU idle. `memory` is the rule for the memory of the process.
pub fn sample(ctx: &Context, memory: Rule) -> Result<Vec<Quantity>> {
    ctx.wait_idle()?;
    let mut all = library(ctx)?;
    let process = [
        ("process: file descriptors", Rule::Exact, file_descriptor_count()),
        ("process: threads", Rule::Exact, settled_thread_count()),
        ("process: resident bytes", memory, resident_bytes()),
        ("process: bytes of the C heap", memory, heap_bytes()),
    ];
    // A count that the system does not have is no quantity.
    let known = |(name, rule, value): (&str, Rule, Option<i64>)| Some((name.to_owned(), rule, value?));
    all.extend(process.into_iter().filter_map(known));
    Ok(all)
}

/// Counts of the library.
fn library(ctx: &Context) -> Result<Vec<Quantity>> {
    let waiting = waiting_objects(ctx)?;
    let mut live: BTreeMap<&str, i64> = BTreeMap::new();
    for object in ctx.live_objects() {
        *live.entry(object.kind).or_default() += 1;
    }
    let mut all: Vec<_> = live.into_iter().map(|(kind, count)| (format!("live: {kind}"), count)).collect();
    let heaps = ctx.memory_budget().heaps;
    let heaps = heaps.iter().enumerate();
    all.extend(heaps.map(|(heap, it)| (format!("bytes: objects in heap {heap}"), it.object_bytes as i64)));
    let [textures, samplers, tlas, yuv] = descriptor_slots(ctx);
    let (blocks, block_bytes) = memory_blocks(ctx);
    let accel = ctx.accel_memory();
    let counts = [
        ("slots: textures", textures),
        ("slots: samplers", samplers),
        ("slots: TLAS", tlas),
        ("slots: Y'CbCr textures", yuv),
        ("objects that wait for the GPU", waiting),
        ("parts of graphics pipelines", graphics_part_count(ctx)),
        ("VkDeviceMemory of the allocator", blocks),
        ("bytes: VkDeviceMemory of the allocator", block_bytes as usize),
        ("bytes: staging", staging_bytes(ctx) as usize),
        ("bytes: acceleration structures", accel.structure_bytes as usize),
        ("bytes: free for acceleration structures", accel.free_bytes as usize),
        ("bytes: scratch", accel.scratch_bytes as usize),
    ];
    all.extend(counts.map(|(name, count)| (name.to_owned(), count as i64)));
    Ok(all.into_iter().map(|(name, count)| (name, Rule::Exact, count)).collect())
}

/// Returns the number of threads, once those of the library's background work have ended.
fn settled_thread_count() -> Option<i64> {
    let start = Instant::now();
    loop {
        let names = thread_names()?;
        let is_settled = names.iter().all(|name| !name.starts_with("lvk background"));
        if is_settled || start.elapsed() > THREADS_END {
            return Some(names.len() as i64);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}
