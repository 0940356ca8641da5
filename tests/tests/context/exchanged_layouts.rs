//! Textures are exchanged in the layouts in which wgpu keeps them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::ash::vk::ImageLayout;
use lvk::{
    ColorAttachment, Context, Dependencies, DepthAttachment, Error, Format, ImportedTexture, RenderPassDesc,
    TextureDesc, TextureHandle, TextureRegion, TextureUsage,
};
use lvk_tests::compute::{compute_pipeline, read_words, words_buffer};
use lvk_tests::device;

const SIDE: u32 = 4;

/// Writes the first component of each texel, as bits.
const READ: &str = "
    layout(local_size_x = 16) in;
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; uint texture; };
    void main() {
        uint i = gl_LocalInvocationIndex;
        words.at[i] = floatBitsToUint(textureBindlessFetch2D(texture, ivec2(i % 4, i / 4), 0).x);
    }";

fn desc(format: Format) -> TextureDesc<'static> {
    TextureDesc {
        format,
        extent: [SIDE; 2],
        mips: 1,
        usage: TextureUsage::SAMPLED | TextureUsage::TARGET,
        debug_name: "exchanged",
        ..Default::default()
    }
}

/// Draws `value` to every texel, and leaves the texture in a layout.
fn fill(ctx: &Context, texture: TextureHandle, format: Format, value: f32, layout: ImageLayout) {
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let color = [ColorAttachment::clear(texture, [value; 4])];
    let depth = DepthAttachment { store: true, ..DepthAttachment::clear(texture, value) };
    let pass = match format.is_depth() {
        true => RenderPassDesc { depth: Some(depth), ..Default::default() },
        false => RenderPassDesc { color: &color, ..Default::default() },
    };
    drop(cmd.begin_rendering(&pass).unwrap());
    cmd.release_texture(texture, layout).unwrap();
    ctx.submit(cmd).unwrap();
}

/// Samples the texture in a compute shader, and leaves it in a layout.
fn sample(ctx: &Context, texture: TextureHandle, index: u32, layout: ImageLayout) -> Vec<f32> {
    let (pipeline, words) = (compute_pipeline(ctx, READ), words_buffer(ctx, &[0; 16]));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    let address = ctx.buffer_address(*words).unwrap();
    cmd.push_constants(&[address as u32, (address >> 32) as u32, index]).unwrap();
    let uses = Dependencies { buffers: &[*words], sampled_images: &[texture], ..Default::default() };
    cmd.dispatch([1, 1, 1], &uses).unwrap();
    cmd.release_texture(texture, layout).unwrap();
    ctx.submit(cmd).unwrap();
    read_words(ctx, *words, 16).into_iter().map(f32::from_bits).collect()
}

/// The texture of one handle is imported by a second one, which stands for another engine. The validation layer knows
/// the layout of the image in any case.
#[test]
fn wgpus_resting_layouts_are_exchanged() {
    let Some(ctx) = device() else { return };
    for (format, layout) in [
        (Format::R32Float, ImageLayout::SHADER_READ_ONLY_OPTIMAL),
        (Format::D32Float, ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL),
        (Format::D32Float, ImageLayout::SHADER_READ_ONLY_OPTIMAL),
    ] {
        let own = ctx.create_texture(&desc(format)).unwrap();
        fill(&ctx, *own, format, 0.25, layout);
        ctx.wait_idle().unwrap();
        let image = ctx.raw_image(*own).unwrap();
        let import = ImportedTexture { image, desc: desc(format), layout, concurrent: false };
        // SAFETY: the image is as described, and lives on; the GPU is done with it.
        let other = unsafe { ctx.import_texture(&import) }.unwrap();
        assert_eq!(sample(&ctx, *other, other.index(), layout), [0.25; 16], "{format:?}");
        ctx.wait_idle().unwrap();
        // SAFETY: the release left the image so.
        unsafe { ctx.acquire_texture(*own, layout) }.unwrap();
        assert_eq!(sample(&ctx, *own, own.index(), layout), [0.25; 16], "{format:?}");
        ctx.wait_idle().unwrap();
        // SAFETY: as above.
        unsafe { ctx.acquire_texture(*other, layout) }.unwrap();
        fill(&ctx, *other, format, 0.75, layout);
        ctx.wait_idle().unwrap();
        // SAFETY: as above.
        unsafe { ctx.acquire_texture(*own, layout) }.unwrap();
        let texels = ctx.download_texture(*own, &TextureRegion::default()).unwrap();
        assert_eq!(bytemuck::pod_collect_to_vec::<u8, f32>(&texels), [0.75; 16], "{format:?}");
    }
}

#[test]
fn layouts_that_a_texture_cannot_have_are_refused() {
    let Some(ctx) = device() else { return };
    let usage = TextureUsage::SAMPLED;
    let texture = ctx.create_texture(&TextureDesc { usage, ..desc(Format::R32Float) }).unwrap();
    let image = ctx.raw_image(*texture).unwrap();
    for (layout, words) in [
        (ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL, "a depth or stencil format"),
        (ImageLayout::COLOR_ATTACHMENT_OPTIMAL, "TextureUsage::TARGET"),
        (ImageLayout::PRESENT_SRC_KHR, "cannot be exchanged"),
    ] {
        let desc = TextureDesc { usage, ..desc(Format::R32Float) };
        let import = ImportedTexture { image, desc, layout, concurrent: false };
        // SAFETY: the layout is refused before the image is used.
        let (imported, acquired) =
            unsafe { (ctx.import_texture(&import).map(drop), ctx.acquire_texture(*texture, layout)) };
        let released = ctx.acquire_command_buffer().unwrap().release_texture(*texture, layout);
        for answer in [imported, acquired, released] {
            match answer {
                Err(Error::InvalidUsage { object, message }) => {
                    assert!(object == "exchanged" && message.contains(words), "{object}: {message}");
                }
                other => unreachable!("{other:?}"),
            }
        }
    }
}
