//! Buffers: downloads equal what was uploaded, copied, filled or written by shaders, and wrong use returns an error.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::ash::vk;
use lvk::{BufferCopy, BufferDesc, BufferUsage, Context, Dependencies, Error, Holder, MemoryKind};
use lvk_tests::compute::{compute_pipeline, read_words, words_buffer};
use lvk_tests::noise::noise;
use lvk_tests::{device, device_with};

const MEMORY: [MemoryKind; 3] = [MemoryKind::Device, MemoryKind::HostVisible, MemoryKind::Readback];

fn buffer(ctx: &Context, memory: MemoryKind, data: &[u8]) -> Holder<lvk::BufferHandle> {
    let desc = BufferDesc { memory, data: Some(data), debug_name: "under test", ..Default::default() };
    ctx.create_buffer(&desc).unwrap()
}

fn download(ctx: &Context, buffer: lvk::BufferHandle, offset: u64, size: usize) -> Vec<u8> {
    let mut bytes = vec![0; size];
    ctx.download_buffer(buffer, offset, &mut bytes).unwrap();
    bytes
}

#[test]
fn ranges_of_any_size_round_trip_in_every_memory() {
    let Some(ctx) = device() else { return };
    for memory in MEMORY {
        let mut expected = noise(1, 1003);
        let buffer = buffer(&ctx, memory, &expected);
        for (step, (offset, size)) in
            [(0, 1), (1002, 1), (3, 77), (40, 501), (998, 5)].into_iter().enumerate()
        {
            let bytes = noise(2 + step as u32, size);
            ctx.upload_buffer(*buffer, offset as u64, &bytes).unwrap();
            expected[offset..offset + size].copy_from_slice(&bytes);
            let around = offset.saturating_sub(3)..(offset + size + 3).min(expected.len());
            let found = download(&ctx, *buffer, around.start as u64, around.len());
            assert_eq!(found, expected[around], "{memory:?}, {size} bytes at {offset}");
        }
        assert_eq!(download(&ctx, *buffer, 0, 1003), expected, "{memory:?}");
        ctx.upload_buffer(*buffer, 1003, &[]).unwrap();
        ctx.download_buffer(*buffer, 1003, &mut []).unwrap();
    }
}

#[test]
fn uploads_larger_than_the_staging_memory_arrive_whole() {
    let Some(ctx) = device_with(|desc| desc.staging_bytes = 1) else { return };
    let expected = noise(1, (1 << 20) + 3);
    let large = buffer(&ctx, MemoryKind::Device, &expected);
    assert_eq!(download(&ctx, *large, 0, expected.len()), expected);
    for (part, bytes) in expected.chunks(10_000).enumerate().rev() {
        ctx.upload_buffer(*large, part as u64 * 10_000, bytes).unwrap();
    }
    assert_eq!(download(&ctx, *large, 0, expected.len()), expected);
}

#[test]
fn pages_that_are_used_again_under_commands_in_flight_keep_their_bytes() {
    let Some(ctx) = device_with(|desc| desc.staging_bytes = 1) else { return };
    const PART: usize = 9_999;
    let targets: Vec<_> = (0..40).map(|seed| buffer(&ctx, MemoryKind::Device, &noise(seed, PART))).collect();
    for (seed, target) in (100..).zip(&targets) {
        ctx.upload_buffer(**target, 0, &noise(seed, PART)).unwrap();
        ctx.submit(ctx.acquire_command_buffer().unwrap()).unwrap();
    }
    for (seed, target) in (100..).zip(&targets) {
        assert_eq!(download(&ctx, **target, 0, PART), noise(seed, PART), "upload {seed}");
    }
}

#[test]
fn the_last_of_overlapping_uploads_wins() {
    let Some(ctx) = device() else { return };
    let target = buffer(&ctx, MemoryKind::Device, &[0; 64]);
    ctx.upload_buffer(*target, 0, &[1; 48]).unwrap();
    ctx.upload_buffer(*target, 16, &[2; 48]).unwrap();
    ctx.upload_buffer(*target, 30, &[3; 4]).unwrap();
    let expected = [[1; 16].as_slice(), &[2; 14], &[3; 4], &[2; 30]].concat();
    assert_eq!(download(&ctx, *target, 0, 64), expected);
}

