//! Memory and a semaphore that two contexts share, and the clocks of device and host.

use lvk::ash::vk;
use lvk::{
    BufferDesc, ClearValue, CommandBuffer, Context, ContextDesc, Format, MemoryFdType, OptionalFeature,
    RawSignal, RawWait, SemaphoreKind, SharedSemaphoreDesc, TextureDesc, TextureRange, TextureRegion,
    TextureUsage,
};

use crate::compute::{WORDS, read_words};
use crate::{Failure, context};

const LAYOUT: vk::ImageLayout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;

/// One context writes a buffer and a texture, another reads them. Returns what the other has read.
pub(crate) fn exchange() -> Result<Vec<u8>, Failure> {
    let required_features = &[OptionalFeature::ExternalMemoryFd, OptionalFeature::CalibratedTimestamps];
    let desc = ContextDesc { required_features, ..Default::default() };
    let (exporter, importer) = (context(desc.clone())?, context(desc)?);
    for ctx in [&exporter, &importer] {
        let clocks = ctx.calibrated_timestamps()?;
        if !clocks.gpu_ms.is_finite() || !ctx.format_support(Format::Rgba8Unorm)?.target {
            return Err("the clock of the device has no time, or the format is no target".into());
        }
    }
    Ok([buffer(&exporter, &importer)?, texture(&exporter, &importer)?].concat())
}

fn buffer(exporter: &Context, importer: &Context) -> lvk::Result<Vec<u8>> {
    let words: Vec<u32> = (0..WORDS as u32).map(|number| 7 * number).collect();
    let desc = BufferDesc { size_bytes: 4 * WORDS as u64, debug_name: "shared buffer", ..Default::default() };
    let data = Some(bytemuck::cast_slice(&words));
    let ours = exporter.create_exportable_buffer(&BufferDesc { data, ..desc }, MemoryFdType::Opaque)?;
    let memory = exporter.export_buffer(*ours)?;
    // SAFETY: the description is that of the exporter, and the work of each side is in order.
    let theirs = unsafe { importer.import_buffer_memory(&desc, memory)? };
    let release = |cmd: &mut CommandBuffer| cmd.release_external_buffer(*ours);
    // SAFETY: the exporter releases the buffer before the importer acquires it.
    pass_on(exporter, importer, release, |cmd| unsafe { cmd.acquire_external_buffer(*theirs) })?;
    read_words(importer, *theirs)
}

fn texture(exporter: &Context, importer: &Context) -> lvk::Result<Vec<u8>> {
    let desc = TextureDesc {
        format: Format::Rgba8Unorm,
        extent: [8, 4],
        usage: TextureUsage::SAMPLED,
        debug_name: "shared texture",
        ..Default::default()
    };
    let ours = exporter.create_exportable_texture(&desc, MemoryFdType::Opaque)?;
    let memory = exporter.export_texture(*ours)?;
    // SAFETY: the description is that of the exporter, and the work of each side is in order.
    let theirs = unsafe { importer.import_texture_memory(&desc, memory)? };
    let release = |cmd: &mut CommandBuffer| {
        cmd.clear_texture(*ours, ClearValue::Color([1.0, 0.0, 0.0, 1.0]), &TextureRange::default())?;
        cmd.release_external_texture(*ours, LAYOUT)
    };
    // SAFETY: the exporter releases the texture in that layout before the importer acquires it.
    pass_on(exporter, importer, release, |cmd| unsafe { cmd.acquire_external_texture(*theirs, LAYOUT) })?;
    importer.download_texture(*theirs, &TextureRegion::default())
}

/// Submits work of the exporter, and work of the importer behind it. Waits for the end.
fn pass_on(
    exporter: &Context,
    importer: &Context,
    release: impl FnOnce(&mut CommandBuffer) -> lvk::Result<()>,
    acquire: impl FnOnce(&mut CommandBuffer) -> lvk::Result<()>,
) -> lvk::Result<()> {
    let mut ours = exporter.acquire_command_buffer()?;
    release(&mut ours)?;
    let mut theirs = importer.acquire_command_buffer()?;
    acquire(&mut theirs)?;
    if exporter.capabilities().has(OptionalFeature::ExternalSemaphoreFd) {
        return submit_with_semaphore([exporter, importer], [ours, theirs]);
    }
    exporter.wait(exporter.submit(ours)?)?;
    importer.wait(importer.submit(theirs)?)
}

/// Submits the work of both; that of the importer waits for a semaphore of both.
fn submit_with_semaphore(
    [exporter, importer]: [&Context; 2],
    [ours, theirs]: [CommandBuffer; 2],
) -> lvk::Result<()> {
    let desc =
        SharedSemaphoreDesc { kind: SemaphoreKind::Timeline, debug_name: "handover", ..Default::default() };
    let shared = exporter.create_shared_semaphore(&desc)?;
    // SAFETY: an opaque export of a timeline needs no signal; the file descriptor is of this kind and type.
    let imported = unsafe { importer.import_semaphore(&desc, shared.export()?)? };
    let stages = vk::PipelineStageFlags2::ALL_COMMANDS;
    // SAFETY: the signal is submitted before the wait. Both semaphores outlive the work, since both contexts wait for it.
    let submitted = unsafe {
        let signal = RawSignal { semaphore: shared.raw(), value: 1 };
        exporter.submit_with(ours, &[], &[signal])?;
        importer.submit_with(theirs, &[RawWait { semaphore: imported.raw(), value: 1, stages }], &[])
    };
    exporter.wait_idle()?;
    submitted?;
    importer.wait_idle()
}
