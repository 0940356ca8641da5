//! Transient heaps: textures whose memory passes from one to the next, their contents, and refused uses.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use lvk::{
    BufferDesc, BufferHandle, ClearValue, ColorAttachment, CommandBuffer, ComputePipelineHandle, Context,
    Dependencies, DepthAttachment, Error, Format, Holder, Queue, RenderPassDesc, TextureDesc, TextureMemory,
    TextureRange, TextureRegion, TextureUsage, TextureViewDesc, TransientHeap, TransientHeapDesc,
    TransientTexture,
};
use lvk_tests::compute::{compute_pipeline, read_words};
use lvk_tests::noise::noise;
use lvk_tests::queues::{for_each_queue_request, submit_on};
use lvk_tests::{device, device_with};

const SIDE: u32 = 64;
const TEXELS: usize = (SIDE * SIDE) as usize;
/// Bytes of a texture in the buffer that its contents are copied to.
const BYTES: u64 = TEXELS as u64 * 4;

fn desc(name: &str) -> TextureDesc<'_> {
    TextureDesc {
        format: Format::R32Float,
        extent: [SIDE, SIDE],
        usage: TextureUsage::TARGET | TextureUsage::STORAGE | TextureUsage::SAMPLED,
        debug_name: name,
        ..Default::default()
    }
}

fn lives(name: &str, first_step: u32, last_step: u32) -> TransientTexture<'_> {
    TransientTexture { desc: desc(name), first_step, last_step }
}