#[test]
fn uploads_keep_their_order_between_submissions() {
    let Some(ctx) = device() else { return };
    let source = buffer(&ctx, MemoryKind::Device, &[1; 256]);
    let [first, second] = [0, 0].map(|byte| buffer(&ctx, MemoryKind::Device, &[byte; 256]));
    for (value, target) in [(2, &first), (3, &second)] {
        ctx.upload_buffer(*source, 0, &[value; 256]).unwrap();
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.copy_buffer(*source, 0, **target, 0, 256).unwrap();
        ctx.submit(cmd).unwrap();
    }
    assert_eq!(download(&ctx, *first, 0, 256), [2; 256]);
    assert_eq!(download(&ctx, *second, 0, 256), [3; 256]);
}

#[test]
fn copies_and_fills_in_one_command_buffer_see_each_other() {
    let Some(ctx) = device() else { return };
    let bytes = noise(7, 300);
    let source = buffer(&ctx, MemoryKind::HostVisible, &bytes);
    for memory in MEMORY {
        let target = buffer(&ctx, memory, &[0; 300]);
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.fill_buffer(*target, 0, 300, 0xabab_abab).unwrap();
        cmd.copy_buffer(*source, 11, *target, 1, 99).unwrap();
        cmd.copy_buffer(*target, 1, *target, 150, 99).unwrap();
        cmd.fill_buffer(*target, 4, 8, 0x0403_0201).unwrap();
        cmd.fill_buffer(*target, 300, 0, 1).unwrap();
        ctx.submit(cmd).unwrap();
        let mut expected = vec![0xab; 300];
        expected[1..100].copy_from_slice(&bytes[11..110]);
        expected.copy_within(1..100, 150);
        expected[4..12].copy_from_slice(&[1, 2, 3, 4, 1, 2, 3, 4]);
        assert_eq!(download(&ctx, *target, 0, 300), expected, "{memory:?}");
    }
}

#[test]
fn shaders_follow_addresses_of_addresses() {
    let Some(ctx) = device() else { return };
    let rows: Vec<_> =
        (0..3_u32).map(|row| words_buffer(&ctx, &[row, 10 + row, 20 + row, 30 + row])).collect();
    let skipped = [0, 1, 2];
    let table: Vec<u64> =
        rows.iter().zip(skipped).map(|(row, words)| ctx.buffer_address(**row).unwrap() + 4 * words).collect();
    let table = buffer(&ctx, MemoryKind::HostVisible, bytemuck::cast_slice(&table));
    let result = words_buffer(&ctx, &[99; 6]);
    // Sums of addresses need numbers of 64 bits.
    let (word, next) = match ctx.capabilities().shader_int64 {
        true => ("uint value;", "(row + (i % 2)).value"),
        false => ("uint values[];", "row.values[i % 2]"),
    };
    let text = "layout(local_size_x = 6) in;
         layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Word { WORD };
         layout(buffer_reference, scalar) readonly buffer Table { Word rows[]; };
         layout(buffer_reference, scalar) writeonly buffer Result { uint values[]; };
         layout(push_constant, scalar) uniform Push { Table table; Result result; };
         void main() {
             uint i = gl_LocalInvocationIndex;
             Word row = table.rows[i / 2];
             result.values[i] = NEXT;
         }";
    let pipeline = compute_pipeline(&ctx, &text.replace("WORD", word).replace("NEXT", next));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.push_constants(&[*table, *result].map(|buffer| ctx.buffer_address(buffer).unwrap())).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*result], ..Default::default() }).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(read_words(&ctx, *result, 6), [0, 10, 11, 21, 22, 32]);
}

#[test]
fn addresses_differ_and_sizes_come_from_the_data() {
    let Some(ctx) = device() else { return };
    let [a, b] = [1, 2].map(|byte| buffer(&ctx, MemoryKind::Device, &[byte; 5]));
    let [a_address, b_address] = [&a, &b].map(|buffer| ctx.buffer_address(**buffer).unwrap());
    assert!(a_address.abs_diff(b_address) >= 5 && a_address != 0 && b_address != 0);
    let part = BufferDesc { size_bytes: 9, data: Some(&[7; 4]), ..Default::default() };
    let part = ctx.create_buffer(&part).unwrap();
    assert_eq!(download(&ctx, *part, 0, 4), [7; 4]);
    assert!(ctx.upload_buffer(*part, 9, &[0]).is_err());
    assert_eq!((a.index(), b.index()), (0, 0));
}

