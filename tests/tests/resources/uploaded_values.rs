//! `CommandBuffer::upload`: values that shaders read by address, for the time of one command buffer.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::test_hooks::{set_out_of_memory, staging_bytes, with_fault_injection};
use lvk::{
    BufferHandle, ColorAttachment, CommandBuffer, ComputePipelineHandle, Context, Dependencies, Error,
    Format, Holder, Queue, RenderPassDesc, RenderPipelineDesc, TextureDesc, TextureRegion, TextureUsage,
};
use lvk_tests::compute::{compute_pipeline, read_words, words_buffer};
use lvk_tests::queues::{REQUESTS, submit_on};
use lvk_tests::random::Random;
use lvk_tests::raster::{self, render_pipeline};
use lvk_tests::{device, device_with};

/// Copies words from one address to another.
struct Copier(Holder<ComputePipelineHandle>);

impl Copier {
    fn new(ctx: &Context) -> Self {
        Self(compute_pipeline(
            ctx,
            "layout(local_size_x = 1) in;
             layout(buffer_reference, scalar) buffer Words { uint at[]; };
             layout(push_constant, scalar) uniform Push { Words source; Words target; uvec2 range; };
             void main() {
                 for (uint i = 0; i < range.y; ++i) target.at[range.x + i] = source.at[i];
             }",
        ))
    }

    /// Records the copy of `count` words from an address to the words of a buffer from `first` on.
    fn record(
        &self,
        cmd: &mut CommandBuffer,
        source: u64,
        target: &Holder<BufferHandle>,
        [first, count]: [u32; 2],
    ) {
        let range = u64::from(first) | u64::from(count) << 32;
        cmd.bind_compute_pipeline(*self.0).unwrap();
        cmd.push_constants(&[source, target.address().unwrap(), range]).unwrap();
        cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[**target], ..Default::default() }).unwrap();
    }
}

/// Frames that are submitted without a wait on any queue: each reads its own values, and the memory does not grow. How
/// much of it is used at once depends on how far the device lags behind; all frames together upload four times the bound.
#[test]
fn each_frame_in_flight_reads_its_own_values_and_memory_does_not_grow() {
    const FRAMES: u32 = 300;
    const STAGING_BYTES: u64 = 1 << 20;
    for queues in REQUESTS {
        let Some(ctx) = device_with(|desc| (desc.queues, desc.staging_bytes) = (queues, STAGING_BYTES))
        else {
            return;
        };
        let (copier, target) = (Copier::new(&ctx), words_buffer(&ctx, &[0; 3 * FRAMES as usize]));
        let run = |frames: u32| {
            let mut sizes = Vec::new();
            for frame in 0..frames {
                ctx.next_frame().unwrap();
                for (queue, part) in [Queue::Graphics, Queue::Compute].into_iter().zip(0..) {
                    submit_on(&ctx, queue, |cmd| {
                        cmd.upload_slice(&[0_u32; 800]).unwrap();
                        let source = cmd.upload(&[frame, 1_000 + part]).unwrap();
                        copier.record(cmd, source, &target, [3 * frame + part, 2]);
                    });
                }
                sizes.push(staging_bytes(&ctx));
            }
            ctx.wait_idle().unwrap();
            sizes
        };
        let most = [run(FRAMES), run(FRAMES)].concat().into_iter().max().unwrap();
        eprintln!("{queues:?}: at most {most} bytes");
        assert!(most <= STAGING_BYTES, "{most} bytes of staging memory");
        let words = read_words(&ctx, *target, 3 * FRAMES as usize);
        for (frame, words) in (0..).zip(words.chunks_exact(3)) {
            assert_eq!(words, [frame, frame, 1_001], "{queues:?}");
        }
    }
}

#[repr(C, align(256))]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Aligned256([u32; 64]);

#[repr(C, align(2048))]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Aligned2048([u32; 512]);

