//! Memory and semaphores shared by file descriptors: a second context is the other side.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::os::fd::OwnedFd;

use lvk::ash::vk;
use lvk::{
    BufferDesc, BufferUsage, ClearValue, Context, Dependencies, DeviceProfile, Error, FeatureSet, Format,
    MemoryFd, MemoryFdType, MemoryKind, OptionalFeature, Queue, RawSignal, RawWait, SemaphoreFdType,
    SemaphoreKind, SharedSemaphoreDesc, TextureDesc, TextureKind, TextureRange, TextureRegion, TextureUsage,
};
use lvk_tests::compute::compute_pipeline;
use lvk_tests::device::{TestDevice, device, device_with};

const WORDS: u32 = 64;
const SOURCE: vk::ImageLayout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;

/// Returns two contexts whose devices have the feature, or `None` with a line.
fn two_contexts(feature: OptionalFeature) -> Option<(TestDevice, TestDevice)> {
    let (exporter, importer) = (device()?, device()?);
    if exporter.capabilities().has(feature) {
        return Some((exporter, importer));
    }
    eprintln!("SKIPPED, the device lacks {}", feature.vulkan_name());
    None
}

fn buffer_desc() -> BufferDesc<'static> {
    BufferDesc {
        size_bytes: u64::from(WORDS) * 4,
        usage: BufferUsage::STORAGE,
        debug_name: "shared words",
        ..Default::default()
    }
}

fn texture_desc() -> TextureDesc<'static> {
    TextureDesc {
        format: Format::Rgba8Unorm,
        extent: [16, 8],
        mips: 1,
        usage: TextureUsage::SAMPLED | TextureUsage::TARGET,
        debug_name: "shared texture",
        ..Default::default()
    }
}

/// Runs commands, and waits until they are done.
fn run(ctx: &Context, record: impl FnOnce(&mut lvk::CommandBuffer)) {
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    record(&mut cmd);
    let done = ctx.submit(cmd).unwrap();
    ctx.wait(done).unwrap();
}

fn words(ctx: &Context, buffer: lvk::BufferHandle) -> Vec<u32> {
    let mut read = vec![0_u32; WORDS as usize];
    ctx.download_buffer(buffer, 0, bytemuck::cast_slice_mut(&mut read)).unwrap();
    read
}

/// The exporter writes, the importer adds to it, the exporter reads the sums.
fn exchange_buffer(exporter: &Context, importer: &Context, fd_type: MemoryFdType) {
    let sent: Vec<u32> = (0..WORDS).map(|i| i * 3 + 1).collect();
    let desc = BufferDesc { data: Some(bytemuck::cast_slice(&sent)), ..buffer_desc() };
    let ours = exporter.create_exportable_buffer(&desc, fd_type).unwrap();
    let memory = exporter.export_buffer(*ours).unwrap();
    assert_eq!((memory.fd_type, &memory.drm_layout), (fd_type, &None));
    assert!(memory.allocation_bytes >= u64::from(WORDS) * 4);
    // SAFETY: the description is the exporter's, and each side waits for the other's work.
    let theirs = unsafe { importer.import_buffer_memory(&buffer_desc(), memory).unwrap() };
    run(exporter, |cmd| cmd.release_external_buffer(*ours).unwrap());
    let pipeline = compute_pipeline(
        importer,
        "layout(local_size_x = 64) in;
        layout(buffer_reference, scalar) buffer Words { uint at[]; };
        layout(push_constant, scalar) uniform Push { Words words; };
        void main() { words.at[gl_LocalInvocationIndex] += 1000; }",
    );
    run(importer, |cmd| {
        // SAFETY: the exporter has released the buffer and is done.
        unsafe { cmd.acquire_external_buffer(*theirs).unwrap() };
        cmd.bind_compute_pipeline(*pipeline).unwrap();
        cmd.push_constants(&importer.buffer_address(*theirs).unwrap()).unwrap();
        cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*theirs], ..Default::default() }).unwrap();
        cmd.release_external_buffer(*theirs).unwrap();
    });
    // The memory outlives the importer's buffer.
    drop(theirs);
    // SAFETY: the importer has released the buffer and is done.
    run(exporter, |cmd| unsafe { cmd.acquire_external_buffer(*ours).unwrap() });
    assert_eq!(words(exporter, *ours), sent.iter().map(|word| word + 1000).collect::<Vec<_>>());
}