/// Small buffers share blocks of memory with each other, and with those that come in the place of others.
#[test]
fn small_buffers_that_come_and_go_keep_bytes_of_their_own() {
    const SIZES: [usize; 7] = [1, 255, 256, 257, 1_000, 5_000, 20_000];
    let Some(ctx) = device() else { return };
    let make = |number: u32| {
        let size = SIZES[number as usize % SIZES.len()];
        let bytes = noise(number, size);
        (buffer(&ctx, MEMORY[number as usize % MEMORY.len()], &bytes), bytes)
    };
    let mut buffers: Vec<_> = (0..400).map(make).collect();
    for round in 0..3_usize {
        let mut place = 0;
        buffers.retain(|_| {
            place += 1;
            !(place + round).is_multiple_of(3)
        });
        ctx.wait_idle().unwrap();
        let next = 1_000 * (round as u32 + 1);
        buffers.extend((next..next + 130).map(make));
    }
    let address = |buffer: &Holder<_>| ctx.buffer_address(**buffer).unwrap();
    let mut ranges: Vec<_> =
        buffers.iter().map(|(buffer, bytes)| (address(buffer), bytes.len() as u64)).collect();
    ranges.sort_unstable();
    for pair in ranges.windows(2) {
        let [(first, bytes), (second, _)] = pair else { continue };
        assert!(first + bytes <= *second, "{bytes} bytes at {first:#x} reach into those at {second:#x}");
    }
    for (buffer, bytes) in &buffers {
        assert_eq!(download(&ctx, **buffer, 0, bytes.len()), *bytes);
    }
}

#[test]
fn impossible_sizes_are_typed_errors() {
    let Some(ctx) = device() else { return };
    let sized = |size_bytes, data| {
        let desc = BufferDesc { size_bytes, data, debug_name: "odd one", ..Default::default() };
        ctx.create_buffer(&desc).map(drop).unwrap_err()
    };
    let names_object = |error: &Error| error.to_string().starts_with("odd one: ");
    for error in [sized(0, None), sized(0, Some(&[])), sized(3, Some(&[0; 4]))] {
        assert!(matches!(error, Error::InvalidUsage { .. }) && names_object(&error), "{error}");
    }
    let limit = ctx.capabilities().limits.max_buffer_bytes;
    let of_device = largest_buffer(&ctx);
    assert!((limit..limit + 4).contains(&of_device), "{limit} of {of_device}");
    // Buffers are made with a multiple of 4 bytes.
    assert!(limit.next_multiple_of(4) <= of_device, "{limit} of {of_device}");
    for size in [limit + 1, of_device.max(limit + 1), u64::MAX] {
        match sized(size, None) {
            Error::LimitExceeded { requested, limit: found, .. } => {
                assert_eq!((requested, found), (size, limit))
            }
            other => unreachable!("{other}"),
        }
    }
}

/// Returns the size of the largest buffer that the device allows, in bytes.
fn largest_buffer(ctx: &Context) -> u64 {
    let mut v13 = vk::PhysicalDeviceVulkan13Properties::default();
    let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut v13);
    // SAFETY: the physical device belongs to the instance and has Vulkan 1.3.
    unsafe { ctx.raw_instance().get_physical_device_properties2(ctx.raw_physical_device(), &mut all) };
    v13.max_buffer_size
}

#[test]
fn ranges_outside_of_a_buffer_are_errors() {
    let Some(ctx) = device() else { return };
    for memory in MEMORY {
        let small = buffer(&ctx, memory, &[5; 16]);
        let large = buffer(&ctx, memory, &[6; 64]);
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let refused = [
            ctx.upload_buffer(*small, 15, &[0; 2]),
            ctx.upload_buffer(*small, u64::MAX, &[0; 2]),
            ctx.download_buffer(*small, 17, &mut []),
            ctx.download_buffer(*small, 0, &mut [0; 17]),
            cmd.copy_buffer(*large, 0, *small, 0, 17),
            cmd.copy_buffer(*small, 8, *large, 0, 9),
            cmd.copy_buffer(*large, u64::MAX, *small, 0, 2),
            cmd.copy_buffer(*large, 0, *large, 8, 9),
            cmd.fill_buffer(*small, 8, 12, 0),
            cmd.fill_buffer(*small, 2, 4, 0),
            cmd.fill_buffer(*small, 0, 6, 0),
        ];
        for (index, result) in refused.into_iter().enumerate() {
            assert!(matches!(result, Err(Error::InvalidUsage { .. })), "{memory:?} {index}: {result:?}");
        }
        cmd.copy_buffer(*large, 0, *small, 0, 16).unwrap();
        ctx.submit(cmd).unwrap();
        assert_eq!(download(&ctx, *small, 0, 16), [6; 16]);
    }
}

