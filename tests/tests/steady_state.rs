//! Repeated frames: a draw allocates nothing on the heap, and no memory grows, neither the library's nor the driver's
//! nor the process's.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use lvk::test_hooks::{null_command_context, staging_bytes, waiting_objects};
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BuildFlags, BuildMode,
    ColorAttachment, ComputePipelineHandle, Context, ContextDesc, Dependencies, DeviceInstances, Format,
    Holder, OptionalFeature, PrimitiveOrder, RayQueryRequest, RenderPassDesc, RenderPipelineDesc,
    RenderPipelineHandle, TextureDesc, TextureHandle, TextureUsage, TlasDesc, TlasInstance, Triangles,
    ValidationMode,
};
use lvk_tests::compute::compute_pipeline;
use lvk_tests::device::vulkan;
use lvk_tests::process::{heap_bytes, resident_bytes};
use lvk_tests::raster::render_pipeline;
use lvk_tests::{device, device_with};

static COUNT: AtomicU64 = AtomicU64::new(0);
static BYTES: AtomicI64 = AtomicI64::new(0);

/// The system's allocator, counting.
struct Counting;

// SAFETY: everything is the system allocator's own.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        BYTES.fetch_add(layout.size() as i64, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `GlobalAlloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        BYTES.fetch_sub(layout.size() as i64, Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// The heap is counted for all threads: one test at a time.
static ALONE: Mutex<()> = Mutex::new(());

/// A dispatch that writes an image, and a pass that draws.
struct Frame {
    target: Holder<TextureHandle>,
    image: Holder<TextureHandle>,
    uploaded: Holder<BufferHandle>,
    draw: Holder<RenderPipelineHandle>,
    compute: Holder<ComputePipelineHandle>,
}

impl Frame {
    fn new(ctx: &Context) -> Self {
        let texture = |usage| {
            let format = Format::Rgba8Unorm;
            ctx.create_texture(&TextureDesc { format, extent: [8, 8], usage, ..Default::default() }).unwrap()
        };
        let vertex = "layout(buffer_reference, scalar) readonly buffer Words { uint at[2]; };
             layout(push_constant) uniform Push { Words words; };
             void main() { gl_Position = vec4(words.at[gl_VertexIndex & 1]); }";
        let fragment = "layout(location = 0) out vec4 color; void main() { color = vec4(1.0); }";
        let desc = RenderPipelineDesc { color: &[Format::Rgba8Unorm.into()], ..Default::default() };
        Self {
            target: texture(TextureUsage::TARGET | TextureUsage::SAMPLED),
            image: texture(TextureUsage::STORAGE | TextureUsage::SAMPLED),
            uploaded: ctx.create_buffer(&BufferDesc { size_bytes: 4096, ..Default::default() }).unwrap(),
            draw: render_pipeline(ctx, vertex, fragment, &desc),
            compute: compute_pipeline(
                ctx,
                "layout(local_size_x = 8, local_size_y = 8) in;
                 layout(push_constant) uniform Push { uint words[2]; };
                 void main() { imageStore(kImages2D[words[0]], ivec2(gl_LocalInvocationID.xy), vec4(1.0)); }",
            ),
        }
    }

    fn run(&self, ctx: &Context, number: u32, draws: u32) {
        ctx.next_frame().unwrap();
        let bytes = [number as u8; 256];
        ctx.upload_buffer(*self.uploaded, u64::from(number % 16) * 256, &bytes).unwrap();
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.bind_compute_pipeline(*self.compute).unwrap();
        cmd.push_constants(&[self.image.index(), 0]).unwrap();
        let images = [*self.image];
        cmd.dispatch([1, 1, 1], &Dependencies { storage_images: &images, ..Default::default() }).unwrap();
        let color = [ColorAttachment::clear(*self.target, [0.0; 4])];
        let read = [*self.uploaded];
        let dependencies =
            Dependencies { sampled_images: &images, read_buffers: &read, ..Default::default() };
        let pass = RenderPassDesc { color: &color, dependencies, ..Default::default() };
        let mut pass = cmd.begin_rendering(&pass).unwrap();
        pass.bind_render_pipeline(*self.draw).unwrap();
        for draw in 0..draws {
            let words = pass.upload(&[number, draw]).unwrap();
            pass.push_constants(&words).unwrap();
            pass.draw(0..3, 0..1).unwrap();
        }
        drop(pass);
        ctx.submit(cmd).unwrap();
    }

    fn run_many(&self, ctx: &Context, frames: u32, draws: u32) {
        (0..frames).for_each(|number| self.run(ctx, number, draws));
        ctx.wait_idle().unwrap();
    }
}

