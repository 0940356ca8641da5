//! A memory heap of which others have taken 80 %, and then all: refusals name object and bytes, and nothing is lost.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::test_hooks::{allocated_bytes, set_heap_bytes, with_fault_injection};
use lvk::{
    BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, Context, Error, Format, Holder,
    PrimitiveOrder, Result, TextureDesc, TextureHandle, TextureUsage, TlasDesc, TransientHeapDesc,
    TransientTexture, Triangles,
};
use lvk_tests::{TestDevice, device_with};

use super::frame::{Frames, Sampled};
use super::run::Tally;
use super::scene::{CYCLE, Scene};

const MIB: u64 = 1 << 20;
/// Size of the emulated heap.
const HEAP: u64 = 1 << 30;
/// Bytes of objects that a full heap cannot take.
const LARGE: u64 = 12 * MIB;
/// Triangles of the mesh whose BLAS needs more than a full heap has.
const TRIANGLES: u32 = 120_000;

/// Ends the emulation, also when a test fails.
struct Emulation;

impl Drop for Emulation {
    fn drop(&mut self) {
        set_heap_bytes(u64::MAX);
    }
}

fn context() -> Option<TestDevice> {
    with_fault_injection(|| device_with(|desc| desc.queues = lvk::QueueRequest::Emulated))
}

fn buffer(ctx: &Context, size_bytes: u64, debug_name: &str) -> Result<Holder<BufferHandle>> {
    let usage = BufferUsage::STORAGE;
    ctx.create_buffer(&BufferDesc { size_bytes, usage, debug_name, ..Default::default() })
}

/// Returns another context that has taken 80 % of the heap, and its buffers.
fn others() -> Option<(Vec<Holder<BufferHandle>>, TestDevice)> {
    let other = context()?;
    let mut taken = Vec::new();
    while allocated_bytes() < HEAP / 5 * 4 {
        let missing = HEAP / 5 * 4 - allocated_bytes();
        // Above the size of the allocator's blocks, each has an allocation of its own.
        taken.push(buffer(&other, missing.max(257 * MIB), "taken by others").unwrap());
    }
    Some((taken, other))
}

/// Fills the heap up to the last 64 KiB.
fn fill(ctx: &Context) -> Vec<Holder<BufferHandle>> {
    let mut all = Vec::new();
    for bytes in [64 * MIB, 8 * MIB, MIB, MIB / 16] {
        loop {
            match buffer(ctx, bytes, "filling") {
                Ok(buffer) => all.push(buffer),
                Err(error) => break assert_refused(&error, "filling", bytes),
            }
        }
    }
    all
}

fn assert_refused(error: &Error, name: &str, least: u64) {
    match error {
        Error::OutOfDeviceMemory { call: "vkAllocateMemory", object, bytes: Some(bytes) } => {
            assert!(object.contains(name), "'{object}' does not name '{name}'");
            assert!(*bytes >= least, "{bytes} of {least} bytes: {error}");
        }
        other => unreachable!("{name}: {other:?}"),
    }
}

fn large_texture(name: &str) -> TextureDesc<'_> {
    TextureDesc {
        format: Format::Rgba8Unorm,
        extent: [2048, 1536],
        usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
        debug_name: name,
        ..Default::default()
    }
}

/// Creates one large object of each kind that takes device memory, each under its own name.
fn create_each(ctx: &Context, vertices: BufferHandle) -> [(&'static str, u64, Result<()>); 6] {
    let geometries = [BlasGeometry::Triangles(Triangles::packed(vertices, 3 * TRIANGLES))];
    let blas = |debug_name, order| {
        // The order in space is computed from vertices that are read back.
        ctx.create_blas(&BlasDesc { geometries: &geometries, order, debug_name, ..Default::default() })
            .map(drop)
    };
    let tlas = TlasDesc { capacity: 200_000, debug_name: "large TLAS", ..Default::default() };
    let transient = TransientTexture { desc: large_texture("large target"), first_step: 0, last_step: 1 };
    let heap = TransientHeapDesc { textures: &[transient], debug_name: "large heap", ..Default::default() };
    [
        ("large buffer", LARGE, buffer(ctx, LARGE, "large buffer").map(drop)),
        ("large texture", LARGE, ctx.create_texture(&large_texture("large texture")).map(drop)),
        ("large heap", LARGE, ctx.create_transient_heap(&heap).map(drop)),
        ("large BLAS", MIB, blas("large BLAS", PrimitiveOrder::Given)),
        ("sorted BLAS", MIB, blas("sorted BLAS", PrimitiveOrder::Auto)),
        ("large TLAS", MIB, ctx.create_tlas(&tlas).map(drop)),
    ]
}

/// Frames of one context, and how many of them were refused for lack of memory.
struct Life<'a> {
    ctx: &'a Context,
    scene: Scene,
    frames: Frames,
    texture: Holder<TextureHandle>,
    tally: Tally,
    number: u32,
    refused: u32,
}