#[test]
fn buffers_serve_only_what_their_usage_says() {
    let Some(ctx) = device() else { return };
    let plain = buffer(&ctx, MemoryKind::Device, &[0; 64]);
    let pipeline = compute_pipeline(&ctx, "layout(local_size_x = 1) in; void main() {}");
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    let error = cmd.dispatch_indirect(*plain, 0, &Dependencies::default()).unwrap_err();
    assert!(error.to_string().contains("INDIRECT"), "{error}");
    let desc = BufferDesc { size_bytes: 16, usage: BufferUsage::INDIRECT, ..Default::default() };
    let arguments = ctx.create_buffer(&desc).unwrap();
    for offset in [2, 8, u64::MAX - 3] {
        let result = cmd.dispatch_indirect(*arguments, offset, &Dependencies::default());
        assert!(matches!(result, Err(Error::InvalidUsage { .. })), "{offset}: {result:?}");
    }
}

#[test]
fn updates_of_any_size_and_copies_of_several_ranges_write_what_they_say() {
    let Some(ctx) = device() else { return };
    let make = || ctx.create_buffer(&BufferDesc { size_bytes: 200_000, ..Default::default() }).unwrap();
    let (first, second) = (make(), make());
    let mut expected = vec![0xEE_u8; 200_000];
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.fill_buffer(*first, 0, 200_000, 0xEEEE_EEEE).unwrap();
    cmd.fill_buffer(*second, 0, 200_000, 0).unwrap();
    for (seed, (offset, size)) in
        (0..).zip([(0, 4), (8, 65_536), (70_000, 65_540), (150_001, 3), (160_000, 7), (3, 0)])
    {
        let bytes: Vec<u8> = (0..size).map(|i| (i * 7 + seed) as u8).collect();
        expected[offset..offset + size].copy_from_slice(&bytes);
        cmd.update_buffer(*first, offset as u64, &bytes).unwrap();
    }
    let copy = |source_offset, target_offset, size| BufferCopy { source_offset, target_offset, size };
    cmd.copy_buffer_regions(*first, *second, &[copy(5, 100, 50), copy(0, 0, 10), copy(5, 10, 0)]).unwrap();
    let wrong = [
        cmd.update_buffer(*first, 199_998, &[0; 4]),
        cmd.update_buffer(*first, 200_000, &[0; 1]),
        cmd.copy_buffer_regions(*first, *second, &[copy(0, 0, 10), copy(20, 9, 10)]),
        cmd.copy_buffer_regions(*first, *first, &[copy(0, 10, 10), copy(15, 40, 10)]),
        cmd.copy_buffer_regions(*first, *second, &[copy(0, 0, 10), copy(199_999, 20, 2)]),
        cmd.copy_buffer_regions(*first, *second, &[copy(u64::MAX, 20, 2)]),
    ];
    for (index, result) in wrong.into_iter().enumerate() {
        assert!(matches!(result, Err(Error::InvalidUsage { .. })), "{index}: {result:?}");
    }
    ctx.submit(cmd).unwrap();
    let mut found = vec![0; 200_000];
    ctx.download_buffer(*first, 0, &mut found).unwrap();
    assert!(found == expected, "the updates");
    ctx.download_buffer(*second, 0, &mut found[..160]).unwrap();
    let copied = [&expected[..10], &[0; 90], &expected[5..55], &[0; 10]].concat();
    assert_eq!(found[..160], copied);
}