/// Ten thousand frames whose recorded commands do nothing, so that only the library is seen.
#[test]
fn draws_take_nothing_from_the_heap_and_frames_leave_nothing_there() {
    const DRAWS: u32 = 100;
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(vulkan_library) = vulkan() else { return };
    let ctx = null_command_context(&ContextDesc { vulkan_library, ..Default::default() }).unwrap();
    let frame = Frame::new(&ctx);
    let allocations = |frames, draws| {
        let before = COUNT.load(Ordering::Relaxed);
        frame.run_many(&ctx, frames, draws);
        COUNT.load(Ordering::Relaxed) - before
    };
    allocations(200, DRAWS);
    let bytes = BYTES.load(Ordering::Relaxed);
    let (full, empty) = (allocations(1_000, DRAWS), allocations(1_000, 0));
    // Lists grow now and then, as frames end when they end, and more often on a busy machine; a draw that allocates would
    // make it a hundred thousand.
    assert!(full.abs_diff(empty) < 1_000, "{full} with draws, {empty} without");
    let (objects, staging) = (ctx.memory_budget(), staging_bytes(&ctx));
    frame.run_many(&ctx, 8_000, 10);
    let grown = BYTES.load(Ordering::Relaxed) - bytes;
    assert!(grown.abs() < 4_096, "{grown} bytes of the heap were kept by 10,000 frames");
    let object_bytes = |budget: &lvk::MemoryBudget| -> Vec<u64> {
        budget.heaps.iter().map(|heap| heap.object_bytes).collect()
    };
    assert_eq!(object_bytes(&ctx.memory_budget()), object_bytes(&objects));
    assert_eq!((staging_bytes(&ctx), waiting_objects(&ctx).unwrap()), (staging, 0));
}

/// TLASes that show the same meshes in every frame, by instances of the host or from a buffer.
#[test]
fn refits_of_unchanged_references_take_nothing_from_the_heap() {
    const MESHES: usize = 100;
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(vulkan_library) = vulkan() else { return };
    let ray_query = RayQueryRequest::Hardware;
    let desc = ContextDesc { vulkan_library, ray_query, ..Default::default() };
    let ctx = match null_command_context(&desc) {
        Ok(ctx) => ctx,
        Err(error) => return eprintln!("SKIPPED, no ray queries by hardware: {error}"),
    };
    let meshes: Vec<_> = (0..MESHES).map(|_| triangle(&ctx)).collect();
    let shown: Vec<_> = meshes.iter().map(|mesh| *mesh.blas).collect();
    let instances: Vec<_> = (0..1_000).map(|number| TlasInstance::new(shown[number * 7 % MESHES])).collect();
    let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE;
    let desc = TlasDesc { instances: &instances, flags, ..Default::default() };
    let structures: Vec<_> = (0..16).map(|_| ctx.create_tlas(&desc).unwrap()).collect();
    let desc = BufferDesc { size_bytes: 64 * 1_000, usage: lvk::BufferUsage::STORAGE, ..Default::default() };
    let records = ctx.create_buffer(&desc).unwrap();
    let buffer = DeviceInstances { buffer: *records, offset: 0, count: 1_000, blas: &shown };
    for from_buffer in [false, true] {
        let allocations = |refits: usize| {
            let before = COUNT.load(Ordering::Relaxed);
            for _ in 0..200 {
                ctx.next_frame().unwrap();
                let mut cmd = ctx.acquire_command_buffer().unwrap();
                for tlas in structures.iter().take(refits) {
                    match from_buffer {
                        true => cmd.update_tlas_from_buffer(**tlas, &buffer, BuildMode::Refit).unwrap(),
                        false => cmd.update_tlas(**tlas, &instances, BuildMode::Refit).unwrap(),
                    }
                }
                ctx.submit(cmd).unwrap();
            }
            ctx.wait_idle().unwrap();
            COUNT.load(Ordering::Relaxed) - before
        };
        allocations(16);
        let (many, one) = (allocations(16), allocations(1));
        // Three thousand refits more; lists grow now and then.
        assert!(many.abs_diff(one) < 300, "{many} with 16 refits a frame, {one} with one, {from_buffer}");
    }
}

/// A BLAS of one triangle, and the buffer it is built from.
struct Mesh {
    blas: Holder<AccelStructHandle>,
    _vertices: Holder<BufferHandle>,
}

fn triangle(ctx: &Context) -> Mesh {
    let usage = lvk::BufferUsage::ACCEL_INPUT;
    let vertices = ctx.create_buffer(&BufferDesc { size_bytes: 36, usage, ..Default::default() }).unwrap();
    let geometries = [BlasGeometry::Triangles(Triangles::packed(*vertices, 3))];
    let order = PrimitiveOrder::Given;
    let desc = BlasDesc { geometries: &geometries, order, ..Default::default() };
    Mesh { blas: ctx.create_blas(&desc).unwrap(), _vertices: vertices }
}

#[test]
fn frames_that_create_and_destroy_keep_no_memory() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(ctx) = device() else { return };
    let frame = Frame::new(&ctx);
    let run = |frames: u32| {
        for number in 0..frames {
            let data = [number; 300];
            let data = Some(bytemuck::cast_slice(&data));
            let buffer = ctx.create_buffer(&BufferDesc { data, ..Default::default() }).unwrap();
            let desc = TextureDesc { extent: [32, 32], ..Default::default() };
            let texture = ctx.create_texture(&desc).unwrap();
            frame.run(&ctx, number, 2);
            drop((buffer, texture));
        }
        ctx.wait_idle().unwrap();
        assert_eq!(waiting_objects(&ctx).unwrap(), 0);
        (ctx.memory_budget(), staging_bytes(&ctx))
    };
    let (early, late) = (run(40), run(160));
    let bytes =
        |budget: &lvk::MemoryBudget| budget.heaps.iter().map(|heap| heap.object_bytes).collect::<Vec<_>>();
    assert_eq!(bytes(&early.0), bytes(&late.0));
    assert_eq!(early.1, late.1);
}

