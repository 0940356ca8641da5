//! Textures: every shape, mip, layer and format keeps its texels, shaders read them, and wrong use returns an error.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::ash::vk;
use lvk::{
    BufferDesc, ClearValue, Context, Dependencies, DeviceProfile, Error, Filter, Format, Holder, MemoryKind,
    TextureDesc, TextureHandle, TextureKind, TextureRange, TextureRegion, TextureUsage,
};
use lvk_tests::compute::{Evaluator, read_vec4, vec4_buffer};
use lvk_tests::noise::noise;
use lvk_tests::{device, device_with};

const KINDS: [TextureKind; 3] = [TextureKind::D2, TextureKind::D2Array { layers: 3 }, TextureKind::Cube];

fn texture(ctx: &Context, desc: &TextureDesc<'_>) -> Holder<TextureHandle> {
    ctx.create_texture(desc).unwrap()
}

/// A 2D texture of floats whose texel `i` holds `values[i]`.
fn floats(ctx: &Context, extent: [u32; 2], values: &[f32]) -> Holder<TextureHandle> {
    let data = Some(bytemuck::cast_slice(values));
    texture(ctx, &TextureDesc { format: Format::R32Float, extent, data, ..Default::default() })
}

fn whole(mip: u32, layer: u32) -> TextureRegion {
    TextureRegion { mip, layer, ..Default::default() }
}

fn download_floats(ctx: &Context, texture: TextureHandle, region: &TextureRegion) -> Vec<f32> {
    bytemuck::pod_collect_to_vec(&ctx.download_texture(texture, region).unwrap())
}

#[test]
fn every_usage_of_every_format_works_or_is_unsupported() {
    let Some(ctx) = device() else { return };
    let mut refused = 0;
    for format in Format::ALL.iter().copied().filter(|format| !format.is_yuv()) {
        let most = TextureUsage::all() - TextureUsage::SHADING_RATE;
        for usage in [TextureUsage::STORAGE, TextureUsage::TARGET, most] {
            for kind in KINDS {
                let desc = TextureDesc { format, usage, kind, extent: [8, 8], mips: 0, ..Default::default() };
                let made = ctx.create_texture(&desc);
                assert!(
                    matches!(made, Ok(_) | Err(Error::Unsupported { .. })),
                    "{format:?} {usage:?}: {made:?}"
                );
                refused += u32::from(made.is_err());
            }
        }
    }
    assert!(refused > 0, "no device stores to every format");
}

#[test]
fn every_mip_layer_and_region_is_distinct() {
    let Some(ctx) = device() else { return };
    for kind in KINDS {
        let extent = if kind == TextureKind::Cube { [13, 13] } else { [13, 7] };
        let texture = texture(&ctx, &TextureDesc { kind, extent, mips: 0, ..Default::default() });
        let places: Vec<_> =
            (0..kind.layers()).flat_map(|layer| (0..4).map(move |mip| (mip, layer))).collect();
        let size = |mip: u32| extent.map(|side| (side >> mip).max(1) as usize);
        let bytes_of = |seed: u32, mip| noise(seed, 4 * size(mip)[0] * size(mip)[1]);
        for (seed, (mip, layer)) in (0..).zip(&places) {
            ctx.upload_texture(*texture, &whole(*mip, *layer), &bytes_of(seed, *mip)).unwrap();
        }
        let region = TextureRegion {
            mip: 1,
            layer: kind.layers() - 1,
            offset: [2, 1],
            extent: [3, 2],
            ..Default::default()
        };
        ctx.upload_texture(*texture, &region, &[0x55; 24]).unwrap();
        for (seed, (mip, layer)) in (0..).zip(&places) {
            let mut expected = bytes_of(seed, *mip);
            if (*mip, *layer) == (region.mip, region.layer) {
                for row in 1..3 {
                    let start = 4 * (row * size(1)[0] + 2);
                    expected[start..start + 12].fill(0x55);
                }
            }
            let found = ctx.download_texture(*texture, &whole(*mip, *layer)).unwrap();
            assert_eq!(found, expected, "{kind:?}, mip {mip}, layer {layer}");
        }
        assert_eq!(ctx.download_texture(*texture, &region).unwrap(), [0x55; 24]);
        let error = ctx.upload_texture(*texture, &whole(4, 0), &[0; 4]).unwrap_err();
        assert!(error.to_string().contains("4 mips"), "{error}");
    }
}

