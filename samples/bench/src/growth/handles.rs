//! Cost of a buffer beside many others.

use std::time::Instant;

use lvk::{BufferDesc, BufferHandle, Context, Holder};

use super::curve::{Curve, Expected, Unit};
use super::effort::Effort;
use super::group::{Group, GroupKey};
use super::live_objects::{create_and_destroy, empty_submission, scattered, submit_empty};
use crate::error::BenchError;
use crate::measure::elapsed_ms;
use crate::table::format_grouped;

/// Size of each buffer.
const BUFFER_BYTES: u64 = 256;
/// Lookups of one sample.
const LOOKUPS: usize = 100_000;
/// Handles that are looked up again and again.
const FEW: usize = 16;

pub(super) fn measure(ctx: &Context, effort: Effort) -> Result<Group, BenchError> {
    let sizes = GroupKey::Handles.sizes(effort.quick).to_vec();
    let mut curves = curves();
    let mut alive: Vec<Holder<BufferHandle>> = Vec::new();
    for &count in &sizes {
        let missing = count - alive.len() as u64;
        let start = Instant::now();
        for _ in 0..missing {
            alive.push(buffer(ctx)?);
        }
        let all = elapsed_ms(start) / missing as f64;
        submit_empty(ctx)?;
        let [created, destroyed] = create_and_destroy(ctx, effort, || buffer(ctx))?;
        let few: Vec<_> = (0..FEW).map(|number| *alive[number % alive.len()]).collect();
        let any: Vec<_> = scattered(LOOKUPS, alive.len()).into_iter().map(|index| *alive[index]).collect();
        let lookups = [look_up(ctx, effort, &few)?, look_up(ctx, effort, &any)?];
        let submitted = empty_submission(effort, || Ok(submit_empty(ctx)?))?;
        let blocks = lvk::test_hooks::memory_blocks(ctx).0 as f64;
        let costs = [all, created, destroyed, lookups[0], lookups[1], submitted, blocks];
        curves.iter_mut().zip(costs).for_each(|(curve, cost)| curve.push(count, cost));
    }
    let start = Instant::now();
    let count = alive.len();
    drop(alive);
    submit_empty(ctx)?;
    let each = elapsed_ms(start) * 1e6 / count as f64;
    let notes = vec![
        format!("all {} buffers destroyed at once: {each:.0} ns each", format_grouped(count as u64)),
        allocation_note(ctx)?,
    ];
    Ok(Group { key: GroupKey::Handles, sizes, curves, notes })
}

fn curves() -> Vec<Curve> {
    let constant = |name| Curve::new(name, Unit::Milliseconds, Expected::Constant);
    let first_touch = Expected::Grows("one sample: new objects and first touches of memory");
    let cache = Expected::Grows("cache misses of the CPU: the same handles stay as fast");
    vec![
        Curve::new("create all that are missing, each", Unit::Milliseconds, first_touch),
        constant("create one more"),
        constant("destroy one, with the submission that frees it"),
        constant("buffer_address of the same 16 handles, each"),
        Curve::new("buffer_address of handles at random, each", Unit::Milliseconds, cache),
        constant("empty submission and wait"),
        Curve::new("VkDeviceMemory objects", Unit::Count, Expected::Grows("one for up to 256 MiB")),
    ]
}

fn buffer(ctx: &Context) -> lvk::Result<Holder<BufferHandle>> {
    ctx.create_buffer(&BufferDesc { size_bytes: BUFFER_BYTES, ..BufferDesc::default() })
}

/// Returns the milliseconds of a lookup, of many in turn.
fn look_up(ctx: &Context, effort: Effort, handles: &[BufferHandle]) -> Result<f64, BenchError> {
    effort.median(|| {
        let mut sum = 0_u64;
        let start = Instant::now();
        for handle in handles.iter().cycle().take(LOOKUPS) {
            sum = sum.wrapping_add(ctx.buffer_address(*handle)?);
        }
        let taken = elapsed_ms(start);
        std::hint::black_box(sum);
        Ok(taken / LOOKUPS as f64)
    })
}

/// Says how many allocations the driver allows, which bounds buffers that have one each.
fn allocation_note(ctx: &Context) -> Result<String, BenchError> {
    // SAFETY: both belong to the context, which lives.
    let properties = unsafe { ctx.raw_instance().get_physical_device_properties(ctx.raw_physical_device()) };
    let most = format_grouped(u64::from(properties.limits.max_memory_allocation_count));
    Ok(format!(
        "maxMemoryAllocationCount is {most}: a driver allows so many VkDeviceMemory objects. Buffers share them, 64 small ones a \
         slab and many slabs an object, so that their number is bounded by memory instead"
    ))
}