/// The exporter clears, the importer reads and clears, the exporter reads.
fn exchange_texture(exporter: &Context, importer: &Context, fd_type: MemoryFdType) {
    let ours = exporter.create_exportable_texture(&texture_desc(), fd_type).unwrap();
    let memory = exporter.export_texture(*ours).unwrap();
    assert_eq!(memory.drm_layout.is_some(), fd_type == MemoryFdType::DmaBuf);
    // SAFETY: the description is the exporter's, and each side waits for the other's work.
    let theirs = unsafe { importer.import_texture_memory(&texture_desc(), memory).unwrap() };
    let fill = |cmd: &mut lvk::CommandBuffer, texture, red| {
        let color = ClearValue::Color([red, 0.0, 1.0, 1.0]);
        cmd.clear_texture(texture, color, &TextureRange::default()).unwrap();
        cmd.release_external_texture(texture, SOURCE).unwrap();
    };
    run(exporter, |cmd| fill(cmd, *ours, 1.0));
    // SAFETY: the exporter has released the texture in that layout and is done.
    run(importer, |cmd| unsafe { cmd.acquire_external_texture(*theirs, SOURCE).unwrap() });
    let read = importer.download_texture(*theirs, &TextureRegion::default()).unwrap();
    assert_eq!(read, [255, 0, 255, 255].repeat(16 * 8));
    run(importer, |cmd| fill(cmd, *theirs, 0.0));
    // SAFETY: as above, the other way round.
    run(exporter, |cmd| unsafe { cmd.acquire_external_texture(*ours, SOURCE).unwrap() });
    let read = exporter.download_texture(*ours, &TextureRegion::default()).unwrap();
    assert_eq!(read, [0, 0, 255, 255].repeat(16 * 8));
}

#[test]
fn two_contexts_share_a_buffer() {
    let Some((exporter, importer)) = two_contexts(OptionalFeature::ExternalMemoryFd) else { return };
    exchange_buffer(&exporter, &importer, MemoryFdType::Opaque);
}

#[test]
fn two_contexts_share_a_texture() {
    let Some((exporter, importer)) = two_contexts(OptionalFeature::ExternalMemoryFd) else { return };
    exchange_texture(&exporter, &importer, MemoryFdType::Opaque);
}

#[test]
fn two_contexts_share_dma_bufs() {
    let Some((exporter, importer)) = two_contexts(OptionalFeature::ExternalMemoryDmaBuf) else { return };
    match exporter.create_exportable_buffer(&buffer_desc(), MemoryFdType::DmaBuf) {
        Ok(_) => exchange_buffer(&exporter, &importer, MemoryFdType::DmaBuf),
        // lavapipe makes dma-bufs of /dev/udmabuf, which few systems give to users.
        Err(Error::Unsupported { what, why }) => return eprintln!("SKIPPED, {what}: {why}"),
        Err(error) => panic!("{error}"),
    }
    if exporter.capabilities().has(OptionalFeature::DrmFormatModifier) {
        exchange_texture(&exporter, &importer, MemoryFdType::DmaBuf);
    }
}

/// The contents of a texture are there at its creation, as for any other texture.
#[test]
fn exportable_textures_take_data() {
    let Some(ctx) = device() else { return };
    if !ctx.capabilities().has(OptionalFeature::ExternalMemoryFd) {
        return;
    }
    let texels: Vec<u8> = (0..16 * 8 * 4).map(|i| i as u8).collect();
    let desc = TextureDesc { data: Some(&texels), ..texture_desc() };
    let texture = ctx.create_exportable_texture(&desc, MemoryFdType::Opaque).unwrap();
    assert_eq!(ctx.download_texture(*texture, &TextureRegion::default()).unwrap(), texels);
    let short = TextureDesc { data: Some(&texels[1..]), ..texture_desc() };
    assert!(ctx.create_exportable_texture(&short, MemoryFdType::Opaque).is_err());
}