#[test]
fn data_fills_mip_zero_of_every_layer() {
    let Some(ctx) = device() else { return };
    for kind in KINDS {
        let layer_bytes = 4 * 4 * 4;
        let data = noise(3, layer_bytes * kind.layers() as usize);
        let desc = TextureDesc { kind, extent: [4, 4], mips: 2, data: Some(&data), ..Default::default() };
        let texture = texture(&ctx, &desc);
        for (layer, expected) in (0..).zip(data.chunks(layer_bytes)) {
            assert_eq!(
                ctx.download_texture(*texture, &whole(0, layer)).unwrap(),
                expected,
                "{kind:?} {layer}"
            );
        }
    }
}

/// Halves a power-of-two image of one float a texel.
fn halved(picture: &[f32], width: usize) -> Vec<f32> {
    let height = picture.len() / width;
    let at = |x: usize, y: usize| picture[y.min(height - 1) * width + x.min(width - 1)];
    let (half_width, half_height) = ((width / 2).max(1), (height / 2).max(1));
    let mean = |x: usize, y: usize| {
        (at(2 * x, 2 * y) + at(2 * x + 1, 2 * y) + at(2 * x, 2 * y + 1) + at(2 * x + 1, 2 * y + 1)) / 4.0
    };
    (0..half_height).flat_map(|y| (0..half_width).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect()
}

#[test]
fn generated_mips_are_the_means_of_four_texels() {
    let Some(ctx) = device() else { return };
    for kind in KINDS {
        let extent = if kind == TextureKind::Cube { [16, 16] } else { [16, 8] };
        let texels = (extent[0] * extent[1]) as usize;
        let values: Vec<f32> =
            noise(5, texels * kind.layers() as usize).into_iter().map(|byte| f32::from(byte) / 8.0).collect();
        let desc = TextureDesc {
            kind,
            extent,
            mips: 0,
            format: Format::R32Float,
            data: Some(bytemuck::cast_slice(&values)),
            generate_mips: true,
            ..Default::default()
        };
        let texture = texture(&ctx, &desc);
        for (layer, first) in (0..).zip(values.chunks(texels)) {
            let (mut expected, mut width) = (first.to_vec(), extent[0] as usize);
            for mip in 1..5 {
                expected = halved(&expected, width);
                width = (width / 2).max(1);
                let found = download_floats(&ctx, *texture, &whole(mip, layer));
                assert_eq!(found.len(), expected.len());
                for (found, expected) in found.iter().zip(&expected) {
                    assert!(
                        (found - expected).abs() < 2e-2,
                        "{kind:?} {mip} {layer}: {found} not {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn mips_generated_by_command_follow_the_new_first_mip() {
    let Some(ctx) = device() else { return };
    let texture = texture(&ctx, &TextureDesc { extent: [8, 8], mips: 0, ..Default::default() });
    for value in [40_u8, 200] {
        ctx.upload_texture(*texture, &whole(0, 0), &[value; 256]).unwrap();
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.generate_mipmaps(*texture).unwrap();
        ctx.submit(cmd).unwrap();
        assert_eq!(ctx.download_texture(*texture, &whole(3, 0)).unwrap(), [value; 4]);
    }
    let integers = TextureDesc { format: Format::R32Uint, extent: [8, 8], mips: 0, ..Default::default() };
    let integers = ctx.create_texture(&integers).unwrap();
    let error = ctx.acquire_command_buffer().unwrap().generate_mipmaps(*integers).unwrap_err();
    assert!(matches!(error, Error::Unsupported { .. }), "{error}");
}

#[test]
fn shaders_see_every_kind_at_its_index() {
    let Some(ctx) = device() else { return };
    let sampler = ctx.create_sampler(&Default::default()).unwrap();
    let layered = |kind: TextureKind| {
        let values: Vec<f32> = (0..kind.layers()).flat_map(|layer| [10.0 + layer as f32; 4]).collect();
        let data = Some(bytemuck::cast_slice(&values));
        texture(
            &ctx,
            &TextureDesc { kind, format: Format::R32Float, extent: [2, 2], data, ..Default::default() },
        )
    };
    let [plane, array, cube] = KINDS.map(layered);
    let none = Dependencies::default();
    let run = |expression: &str, texture: &Holder<TextureHandle>, count| {
        let values =
            Evaluator::new(&ctx, expression).run(&ctx, [texture.index(), sampler.index(), 0], count, &none);
        values.into_iter().map(|value| value[0]).collect::<Vec<_>>()
    };
    assert_eq!(run("textureBindless2D(a, b, vec2(0.5))", &plane, 1), [10.0]);
    assert_eq!(run("textureBindless2DArray(a, b, vec3(0.5, 0.5, i))", &array, 3), [10.0, 11.0, 12.0]);
    let directions = "vec3(i == 0, i == 2, i == 4) - vec3(i == 1, i == 3, i == 5)";
    let faces = run(&format!("textureBindlessCube(a, b, {directions})"), &cube, 6);
    assert_eq!(faces, [10.0, 11.0, 12.0, 13.0, 14.0, 15.0]);
    let sizes = Evaluator::new(
        &ctx,
        "vec4(textureBindlessSize2D(a), textureBindlessSize2DArray(b).z, textureBindlessSizeCube(c).x)",
    );
    let indices = [&plane, &array, &cube].map(|texture| texture.index());
    assert_eq!(sizes.run(&ctx, indices, 1, &none), [[2.0, 2.0, 3.0, 2.0]]);
}

#[test]
fn shaders_see_every_mip() {
    let Some(ctx) = device() else { return };
    let sampler = ctx.create_sampler(&Default::default()).unwrap();
    let desc = TextureDesc { format: Format::R32Float, extent: [8, 4], mips: 0, ..Default::default() };
    let texture = texture(&ctx, &desc);
    for mip in 0..4 {
        let values = vec![mip as f32 * 3.0; ((8 >> mip) * (4_usize >> mip).max(1)).max(1)];
        ctx.upload_texture(*texture, &whole(mip, 0), bytemuck::cast_slice(&values)).unwrap();
    }
    let run = |expression: &str| {
        let words = [texture.index(), sampler.index(), 0];
        Evaluator::new(&ctx, expression).run(&ctx, words, 4, &Dependencies::default())
    };
    let lods = run("vec4(textureBindless2DLod(a, b, vec2(0.5), i).r, textureBindlessQueryLevels2D(a), 0, 0)");
    assert_eq!(lods, [0.0, 3.0, 6.0, 9.0].map(|value| [value, 4.0, 0.0, 0.0]));
    let fetched = run("textureBindlessFetch2D(a, ivec2(0), int(i))");
    assert_eq!(fetched.map_first(), [0.0, 3.0, 6.0, 9.0]);
    let between = run("textureBindless2DLod(a, b, vec2(0.5), 1.5)");
    assert!((between[0][0] - 4.5).abs() < 0.02, "{between:?}");
}

trait MapFirst {
    fn map_first(&self) -> Vec<f32>;
}

impl MapFirst for Vec<[f32; 4]> {
    fn map_first(&self) -> Vec<f32> {
        self.iter().map(|value| value[0]).collect()
    }
}

#[test]
fn integer_texels_are_exact_in_shaders() {
    let Some(ctx) = device() else { return };
    let data: [u32; 4] = [7, 0xff_ffff, 0, 12345];
    let desc = TextureDesc {
        format: Format::R32Uint,
        extent: [2, 2],
        data: Some(bytemuck::cast_slice(&data)),
        ..Default::default()
    };
    let texture = texture(&ctx, &desc);
    let fetch = Evaluator::new(&ctx, "vec4(textureBindlessFetchU2D(a, ivec2(i % 2, i / 2), 0))");
    let found = fetch.run(&ctx, [texture.index(), 0, 0], 4, &Dependencies::default());
    assert_eq!(found.map_first(), data.map(|value| value as f32));
}

#[test]
fn srgb_texels_are_linear_in_shaders() {
    let Some(ctx) = device() else { return };
    let data = Some([188_u8, 0, 255, 188].as_slice());
    let desc = TextureDesc { format: Format::Rgba8Srgb, data, ..Default::default() };
    let texture = texture(&ctx, &desc);
    let fetch = Evaluator::new(&ctx, "textureBindlessFetch2D(a, ivec2(0), 0)");
    let found = fetch.run(&ctx, [texture.index(), 0, 0], 1, &Dependencies::default())[0];
    let expected = [0.502_886, 0.0, 1.0, 188.0 / 255.0];
    assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 2e-3), "{found:?}");
}

#[test]
fn stored_texels_are_sampled_and_downloaded() {
    let Some(ctx) = device() else { return };
    let usage = TextureUsage::STORAGE | TextureUsage::SAMPLED;
    let desc = TextureDesc { format: Format::Rgba32Float, extent: [4, 4], usage, ..Default::default() };
    let texture = texture(&ctx, &desc);
    let write =
        Evaluator::new(&ctx, "vec4(1); imageStore(kImages2D[a], ivec2(i % 4, i / 4), vec4(i, b, 2, 3))");
    let read = Evaluator::new(&ctx, "textureBindlessFetch2D(a, ivec2(i % 4, i / 4), 0)");
    let writes = Dependencies { storage_images: &[*texture], ..Default::default() };
    let reads = Dependencies { sampled_images: &[*texture], ..Default::default() };
    let (ones, found) = (vec4_buffer(&ctx, 16), vec4_buffer(&ctx, 16));
    for round in 5..8 {
        let words = [texture.index(), round, 0];
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        write.record(&ctx, &mut cmd, words, (*ones, 16), &writes);
        read.record(&ctx, &mut cmd, words, (*found, 16), &reads);
        ctx.submit(cmd).unwrap();
        let expected: Vec<_> = (0..16).map(|i| [i as f32, round as f32, 2.0, 3.0]).collect();
        assert_eq!(read_vec4(&ctx, *found, 16), expected);
        let bytes = ctx.download_texture(*texture, &whole(0, 0)).unwrap();
        assert_eq!(bytes, bytemuck::cast_slice::<_, u8>(&expected));
    }
}

#[test]
fn layers_are_stored_through_an_array_view() {
    let Some(ctx) = device() else { return };
    for kind in [TextureKind::D2Array { layers: 6 }, TextureKind::Cube] {
        let usage = TextureUsage::STORAGE;
        let desc =
            TextureDesc { kind, format: Format::R32Float, extent: [2, 2], usage, ..Default::default() };
        let texture = texture(&ctx, &desc);
        let write = Evaluator::new(
            &ctx,
            "vec4(1); imageStore(kImages2DArray[a], ivec3(i % 2, (i / 2) % 2, i / 4), vec4(i))",
        );
        let writes = Dependencies { storage_images: &[*texture], ..Default::default() };
        write.run(&ctx, [texture.index(), 0, 0], 24, &writes);
        for layer in 0..6 {
            let found = download_floats(&ctx, *texture, &whole(0, layer));
            let expected: Vec<f32> = (0..4).map(|i| (4 * layer + i) as f32).collect();
            assert_eq!(found, expected, "{kind:?} {layer}");
        }
    }
}

#[test]
fn uploaded_textures_need_no_declaration_even_after_being_copied_from() {
    let Some(ctx) = device() else { return };
    let sampler = ctx.create_sampler(&Default::default()).unwrap();
    let [source, target, scaled] = [1.0, 2.0, 3.0].map(|value| floats(&ctx, [2, 2], &[value; 4]));
    let sample = Evaluator::new(&ctx, "textureBindless2D(a, b, vec2(0.5))");
    let read = |texture: &Holder<TextureHandle>| {
        sample.run(&ctx, [texture.index(), sampler.index(), 0], 1, &Dependencies::default())[0][0]
    };
    assert_eq!(download_floats(&ctx, *source, &whole(0, 0)), [1.0; 4]);
    assert_eq!(read(&source), 1.0);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.copy_texture(*source, &whole(0, 0), *target, &whole(0, 0)).unwrap();
    cmd.blit_texture(*source, &whole(0, 0), *scaled, &whole(0, 0), Filter::Nearest).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!([&source, &target, &scaled].map(read), [1.0; 3]);
}

/// Layouts in bindless sets escape the validation layer, so a barrier of our own states what the layout must be.
#[test]
fn copies_leave_sampled_textures_in_the_layout_that_shaders_read() {
    let Some(ctx) = device() else { return };
    let [source, target, scaled] = [1.0, 2.0, 3.0].map(|value| floats(&ctx, [2, 2], &[value; 4]));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.copy_texture(*source, &whole(0, 0), *target, &whole(0, 0)).unwrap();
    cmd.blit_texture(*source, &whole(0, 0), *scaled, &whole(0, 0), Filter::Nearest).unwrap();
    ctx.submit(cmd).unwrap();
    expect_shader_read(&ctx, &[*source, *target, *scaled]);
    download_floats(&ctx, *target, &whole(0, 0));
    expect_shader_read(&ctx, &[*source, *target, *scaled]);
}

/// Submits a barrier from the layout of sampled textures to another and back; the validation layer knows if they have
/// yet another.
fn expect_shader_read(ctx: &Context, textures: &[TextureHandle]) {
    let read = vk::ImageLayout::READ_ONLY_OPTIMAL;
    let cmd = ctx.acquire_command_buffer().unwrap();
    for [from, to] in [[read, vk::ImageLayout::GENERAL], [vk::ImageLayout::GENERAL, read]] {
        let images = textures.iter().map(|texture| ctx.raw_image(*texture).unwrap());
        let barriers: Vec<_> = images.map(|image| relayout(image, from, to)).collect();
        let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
        // SAFETY: the command buffer is being recorded and the images are alive.
        unsafe { ctx.raw_device().cmd_pipeline_barrier2(cmd.raw(), &info) };
    }
    ctx.submit(cmd).unwrap();
}

fn relayout(
    image: vk::Image,
    from: vk::ImageLayout,
    to: vk::ImageLayout,
) -> vk::ImageMemoryBarrier2<'static> {
    let range = vk::ImageSubresourceRange {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        level_count: 1,
        layer_count: 1,
        ..Default::default()
    };
    let (stages, access) = (vk::PipelineStageFlags2::ALL_COMMANDS, vk::AccessFlags2::MEMORY_WRITE);
    vk::ImageMemoryBarrier2::default()
        .src_stage_mask(stages)
        .src_access_mask(access)
        .dst_stage_mask(stages)
        .dst_access_mask(access | vk::AccessFlags2::MEMORY_READ)
        .old_layout(from)
        .new_layout(to)
        .image(image)
        .subresource_range(range)
}

#[test]
fn clearing_fills_every_mip_and_layer() {
    let Some(ctx) = device() else { return };
    let kind = TextureKind::D2Array { layers: 2 };
    let texture = texture(&ctx, &TextureDesc { kind, extent: [4, 4], mips: 0, ..Default::default() });
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.clear_texture(*texture, ClearValue::Color([1.0, 0.0, 0.2, 1.0]), &TextureRange::default()).unwrap();
    ctx.submit(cmd).unwrap();
    for (mip, layer) in [(0, 0), (1, 1), (2, 1)] {
        let found = ctx.download_texture(*texture, &whole(mip, layer)).unwrap();
        assert!(found.chunks(4).all(|texel| texel == [255, 0, 51, 255]), "{mip} {layer}: {found:?}");
    }
    for format in [Format::R32Uint, Format::R32Sint, Format::D32Float, Format::Bc1RgbUnorm] {
        let other = ctx.create_texture(&TextureDesc { format, ..Default::default() }).unwrap();
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        assert!(matches!(
            cmd.clear_texture(*other, ClearValue::Color([0.0; 4]), &TextureRange::default()),
            Err(Error::InvalidUsage { .. })
        ));
    }
}

#[test]
fn regions_are_copied_between_textures_mips_and_buffers() {
    let profile = DeviceProfile::no_ray_tracing();
    for profile in [None, Some(&profile)] {
        let Some(ctx) = device_with(|desc| desc.profile = profile) else { return };
        copy_regions(&ctx);
    }
}

fn copy_regions(ctx: &Context) {
    let values: Vec<f32> = (0..64).map(|i| i as f32).collect();
    let source = floats(ctx, [8, 8], &values);
    let target = TextureDesc { format: Format::R32Uint, extent: [8, 8], mips: 2, ..Default::default() };
    let target = texture(ctx, &target);
    let from = TextureRegion { offset: [2, 3], extent: [2, 2], ..Default::default() };
    let to = TextureRegion { mip: 1, offset: [1, 0], ..Default::default() };
    let bytes = BufferDesc { size_bytes: 64, memory: MemoryKind::Readback, ..Default::default() };
    let bytes = ctx.create_buffer(&bytes).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.copy_texture(*source, &from, *target, &to).unwrap();
    cmd.copy_texture_to_buffer(*target, &TextureRegion { extent: [2, 2], ..to }, *bytes, 16).unwrap();
    cmd.copy_buffer_to_texture(*bytes, 16, *source, &TextureRegion { extent: [4, 1], ..Default::default() })
        .unwrap();
    ctx.submit(cmd).unwrap();
    let mut copied = [0.0_f32; 4];
    ctx.download_buffer(*bytes, 16, bytemuck::cast_slice_mut(&mut copied)).unwrap();
    assert_eq!(copied, [26.0, 27.0, 34.0, 35.0]);
    assert_eq!(download_floats(ctx, *source, &whole(0, 0))[..6], [26.0, 27.0, 34.0, 35.0, 4.0, 5.0]);
}

#[test]
fn blits_scale_and_convert() {
    let Some(ctx) = device() else { return };
    let source = floats(&ctx, [2, 1], &[0.0, 1.0]);
    let target = texture(&ctx, &TextureDesc { extent: [8, 2], ..Default::default() });
    for (filter, expected) in [
        (Filter::Nearest, [0, 0, 0, 0, 255, 255, 255, 255]),
        (Filter::Linear, [0, 0, 32, 96, 159, 223, 255, 255]),
    ] {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.blit_texture(*source, &whole(0, 0), *target, &whole(0, 0), filter).unwrap();
        ctx.submit(cmd).unwrap();
        let found = ctx.download_texture(*target, &whole(0, 0)).unwrap();
        let reds: Vec<u8> = found.chunks(4).map(|texel| texel[0]).collect();
        for (found, expected) in reds.iter().zip(expected.iter().chain(&expected)) {
            assert!(found.abs_diff(*expected) <= 2, "{filter:?}: {reds:?}");
        }
    }
}

#[test]
fn depth_texels_are_sampled_as_red() {
    let Some(ctx) = device() else { return };
    for format in [Format::D16Unorm, Format::D32Float] {
        let data: Vec<u8> = match format {
            Format::D16Unorm => {
                [0_u16, 0x4000, 0x8000, 0xffff].iter().flat_map(|d| d.to_le_bytes()).collect()
            }
            _ => [0.0_f32, 0.25, 0.5, 1.0].iter().flat_map(|d| d.to_le_bytes()).collect(),
        };
        let desc = TextureDesc { format, extent: [4, 1], data: Some(&data), ..Default::default() };
        let texture = texture(&ctx, &desc);
        let fetch = Evaluator::new(&ctx, "textureBindlessFetch2D(a, ivec2(i, 0), 0)");
        let found = fetch.run(&ctx, [texture.index(), 0, 0], 4, &Dependencies::default()).map_first();
        let close = found.iter().zip([0.0, 0.25, 0.5, 1.0]).all(|(a, b)| (a - b).abs() < 1e-4);
        assert!(close, "{format:?}: {found:?}");
    }
}
