//! What is counted at a sample: the library's own counts, and those of the process.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use lvk::test_hooks::{descriptor_slots, graphics_part_count, memory_blocks, staging_bytes, waiting_objects};
use lvk::{Context, Result};
use lvk_tests::process::{file_descriptor_count, heap_bytes, resident_bytes, thread_names};

use super::HEAP;
use super::flat::{Quantity, Rule};

/// Longest wait for the threads of finished background work to end.
const THREADS_END: Duration = Duration::from_secs(5);

/// Most bytes of Rust's heap from third to third: lists keep the capacity that they once needed, for a few kilobytes in all.
const RUST_HEAP_RISE: i64 = 16 << 10;

/// Most that the C heap grows from the middle third to the last one, in thousandths.
const C_HEAP_SLOPE: i64 = 20;

/// Counts everything, with the GPU idle. With `validation`, whose layer keeps memory of its own, the memory of the process is only reported.
/// `resident_slope`: as [`C_HEAP_SLOPE`], of resident memory.
pub fn sample(ctx: &Context, validation: bool, resident_slope: i64) -> Result<Vec<Quantity>> {
    ctx.wait_idle()?;
    let slope = |most| if validation { Rule::Reported } else { Rule::Slope(most) };
    let threads = settled_threads();
    // Before the sample itself takes any.
    let rust_heap = HEAP.current_usage();
    let mut all = library(ctx)?;
    let process = [
        ("process: file descriptors", Rule::Exact, file_descriptor_count()),
        ("process: bytes of Rust's heap", Rule::Rise(RUST_HEAP_RISE), i64::try_from(rust_heap).ok()),
        ("process: resident bytes", slope(resident_slope), resident_bytes()),
        ("process: bytes of the C heap", slope(C_HEAP_SLOPE), heap_bytes()),
    ];
    // A count that the system does not have is no quantity.
    let known = |(name, rule, value): (&str, Rule, Option<i64>)| Some((name.to_owned(), rule, value?));
    all.extend(process.into_iter().filter_map(known));
    all.extend(threads.into_iter().map(|(name, count)| (format!("threads: {name}"), Rule::Rise(0), count)));
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

/// Returns the number of threads by name, once those of the library's background work have ended; none where the system tells no names.
/// Drivers may start some late, as Mesa does for its cache of shaders, `disk$1` to `disk$3`, when the first falls behind.
fn settled_threads() -> BTreeMap<String, i64> {
    let start = Instant::now();
    loop {
        let names = thread_names().unwrap_or_default();
        let is_settled = names.iter().all(|name| !name.starts_with("lvk background"));
        if is_settled || start.elapsed() > THREADS_END {
            let mut counts = BTreeMap::new();
            names.into_iter().for_each(|name| *counts.entry(name).or_default() += 1);
            return counts;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}