/// The importer's work waits for the exporter's, by one timeline of both.
#[test]
fn two_contexts_share_a_semaphore() {
    let Some((exporter, importer)) = two_contexts(OptionalFeature::ExternalSemaphoreFd) else { return };
    for kind in [SemaphoreKind::Timeline, SemaphoreKind::Binary] {
        let desc = SharedSemaphoreDesc { kind, debug_name: "handover", ..Default::default() };
        let shared = exporter.create_shared_semaphore(&desc);
        if let Err(Error::Unsupported { .. }) = shared {
            eprintln!("SKIPPED, the driver does not share {kind:?} semaphores");
            continue;
        }
        let shared = shared.unwrap();
        assert_eq!(shared.kind(), kind);
        // SAFETY: an opaque export needs no pending signal; the file descriptor is of this kind and type.
        let imported = unsafe { importer.import_semaphore(&desc, shared.export().unwrap()).unwrap() };
        // SAFETY: an imported semaphore is refused.
        let again = unsafe { imported.export() }.map(drop);
        assert!(
            matches!(&again, Err(Error::InvalidUsage { object, message }) if object == "handover" && message.contains("imported")),
            "{again:?}"
        );
        let signal = RawSignal { semaphore: shared.raw(), value: 7 };
        let wait =
            RawWait { semaphore: imported.raw(), value: 7, stages: vk::PipelineStageFlags2::ALL_COMMANDS };
        // SAFETY: the signal is submitted before the wait, and both semaphores outlive the work.
        unsafe {
            exporter.submit_with(exporter.acquire_command_buffer().unwrap(), &[], &[signal]).unwrap();
            importer.submit_with(importer.acquire_command_buffer().unwrap(), &[wait], &[]).unwrap();
        }
        importer.wait_idle().unwrap();
        exporter.wait_idle().unwrap();
    }
}

/// A sync file without a file descriptor has its signal, so that a wait for it ends.
#[test]
fn a_sync_file_that_is_signalled_has_no_file_descriptor() {
    let Some((_, importer)) = two_contexts(OptionalFeature::ExternalSemaphoreFd) else { return };
    // SAFETY: there is no file descriptor.
    let imported = unsafe { importer.import_semaphore(&sync_file(SemaphoreKind::Binary), None) };
    if let Err(Error::Unsupported { .. }) = imported {
        eprintln!("NOT TESTED, the driver imports no sync files");
        return;
    }
    let imported = imported.unwrap();
    let wait = RawWait { semaphore: imported.raw(), value: 0, stages: vk::PipelineStageFlags2::ALL_COMMANDS };
    // SAFETY: the semaphore is signalled, and outlives the work.
    unsafe { importer.submit_with(importer.acquire_command_buffer().unwrap(), &[wait], &[]) }.unwrap();
    importer.wait_idle().unwrap();
}

fn message<T>(result: lvk::Result<T>) -> String {
    let Err(error) = result else { return String::new() };
    assert!(matches!(error, Error::InvalidUsage { .. } | Error::Unsupported { .. }), "{error:?}");
    error.to_string()
}

#[test]
fn objects_without_shared_memory_are_not_exchanged() {
    let Some(ctx) = device() else { return };
    let buffer = ctx.create_buffer(&buffer_desc()).unwrap();
    let texture = ctx.create_texture(&texture_desc()).unwrap();
    assert!(
        message(ctx.export_buffer(*buffer))
            .contains("shared words: create the buffer by create_exportable_buffer")
    );
    assert!(
        message(ctx.export_texture(*texture))
            .contains("shared texture: create the texture by create_exportable_texture")
    );
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    assert!(message(cmd.release_external_buffer(*buffer)).contains("no shared memory"));
    assert!(message(cmd.release_external_texture(*texture, SOURCE)).contains("no shared memory"));
    // SAFETY: both are refused.
    unsafe {
        assert!(message(cmd.acquire_external_buffer(*buffer)).contains("no shared memory"));
        assert!(message(cmd.acquire_external_texture(*texture, SOURCE)).contains("no shared memory"));
    }
}

#[test]
fn textures_are_acquired_on_the_graphics_queue_only() {
    let Some(ctx) = device() else { return };
    let texture = ctx.create_texture(&texture_desc()).unwrap();
    for queue in [Queue::Compute, Queue::Transfer] {
        let mut cmd = ctx.acquire_command_buffer_on(queue).unwrap();
        // SAFETY: it is refused.
        let refused = unsafe { cmd.acquire_external_texture(*texture, SOURCE) };
        assert!(matches!(refused, Err(Error::WrongQueue { .. })), "{refused:?}");
    }
}