#[test]
fn mapped_buffers_are_written_and_read_without_copies() {
    let Some(ctx) = device() else { return };
    let make = |memory| {
        let desc = BufferDesc { memory, size_bytes: 10, debug_name: "in place", ..Default::default() };
        ctx.create_buffer(&desc).unwrap()
    };
    let (source, target) = (make(MemoryKind::HostVisible), make(MemoryKind::Readback));
    let bytes = ctx.map_buffer(*source).unwrap();
    assert_eq!(bytes.len(), 10);
    // SAFETY: the buffer is alive, and no command uses it yet.
    unsafe { bytes.cast::<[u8; 10]>().write([7, 6, 5, 4, 3, 2, 1, 0, 255, 254]) };
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.copy_buffer(*source, 0, *target, 0, 10).unwrap();
    ctx.wait(ctx.submit(cmd).unwrap()).unwrap();
    // SAFETY: the copy is done, and nothing else writes the buffer.
    let found = unsafe { ctx.map_buffer(*target).unwrap().cast::<[u8; 10]>().read() };
    assert_eq!(found, [7, 6, 5, 4, 3, 2, 1, 0, 255, 254]);
    let error = ctx.map_buffer(*make(MemoryKind::Device)).unwrap_err();
    assert!(matches!(&error, Error::InvalidUsage { object, .. } if object == "in place"), "{error}");
}

#[test]
fn addresses_inside_of_buffers_are_checked() {
    let Some(ctx) = device() else { return };
    let buffer = buffer(&ctx, MemoryKind::Device, &[0; 10]);
    let start = ctx.buffer_address(*buffer).unwrap();
    assert_eq!(ctx.buffer_address_at(*buffer, 0).unwrap(), start);
    assert_eq!(ctx.buffer_address_at(*buffer, 9).unwrap(), start + 9);
    for offset in [10, u64::MAX] {
        let error = ctx.buffer_address_at(*buffer, offset).unwrap_err();
        assert!(matches!(error, Error::InvalidUsage { .. }), "{error}");
    }
}

/// Beyond what 32 bits count.
#[test]
fn large_buffers_are_reached_to_their_ends() {
    const SIZE: u64 = (5 << 30) + 64;
    const FAR: u64 = (4 << 30) + 1000;
    let Some(ctx) = device() else { return };
    let desc = BufferDesc { size_bytes: SIZE, debug_name: "large", ..Default::default() };
    let large = match ctx.create_buffer(&desc) {
        Ok(large) => large,
        Err(error) => {
            assert!(
                matches!(error, Error::LimitExceeded { .. } | Error::OutOfDeviceMemory { .. }),
                "{error}"
            );
            assert!(error.to_string().contains("large"), "{error}");
            eprintln!("NOT TESTED, the device has no buffers of 5 GiB: {error}");
            return;
        }
    };
    let bytes = noise(9, 100);
    ctx.upload_buffer(*large, FAR, &bytes).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.fill_buffer(*large, SIZE - 32, 32, 0x0102_0304).unwrap();
    cmd.copy_buffer(*large, FAR, *large, 0, 100).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(download(&ctx, *large, FAR, 100), bytes);
    assert_eq!(download(&ctx, *large, 0, 100), bytes);
    assert_eq!(download(&ctx, *large, SIZE - 8, 8), [4, 3, 2, 1, 4, 3, 2, 1]);
    let word = u32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]);
    assert_eq!(read_by_address(&ctx, *large, FAR + 4), word);
}

/// A word of a buffer, as a shader finds it.
fn read_by_address(ctx: &Context, buffer: lvk::BufferHandle, offset: u64) -> u32 {
    let pipeline = compute_pipeline(
        ctx,
        "layout(local_size_x = 1) in;
         layout(buffer_reference, scalar) buffer Word { uint value; };
         layout(push_constant, scalar) uniform Push { Word source; Word target; };
         void main() { target.value = source.value; }",
    );
    let target = words_buffer(ctx, &[0]);
    let push = [ctx.buffer_address_at(buffer, offset).unwrap(), ctx.buffer_address(*target).unwrap()];
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.push_constants(&push).unwrap();
    let dependencies = Dependencies { read_buffers: &[buffer], buffers: &[*target], ..Default::default() };
    cmd.dispatch([1, 1, 1], &dependencies).unwrap();
    ctx.submit(cmd).unwrap();
    read_words(ctx, *target, 1)[0]
}

#[test]
fn more_memory_than_one_allocation_may_have_is_an_error() {
    let Some(ctx) = device() else { return };
    let limits = ctx.capabilities().limits;
    if limits.max_allocation_bytes >= limits.max_buffer_bytes {
        eprintln!("NOT TESTED, one allocation may be as large as the largest buffer");
        return;
    }
    let size_bytes = limits.max_allocation_bytes + 1;
    let error = ctx.create_buffer(&BufferDesc { size_bytes, ..Default::default() }).unwrap_err();
    assert!(matches!(error, Error::LimitExceeded { .. }), "{error}");
}