impl<'a> Life<'a> {
    fn new(ctx: &'a Context) -> Self {
        let texels = [90_u8; 4 * 32 * 32];
        let desc = TextureDesc { extent: [32, 32], data: Some(&texels), ..Default::default() };
        let texture = ctx.create_texture(&desc).unwrap();
        let (scene, frames) = (Scene::new(ctx).unwrap(), Frames::default());
        Self { ctx, scene, frames, texture, tally: Tally::default(), number: 0, refused: 0 }
    }

    /// Runs one cycle of frames. The pictures of each are compared with those of the first.
    fn cycle(&mut self) {
        for _ in 0..CYCLE {
            let sampled = Sampled { texture: *self.texture, index: self.texture.index(), finest_mip: 0 };
            let frame = self.frames.frame(self.ctx, &mut self.scene, sampled, self.number, &mut self.tally);
            self.number += 1;
            if let Err(error) = frame {
                assert_refused(&error, "", 1);
                self.refused += 1;
            }
        }
        self.frames.finish(0, &mut self.tally).unwrap();
    }
}

/// One test, as the emulated heap belongs to a thread and two contexts share it.
#[test]
fn a_full_heap_refuses_politely_and_loses_nothing() {
    let _emulation = Emulation;
    set_heap_bytes(HEAP);
    let Some((taken, other)) = others() else { return };
    // Fewer bytes are left than one block of the allocator has.
    let ctx = context().unwrap();
    let mut life = Life::new(&ctx);
    life.cycle();
    life.cycle();
    assert_eq!(life.refused, 0, "a fifth of the heap is enough for small frames");
    let content: Vec<u8> = (0..LARGE).map(|at| ((at * 31) >> 3) as u8).collect();
    let kept = ctx.create_buffer(&BufferDesc { data: Some(&content), ..Default::default() }).unwrap();
    let corners: Vec<f32> = (0..9 * TRIANGLES).map(|at| (at % 97) as f32).collect();
    let usage = BufferUsage::ACCEL_INPUT;
    let data = Some(bytemuck::cast_slice(&corners));
    let vertices = ctx.create_buffer(&BufferDesc { data, usage, ..Default::default() }).unwrap();
    ctx.wait_idle().unwrap();
    let filling = fill(&ctx);
    assert!(HEAP - allocated_bytes() < MIB, "{} of {HEAP} bytes are taken", allocated_bytes());
    let (objects, bytes) = (ctx.live_objects().len(), allocated_bytes());
    for (name, least, result) in create_each(&ctx, *vertices) {
        assert_refused(&result.unwrap_err(), name, least);
    }
    ctx.wait_idle().unwrap();
    assert_eq!((ctx.live_objects().len(), allocated_bytes()), (objects, bytes), "a refusal leaves something");
    let drawn = life.tally.count_of("frames");
    life.cycle();
    let drawn = life.tally.count_of("frames") - drawn;
    eprintln!("a full heap: {drawn} frames drawn, {} refused", life.refused);
    assert!(drawn >= u64::from(CYCLE) / 2, "{drawn} frames need no new memory");
    // Others end, and everything can be created again.
    drop((taken, other, filling));
    ctx.wait_idle().unwrap();
    for (name, _, result) in create_each(&ctx, *vertices) {
        assert!(result.is_ok(), "{name}: {result:?}");
    }
    let refused = life.refused;
    life.cycle();
    assert_eq!(life.refused, refused, "memory is free again");
    let mut found = vec![0; content.len()];
    ctx.download_buffer(*kept, 0, &mut found).unwrap();
    assert!(found == content, "what was there is as it was");
    drop((life, kept, vertices));
    drop(ctx);
    assert_eq!(allocated_bytes(), 0, "memory is left after both contexts");
}