#[test]
fn a_device_without_the_extensions_refuses() {
    let hidden =
        FeatureSet::NONE.with(OptionalFeature::ExternalMemoryFd).with(OptionalFeature::ExternalSemaphoreFd);
    let profile = DeviceProfile { name: "no sharing".into(), hidden, ..Default::default() };
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    assert!(!ctx.capabilities().has(OptionalFeature::ExternalMemoryDmaBuf), "it needs the hidden extension");
    let texts = [
        message(ctx.create_exportable_buffer(&buffer_desc(), MemoryFdType::Opaque)),
        message(ctx.create_exportable_texture(&texture_desc(), MemoryFdType::DmaBuf)),
        message(ctx.create_shared_semaphore(&SharedSemaphoreDesc::default())),
    ];
    for text in texts {
        assert!(text.contains("no sharing") && text.contains("VK_KHR_external_"), "{text}");
    }
}

fn sync_file(kind: SemaphoreKind) -> SharedSemaphoreDesc<'static> {
    SharedSemaphoreDesc { kind, fd_type: SemaphoreFdType::SyncFile, debug_name: "frame done" }
}

/// A file descriptor of no memory.
fn other_file() -> OwnedFd {
    std::fs::File::open("/dev/null").unwrap().into()
}

fn opaque(allocation_bytes: u64) -> MemoryFd {
    let (fd, fd_type) = (other_file(), MemoryFdType::Opaque);
    MemoryFd { fd, fd_type, allocation_bytes, memory_type_index: 0, drm_layout: None }
}

#[test]
fn wrong_descriptions_are_refused() {
    let Some(ctx) = device() else { return };
    if !ctx.capabilities().has(OptionalFeature::ExternalMemoryFd) {
        return;
    }
    let mapped = BufferDesc { memory: MemoryKind::HostVisible, ..buffer_desc() };
    let refused = message(ctx.create_exportable_buffer(&mapped, MemoryFdType::Opaque));
    assert!(refused.contains("MemoryKind::Device"), "{refused}");
    let yuv = TextureDesc { format: Format::Nv12, usage: TextureUsage::SAMPLED, ..texture_desc() };
    let refused = message(ctx.create_exportable_texture(&yuv, MemoryFdType::Opaque));
    assert!(refused.contains("Y'CbCr"), "{refused}");
    if ctx.capabilities().has(OptionalFeature::ExternalMemoryDmaBuf) {
        let volume = TextureDesc { kind: TextureKind::D3 { depth: 4 }, ..texture_desc() };
        let refused = message(ctx.create_exportable_texture(&volume, MemoryFdType::DmaBuf));
        assert!(refused.contains("a texture in a dma-buf is D2"), "{refused}");
    }
    // SAFETY: all of them are refused.
    unsafe {
        let data = BufferDesc { data: Some(&[0; 4]), ..buffer_desc() };
        let refused = message(ctx.import_buffer_memory(&data, opaque(1 << 20)));
        assert!(refused.contains("imported memory has its contents"), "{refused}");
        let refused = message(ctx.import_buffer_memory(&buffer_desc(), opaque(4)));
        assert!(refused.contains("the imported memory has 4 bytes, but 256 are needed"), "{refused}");
        let unknown = MemoryFd { memory_type_index: 40, ..opaque(1 << 20) };
        let refused = message(ctx.import_buffer_memory(&buffer_desc(), unknown));
        assert!(refused.contains("memory type 40"), "{refused}");
        let data = TextureDesc { data: Some(&[0; 4]), ..texture_desc() };
        let refused = message(ctx.import_texture_memory(&data, opaque(1 << 20)));
        assert!(refused.contains("shared texture: imported memory has its contents"), "{refused}");
        let refused = message(ctx.import_texture_memory(&texture_desc(), opaque(4)));
        assert!(refused.contains("shared texture: the imported memory has 4 bytes"), "{refused}");
        let timeline = sync_file(SemaphoreKind::Timeline);
        let imported = message(ctx.import_semaphore(&timeline, Some(other_file())));
        assert!(imported.contains("frame done: a sync file holds a binary semaphore"), "{imported}");
        let none = message(ctx.import_semaphore(&SharedSemaphoreDesc::default(), None));
        assert!(none.contains("shared semaphore: only a sync file may be signalled"), "{none}");
        let created = message(ctx.create_shared_semaphore(&timeline));
        assert!(created.contains("frame done: a sync file holds a binary semaphore"), "{created}");
    }
}