fn heap(ctx: &Context, textures: &[TransientTexture<'_>]) -> TransientHeap {
    let desc = TransientHeapDesc { textures, debug_name: "targets", ..Default::default() };
    ctx.create_transient_heap(&desc).unwrap()
}

fn buffer(ctx: &Context, count: usize) -> Holder<BufferHandle> {
    ctx.create_buffer(&BufferDesc { size_bytes: BYTES * count as u64, ..Default::default() }).unwrap()
}

/// Ways to write and to read a texture.
struct Ways {
    ctx: Context,
    fill: Holder<ComputePipelineHandle>,
    fetch: Holder<ComputePipelineHandle>,
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Push {
    words: u64,
    texture: u32,
    value: f32,
}

impl Ways {
    fn new(ctx: &Context) -> Self {
        let text = |statement: &str| {
            format!(
                "layout(local_size_x = 8, local_size_y = 8) in;
                 layout(buffer_reference, scalar) buffer Words {{ float at[]; }};
                 layout(push_constant, scalar) uniform Push {{ Words words; uint image; float value; }};
                 void main() {{
                     ivec2 at = ivec2(gl_GlobalInvocationID.xy);
                     {statement};
                 }}"
            )
        };
        let fetch = "words.at[at.y * 64 + at.x] = textureBindlessFetch2D(image, at, 0).x";
        Self {
            ctx: ctx.clone(),
            fill: compute_pipeline(ctx, &text("imageStore(kImages2D[image], at, vec4(value))")),
            fetch: compute_pipeline(ctx, &text(fetch)),
        }
    }

    /// Writes `value` to every texel, by a pass, a clear or a shader.
    fn write(&self, cmd: &mut CommandBuffer, heap: &TransientHeap, index: usize, value: f32, way: u8) {
        let texture = &heap.textures()[index];
        match way % 3 {
            0 => {
                let color = [ColorAttachment::clear(**texture, [value; 4])];
                drop(cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap());
            }
            1 => {
                cmd.clear_texture(**texture, ClearValue::Color([value; 4]), &TextureRange::default()).unwrap()
            }
            _ => {
                cmd.bind_compute_pipeline(*self.fill).unwrap();
                cmd.push_constants(&Push { words: 0, texture: texture.index(), value }).unwrap();
                let storage_images = &[**texture];
                cmd.dispatch(GROUPS, &Dependencies { storage_images, ..Default::default() }).unwrap();
            }
        }
    }

    /// Copies every texel to the place of the texture in `words`, by a copy or a shader.
    fn read(
        &self,
        cmd: &mut CommandBuffer,
        heap: &TransientHeap,
        index: usize,
        words: BufferHandle,
        way: u8,
    ) {
        let (texture, offset) = (&heap.textures()[index], index as u64 * BYTES);
        if way.is_multiple_of(2) {
            return cmd.copy_texture_to_buffer(**texture, &TextureRegion::default(), words, offset).unwrap();
        }
        let address = self.ctx.buffer_address_at(words, offset).unwrap();
        cmd.bind_compute_pipeline(*self.fetch).unwrap();
        cmd.push_constants(&Push { words: address, texture: texture.index(), value: 0.0 }).unwrap();
        let (sampled_images, buffers) = (&[**texture], &[words]);
        cmd.dispatch(GROUPS, &Dependencies { sampled_images, buffers, ..Default::default() }).unwrap();
    }
}

const GROUPS: [u32; 3] = [SIDE / 8, SIDE / 8, 1];

fn usage_error(result: lvk::Result<()>, object: &str, part: &str) {
    match result {
        Err(Error::InvalidUsage { object: named, message }) => {
            assert_eq!(named, object, "{message}");
            assert!(message.contains(part), "{message}");
        }
        other => panic!("{object}: {part}: {other:?}"),
    }
}

/// Random lifetimes, ways and numbers of rounds; the validation layer checks the barriers.
#[test]
fn each_texture_has_its_contents_from_its_first_to_its_last_step() {
    let Some(ctx) = device() else { return };
    let ways = Ways::new(&ctx);
    for seed in 0..8 {
        let noise = noise(seed, 64);
        let steps = |index: usize| {
            let first = u32::from(noise[index] % 6);
            [first, first + u32::from(noise[20 + index] % 3)]
        };
        let all = 3 + seed as usize;
        let textures: Vec<_> =
            (0..all).map(|index| lives("target", steps(index)[0], steps(index)[1])).collect();
        let heap = heap(&ctx, &textures);
        let words = buffer(&ctx, all);
        for frame in 0..3_u32 {
            let value = |index: usize, round: u32| (index as u32 * 10 + frame * 3 + round) as f32;
            let mut cmd = ctx.acquire_command_buffer().unwrap();
            for round in 0..2 {
                for step in 0..8 {
                    cmd.begin_transient_step(&heap, step).unwrap();
                    cmd.begin_transient_step(&heap, step).unwrap();
                    for index in 0..all {
                        let way = noise[40 + index].wrapping_add((frame + round) as u8);
                        if steps(index)[0] == step {
                            ways.write(&mut cmd, &heap, index, value(index, round), way);
                        }
                        if steps(index)[1] == step {
                            ways.read(&mut cmd, &heap, index, *words, way / 3);
                        }
                    }
                }
            }
            ctx.submit(cmd).unwrap();
            let found: Vec<f32> =
                read_words(&ctx, *words, all * TEXELS).into_iter().map(f32::from_bits).collect();
            for (index, texels) in found.chunks(TEXELS).enumerate() {
                let expected = value(index, 1);
                assert!(texels.iter().all(|texel| *texel == expected), "seed {seed}, {index}: {expected}");
            }
        }
    }
}

#[test]
fn frames_in_flight_wait_for_each_other_through_the_shared_bytes() {
    let Some(ctx) = device() else { return };
    let ways = Ways::new(&ctx);
    let heap = heap(&ctx, &[lives("first", 0, 0), lives("second", 1, 1)]);
    let memory = heap.memory();
    assert_eq!((2 * memory.shared_bytes, memory.lazy_bytes), (memory.separate_bytes, 0));
    let results: Vec<_> = (0..6).map(|_| buffer(&ctx, 2)).collect();
    for (frame, words) in results.iter().enumerate() {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        for index in 0..2 {
            cmd.begin_transient_step(&heap, index as u32).unwrap();
            ways.write(&mut cmd, &heap, index, (2 * frame + index) as f32, (frame + index) as u8);
            ways.read(&mut cmd, &heap, index, **words, frame as u8);
        }
        ctx.submit(cmd).unwrap();
    }
    for (frame, words) in results.iter().enumerate() {
        let found = read_words(&ctx, **words, 2 * TEXELS);
        let expected = |at: usize| (2 * frame + at / TEXELS) as f32;
        assert!(found.iter().enumerate().all(|(at, word)| f32::from_bits(*word) == expected(at)), "{frame}");
    }
}

#[test]
fn a_heap_serves_the_queue_that_it_was_made_for() {
    for_each_queue_request(|ctx| {
        let ways = Ways::new(ctx);
        let textures = [lives("first", 0, 0), lives("second", 1, 1)];
        for queue in [Queue::Compute, Queue::Graphics] {
            let desc = TransientHeapDesc { textures: &textures, queue, debug_name: "targets" };
            let heap = ctx.create_transient_heap(&desc).unwrap();
            let words = buffer(ctx, 2);
            for frame in 0..3 {
                submit_on(ctx, queue, |cmd| {
                    for index in 0..2 {
                        cmd.begin_transient_step(&heap, index as u32).unwrap();
                        ways.write(cmd, &heap, index, (frame + index) as f32, 1 + index as u8);
                        ways.read(cmd, &heap, index, *words, frame as u8);
                    }
                });
                let found = read_words(ctx, *words, 2 * TEXELS);
                let expected = |at: usize| (frame + at / TEXELS) as f32;
                assert!(found.iter().enumerate().all(|(at, word)| f32::from_bits(*word) == expected(at)));
            }
        }
    });
}

#[test]
fn passes_without_stores_share_memory_with_other_textures() {
    let Some(ctx) = device() else { return };
    let memory = TextureMemory::Transient;
    let target = |format, usage| TextureDesc { format, usage, memory, ..desc("depth") };
    let depth = TransientTexture {
        desc: target(Format::D32Float, TextureUsage::TARGET),
        first_step: 0,
        last_step: 0,
    };
    let heap = heap(&ctx, &[depth, lives("light", 1, 1), lives("color", 0, 0)]);
    let [depth, light, color] = [0, 1, 2].map(|index| *heap.textures()[index]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.begin_transient_step(&heap, 0).unwrap();
    let deep = DepthAttachment { store: false, ..DepthAttachment::clear(depth, 1.0) };
    let pass = [ColorAttachment::clear(color, [1.0; 4])];
    drop(
        cmd.begin_rendering(&RenderPassDesc { color: &pass, depth: Some(deep), ..Default::default() })
            .unwrap(),
    );
    cmd.begin_transient_step(&heap, 1).unwrap();
    let pass = [ColorAttachment::clear(light, [2.0; 4])];
    drop(cmd.begin_rendering(&RenderPassDesc { color: &pass, ..Default::default() }).unwrap());
    let words = buffer(&ctx, 1);
    cmd.copy_texture_to_buffer(light, &TextureRegion::default(), *words, 0).unwrap();
    ctx.submit(cmd).unwrap();
    assert!(read_words(&ctx, *words, TEXELS).iter().all(|word| f32::from_bits(*word) == 2.0));
    let memory = heap.memory();
    assert!(memory.shared_bytes < memory.separate_bytes, "{memory:?}");
}

#[test]
fn uses_outside_of_the_lifetime_are_errors_that_name_texture_heap_and_steps() {
    let Some(ctx) = device() else { return };
    let heap = heap(&ctx, &[lives("shadow", 0, 1), lives("bloom", 2, 3)]);
    let [shadow, bloom] = [0, 1].map(|index| *heap.textures()[index]);
    let whole = TextureRegion::default();
    let clear = |cmd: &mut CommandBuffer, texture| {
        cmd.clear_texture(texture, ClearValue::Color([0.0; 4]), &TextureRange::default())
    };
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    usage_error(clear(&mut cmd, shadow), "shadow", "call begin_transient_step");
    cmd.begin_transient_step(&heap, 0).unwrap();
    clear(&mut cmd, shadow).unwrap();
    usage_error(clear(&mut cmd, bloom), "bloom", "from step 2 to step 3 of the transient heap 'targets'");
    cmd.begin_transient_step(&heap, 2).unwrap();
    usage_error(clear(&mut cmd, shadow), "shadow", "is in step 2");
    let color = [ColorAttachment::clear(shadow, [0.0; 4])];
    let pass = RenderPassDesc { color: &color, ..Default::default() };
    usage_error(cmd.begin_rendering(&pass).map(drop), "shadow", "from step 0 to step 1");
    let view = TextureViewDesc { texture: Some(shadow), debug_name: "view", ..Default::default() };
    let view = ctx.create_texture_view(&view).unwrap();
    usage_error(clear(&mut cmd, *view), "view", "is in step 2");
    clear(&mut cmd, bloom).unwrap();
    let mut other = ctx.acquire_command_buffer().unwrap();
    usage_error(clear(&mut other, bloom), "bloom", "exist only in one command buffer");
    usage_error(ctx.download_texture(bloom, &whole).map(drop), "bloom", "exist only in one command buffer");
    usage_error(
        ctx.upload_texture(bloom, &whole, &[0; BYTES as usize]),
        "bloom",
        "only in one command buffer",
    );
    ctx.submit(cmd).unwrap();
    drop(heap);
    assert!(matches!(clear(&mut other, bloom), Err(Error::StaleHandle { .. })));
}

#[test]
fn foreign_heaps_and_queues_are_errors() {
    let Some(ctx) = device() else { return };
    let textures = [lives("target", 0, 0)];
    let heap = heap(&ctx, &textures);
    let Some(other) = device_with(|_| ()) else { return };
    let mut cmd = other.acquire_command_buffer().unwrap();
    usage_error(cmd.begin_transient_step(&heap, 0), "targets", "another context");
    let desc = TransientHeapDesc { textures: &textures, queue: Queue::Compute, debug_name: "on compute" };
    let on_compute = ctx.create_transient_heap(&desc).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    usage_error(cmd.begin_transient_step(&on_compute, 0), "on compute", "for the Compute queue");
}

#[test]
fn impossible_heaps_are_errors_that_name_the_texture() {
    let Some(ctx) = device() else { return };
    let make = |textures: &[TransientTexture<'_>]| {
        let desc = TransientHeapDesc { textures, debug_name: "odd heap", ..Default::default() };
        ctx.create_transient_heap(&desc).map(drop)
    };
    let with = |desc| TransientTexture { desc, first_step: 0, last_step: 0 };
    usage_error(make(&[]), "odd heap", "at least one");
    usage_error(make(&[lives("late", 2, 1)]), "late", "first step is 2");
    let filled = TextureDesc { data: Some(&[0; BYTES as usize]), ..desc("filled") };
    usage_error(make(&[lives("fine", 0, 0), with(filled)]), "filled", "takes no data");
    let yuv = TextureDesc { format: Format::Nv12, usage: TextureUsage::SAMPLED, ..desc("video") };
    usage_error(make(&[with(yuv)]), "video", "on its own");
    let target =
        TextureDesc { memory: TextureMemory::Transient, usage: TextureUsage::TARGET, ..desc("tile") };
    let on_compute =
        TransientHeapDesc { textures: &[with(target)], queue: Queue::Compute, debug_name: "tiles" };
    usage_error(ctx.create_transient_heap(&on_compute).map(drop), "tile", "graphics queue");
    usage_error(make(&[with(TextureDesc { extent: [0, 1], ..desc("empty") })]), "empty", "needs texels");
}