/// Returns the bytes of all heaps that the process uses, by the driver's report. Software drivers report the memory
/// of all processes of the machine, which changes at any time, and their memory is the process's anyway.
fn driver_bytes(ctx: &Context) -> Option<i64> {
    let budget = ctx.memory_budget();
    let used = budget.heaps.iter().map(|heap| heap.used_bytes as i64).sum();
    (budget.is_measured && !ctx.capabilities().is_cpu).then_some(used)
}

/// Frames that the driver records and runs, without the layer, which keeps memory of its own.
#[test]
fn frames_that_run_grow_neither_the_process_nor_what_the_driver_counts() {
    /// A few bytes a frame on the heap, and some pages of it.
    const SLACK: [i64; 2] = [16 << 10, 128 << 10];
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(ctx) = device_with(|desc| desc.validation = ValidationMode::Off) else { return };
    let frame = Frame::new(&ctx);
    let grown = |frames, bytes: &dyn Fn() -> Option<i64>| {
        let before = bytes();
        frame.run_many(&ctx, frames, 10);
        bytes().zip(before).map_or(0, |(after, before)| after - before)
    };
    frame.run_many(&ctx, 3_000, 10);
    // A leak grows every time; threads and allocators that take some pages more do so once.
    let heap = [0; 3].map(|_| grown(3_000, &heap_bytes));
    assert!(heap.iter().any(|grown| *grown < SLACK[0]), "the heap grows by {heap:?} bytes");
    let process = [0; 3].map(|_| grown(1_000, &resident_bytes));
    assert!(process.iter().any(|grown| *grown < SLACK[1]), "the process grows by {process:?} bytes");
    let driver = [0; 3].map(|_| grown(3_000, &|| driver_bytes(&ctx)));
    assert!(driver.iter().any(|grown| *grown < SLACK[1]), "what the driver counts grows by {driver:?} bytes");
}

#[test]
fn the_memory_of_objects_is_counted_in_their_heap_until_they_are_freed() {
    const SIZE: u64 = 3 << 20;
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let profile = lvk::DeviceProfile::core_only();
    for hidden in [false, true] {
        let Some(ctx) = device_with(|desc| desc.profile = hidden.then_some(&profile)) else { return };
        let total = || ctx.memory_budget().heaps.iter().map(|heap| heap.object_bytes).sum::<u64>();
        ctx.wait_idle().unwrap();
        let before = total();
        assert!(before > 0, "the library itself has buffers");
        let buffer = ctx.create_buffer(&BufferDesc { size_bytes: SIZE, ..Default::default() }).unwrap();
        assert!((SIZE..=SIZE + 4096).contains(&(total() - before)), "{} of {SIZE}", total() - before);
        let budget = ctx.memory_budget();
        assert_eq!(budget.is_measured, ctx.capabilities().has(OptionalFeature::MemoryBudget));
        assert!(!(hidden && budget.is_measured), "the profile hides the feature");
        assert!(budget.heaps.iter().any(|heap| heap.device_local));
        for heap in &budget.heaps {
            assert!(heap.size_bytes > 0 && heap.object_bytes <= heap.size_bytes, "{heap:?}");
            assert!(heap.budget_bytes > 0, "{heap:?}");
            assert!(budget.is_measured || heap.used_bytes == heap.object_bytes, "{heap:?}");
        }
        drop(buffer);
        ctx.wait_idle().unwrap();
        assert_eq!(total(), before);
    }
}

/// Also where the instances are kept for the time when a mesh has moved.
#[test]
fn tlases_leave_nothing_on_the_heap() {
    const EACH: usize = 300;
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(ctx) = device() else { return };
    let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let desc = BufferDesc {
        size_bytes: 36,
        usage: lvk::BufferUsage::ACCEL_INPUT | lvk::BufferUsage::STORAGE,
        data: Some(bytemuck::cast_slice(&corners)),
        ..Default::default()
    };
    let buffer = ctx.create_buffer(&desc).unwrap();
    let geometries = [BlasGeometry::Triangles(Triangles::packed(*buffer, 3))];
    let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION;
    let order = PrimitiveOrder::Given;
    let blas =
        ctx.create_blas(&BlasDesc { geometries: &geometries, flags, order, ..Default::default() }).unwrap();
    let instances = [TlasInstance::new(*blas)];
    let grown = [0; 4].map(|_: usize| {
        let before = BYTES.load(Ordering::Relaxed);
        for _ in 0..EACH {
            let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() }).unwrap();
            ctx.wait_idle().unwrap();
            drop(tlas);
        }
        ctx.wait_idle().unwrap();
        BYTES.load(Ordering::Relaxed) - before
    });
    assert!(grown[1..].iter().sum::<i64>() < 4096, "{grown:?}");
}