/// Values of many sizes lie at aligned addresses, and none overlaps another.
#[test]
fn values_of_all_sizes_and_alignments_arrive_whole() {
    let Some(ctx) = device() else { return };
    let sizes = (1..200).chain([255, 256, 257, 1_000, 1_024, 1_025, 5_000, 100_000, 1_500_000]);
    let copier = Copier::new(&ctx);
    let mut random = Random::new(3);
    let values: Vec<Vec<u32>> =
        sizes.map(|size| (0..size).map(|_| random.between(0.0, 1e9) as u32).collect()).collect();
    let count = values.iter().map(Vec::len).sum::<usize>() as u32;
    let target = words_buffer(&ctx, &vec![0; count as usize + 64 + 512]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let addresses: Vec<_> = values
        .iter()
        .map(|value| {
            // Of odd sizes, so that the next address is aligned by the library.
            cmd.upload_slice(&vec![1_u8; value.len() % 7]).unwrap();
            cmd.upload_slice(value).unwrap()
        })
        .collect();
    let wide = cmd.upload(&Aligned256([7; 64])).unwrap();
    let wider = cmd.upload(&Aligned2048([8; 512])).unwrap();
    assert!(addresses.iter().all(|address| address.is_multiple_of(16)));
    assert_eq!([wide % 256, wider % 2048], [0, 0]);
    let mut first = 0;
    for (value, address) in values.iter().zip(addresses) {
        copier.record(&mut cmd, address, &target, [first, value.len() as u32]);
        first += value.len() as u32;
    }
    copier.record(&mut cmd, wide, &target, [count, 64]);
    copier.record(&mut cmd, wider, &target, [count + 64, 512]);
    ctx.submit(cmd).unwrap();
    let expected: Vec<u32> = values.concat().into_iter().chain([7; 64]).chain([8; 512]).collect();
    assert!(read_words(&ctx, *target, expected.len()) == expected);
}

#[test]
fn draws_of_a_pass_read_what_is_uploaded_in_it() {
    let Some(ctx) = device() else { return };
    let desc = TextureDesc {
        format: Format::Rgba8Unorm,
        extent: [4, 1],
        usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
        ..Default::default()
    };
    let texture = ctx.create_texture(&desc).unwrap();
    let vertex = "void main() { gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0.0, 1.0); }";
    let fragment = "
        layout(buffer_reference, scalar) readonly buffer Color { vec4 value; };
        layout(push_constant, scalar) uniform Push { Color color; };
        layout(location = 0) out vec4 color_;
        void main() { color_ = color.value; }";
    let desc = RenderPipelineDesc { color: &[Format::Rgba8Unorm.into()], ..Default::default() };
    let pipeline = render_pipeline(&ctx, vertex, fragment, &desc);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let color = [ColorAttachment::clear(*texture, [0.0; 4])];
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
    pass.bind_render_pipeline(*pipeline).unwrap();
    for column in 0..4_u8 {
        let color = pass.upload_slice(&[f32::from(column) / 255.0, 0.0, 1.0, 1.0]).unwrap();
        pass.scissor([column.into(), 0], [1, 1]).unwrap();
        pass.push_constants(&color).unwrap();
        pass.draw(0..3, 0..1).unwrap();
    }
    drop(pass);
    ctx.submit(cmd).unwrap();
    let texels = ctx.download_texture(*texture, &TextureRegion::default()).unwrap();
    let expected: Vec<u8> = (0..4).flat_map(|column| [column, 0, 255, 255]).collect();
    assert_eq!(texels, expected);
}

#[test]
fn dropped_command_buffers_return_their_memory() {
    let Some(ctx) = device_with(|desc| desc.staging_bytes = 1 << 20) else { return };
    for _ in 0..200 {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.upload(&[1_u32; 128]).unwrap();
        cmd.upload_slice(&vec![0_u8; 300_000]).unwrap();
    }
    assert!(staging_bytes(&ctx) < 2 << 20, "{} bytes of 60 million", staging_bytes(&ctx));
}

#[test]
fn a_value_larger_than_the_kept_memory_is_refused_by_its_size() {
    const KEPT: u64 = 128 << 10;
    static LARGE: [[u64; 1024]; 32] = [[0; 1024]; 32];
    let Some(ctx) = device_with(|desc| desc.staging_bytes = KEPT) else { return };
    let (copier, target) = (Copier::new(&ctx), words_buffer(&ctx, &[0; 2]));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let error = cmd.upload_slice(&vec![0_u8; KEPT as usize + 1]).unwrap_err();
    assert!(matches!(error, Error::UploadTooLarge { bytes, limit: KEPT } if bytes == KEPT + 1), "{error}");
    assert!(error.to_string().contains("staging_bytes (131072 bytes); raise it"), "{error}");
    let large = vec![0_u8; KEPT as usize + 1];
    let texture = raster::target(&ctx, Format::Rgba8Unorm, [1, 1]);
    let color = [ColorAttachment::clear(*texture, [0.0; 4])];
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
    assert!(matches!(pass.upload_slice(&large), Err(Error::UploadTooLarge { limit: KEPT, .. })));
    assert!(matches!(pass.upload(&LARGE), Err(Error::UploadTooLarge { limit: KEPT, .. })));
    drop(pass);
    assert!(matches!(cmd.upload(&LARGE), Err(Error::UploadTooLarge { limit: KEPT, .. })));
    cmd.upload_slice(&vec![0_u8; KEPT as usize]).unwrap();
    cmd.upload_slice::<u32>(&[]).unwrap();
    let source = cmd.upload(&[5, 6]).unwrap();
    copier.record(&mut cmd, source, &target, [0, 2]);
    ctx.submit(cmd).unwrap();
    assert_eq!(read_words(&ctx, *target, 2), [5, 6]);
}

#[test]
fn a_command_buffer_goes_on_after_it_was_out_of_memory() {
    let made = with_fault_injection(|| device_with(|desc| desc.staging_bytes = 256 << 20));
    let Some(ctx) = made else { return };
    let (copier, target) = (Copier::new(&ctx), words_buffer(&ctx, &[0; 2]));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let source = cmd.upload(&[7, 8]).unwrap();
    // Larger than the blocks of memory that exist.
    let large = vec![0_u8; 200 << 20];
    set_out_of_memory(true);
    let error = cmd.upload_slice(&large).unwrap_err();
    set_out_of_memory(false);
    assert!(
        matches!(error, Error::OutOfDeviceMemory { bytes: Some(bytes), .. } if bytes >= 200 << 20),
        "{error}"
    );
    copier.record(&mut cmd, source, &target, [0, 1]);
    let source = cmd.upload(&9).unwrap();
    copier.record(&mut cmd, source, &target, [1, 1]);
    ctx.submit(cmd).unwrap();
    assert_eq!(read_words(&ctx, *target, 2), [7, 9]);
}

#[test]
fn a_buffer_tells_its_address_by_its_holder() {
    let Some(ctx) = device() else { return };
    let buffer = words_buffer(&ctx, &[1]);
    assert_eq!(buffer.address().unwrap(), ctx.buffer_address(*buffer).unwrap());
    ctx.destroy(*buffer);
    assert!(matches!(buffer.address(), Err(Error::StaleHandle { .. })));
}
