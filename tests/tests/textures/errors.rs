//! Refused textures: impossible shapes and regions, and uses without the usage flag.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::ash::vk;
use lvk::{
    BufferDesc, Context, Dependencies, Error, Filter, Format, Holder, TextureDesc, TextureHandle,
    TextureKind, TextureRegion, TextureUsage,
};
use lvk_tests::compute::compute_pipeline;
use lvk_tests::device;
use lvk_tests::raster::pixels;

fn whole(mip: u32, layer: u32) -> TextureRegion {
    TextureRegion { mip, layer, ..Default::default() }
}

#[test]
fn impossible_shapes_are_typed_errors() {
    let Some(ctx) = device() else { return };
    let make = |desc: TextureDesc<'_>| {
        ctx.create_texture(&TextureDesc { debug_name: "odd one", ..desc }).map(drop).unwrap_err()
    };
    let limits = ctx.capabilities().limits;
    let (cube, array) = (TextureKind::Cube, |layers| TextureKind::D2Array { layers });
    let too_large = [
        TextureDesc { extent: [limits.max_texture_2d + 1, 1], ..Default::default() },
        TextureDesc { extent: [1, u32::MAX], ..Default::default() },
        TextureDesc { kind: cube, extent: [limits.max_texture_cube + 1; 2], ..Default::default() },
        TextureDesc { kind: array(limits.max_texture_layers + 1), ..Default::default() },
    ];
    for desc in too_large {
        let error = make(desc);
        assert!(matches!(&error, Error::LimitExceeded { object, .. } if object == "odd one"), "{error}");
    }
    let wrong = [
        TextureDesc { extent: [0, 4], ..Default::default() },
        TextureDesc { kind: array(0), ..Default::default() },
        TextureDesc { kind: cube, extent: [4, 8], ..Default::default() },
        TextureDesc { extent: [4, 4], mips: 4, ..Default::default() },
        TextureDesc { usage: TextureUsage::empty(), ..Default::default() },
        TextureDesc { data: Some(&[0; 3]), ..Default::default() },
        TextureDesc { kind: cube, data: Some(&[0; 4]), ..Default::default() },
        TextureDesc { extent: [2, 1], data: Some(&[0; 8]), generate_mips: true, ..Default::default() },
    ];
    for (index, desc) in wrong.into_iter().enumerate() {
        let error = make(desc);
        assert!(
            matches!(&error, Error::InvalidUsage { object, .. } if object == "odd one"),
            "{index}: {error}"
        );
    }
}

#[test]
fn impossible_regions_are_errors_and_record_nothing() {
    let Some(ctx) = device() else { return };
    let texture = ones(&ctx);
    let other = texture_of_eight_bytes(&ctx);
    let buffer = ctx.create_buffer(&BufferDesc { size_bytes: 64, ..Default::default() }).unwrap();
    let region = |offset, extent| TextureRegion { offset, extent, ..Default::default() };
    let bad = [
        region([4, 0], [0, 0]),
        region([0, 0], [5, 1]),
        region([u32::MAX, 0], [2, 1]),
        whole(1, 0),
        whole(0, 1),
    ];
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let good = TextureRegion::default();
    for bad in &bad {
        let results = [
            ctx.upload_texture(*texture, bad, &[0; 64]),
            ctx.download_texture(*texture, bad).map(drop),
            cmd.copy_texture(*texture, bad, *other, &good),
            cmd.blit_texture(*texture, bad, *other, &good, Filter::Nearest),
            cmd.copy_texture_to_buffer(*texture, bad, *buffer, 0),
            cmd.copy_buffer_to_texture(*buffer, 0, *texture, bad),
            cmd.update_texture(*texture, bad, &[0; 64]),
            cmd.resolve_texture(*texture, bad, *other, &good),
            ctx.read_texture_later(*texture, bad).map(drop),
        ];
        for result in results {
            assert!(matches!(result, Err(Error::InvalidUsage { .. })), "{bad:?}: {result:?}");
        }
    }
    let short = ctx.upload_texture(*texture, &good, &[0; 63]).unwrap_err();
    assert_eq!(
        short.to_string(),
        "texture: 63 bytes were given, but the region takes 64 bytes: 4 x 4 x 1 texels of R32Float in 1 layer(s); give \
         the bytes of all texels, tightly packed"
    );
    let results = [
        cmd.copy_texture_to_buffer(*texture, &good, *buffer, 4),
        cmd.copy_texture_to_buffer(*texture, &region([0, 0], [1, 1]), *buffer, 2),
        cmd.copy_texture(*texture, &good, *other, &good),
        cmd.copy_texture(*texture, &region([0, 0], [1, 1]), *texture, &region([2, 2], [1, 1])),
        cmd.blit_texture(*texture, &good, *texture, &good, Filter::Nearest),
        cmd.update_texture(*texture, &good, &[0; 63]),
        cmd.copy_buffer_to_texture(*buffer, u64::MAX - 3, *texture, &good),
    ];
    for (index, result) in results.into_iter().enumerate() {
        assert!(matches!(result, Err(Error::InvalidUsage { .. })), "{index}: {result:?}");
    }
    ctx.submit(cmd).unwrap();
    assert_eq!(pixels::<f32>(&ctx, *texture), [1.0; 16]);
}

fn texture_of_eight_bytes(ctx: &Context) -> Holder<TextureHandle> {
    let desc = TextureDesc { format: Format::Rg32Float, extent: [4, 4], ..Default::default() };
    ctx.create_texture(&desc).unwrap()
}

/// Four by four texels of one float, all 1.
fn ones(ctx: &Context) -> Holder<TextureHandle> {
    let data = [1.0_f32; 16];
    let data = Some(bytemuck::cast_slice(&data));
    let desc = TextureDesc { format: Format::R32Float, extent: [4, 4], data, ..Default::default() };
    ctx.create_texture(&desc).unwrap()
}

#[test]
fn textures_serve_only_what_their_usage_says() {
    let Some(ctx) = device() else { return };
    let sampled = ctx.create_texture(&TextureDesc::default()).unwrap();
    let stored = TextureDesc { usage: TextureUsage::STORAGE, ..Default::default() };
    let stored = ctx.create_texture(&stored).unwrap();
    let pipeline = compute_pipeline(&ctx, "layout(local_size_x = 1) in; void main() {}");
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    let wrong = [
        (Dependencies { storage_images: &[*sampled], ..Default::default() }, "STORAGE"),
        (Dependencies { sampled_images: &[*stored], ..Default::default() }, "SAMPLED"),
    ];
    for (dependencies, usage) in wrong {
        let error = cmd.dispatch([1, 1, 1], &dependencies).unwrap_err();
        assert!(matches!(error, Error::InvalidUsage { .. }), "{error:?}");
        assert!(error.to_string().contains(usage), "{error}");
    }
    cmd.dispatch([1, 1, 1], &Dependencies::default()).unwrap();
    ctx.submit(cmd).unwrap();
}

/// Views for other engines have the usages of their texture.
#[test]
fn raw_views_need_their_usage_and_their_part() {
    let Some(ctx) = device() else { return };
    let make = |usage, debug_name| {
        let desc = TextureDesc { usage, extent: [4, 4], mips: 1, debug_name, ..Default::default() };
        ctx.create_texture(&desc).unwrap()
    };
    let (stored, drawn) = (make(TextureUsage::STORAGE, "stored"), make(TextureUsage::TARGET, "drawn"));
    let sampled = make(TextureUsage::SAMPLED, "sampled");
    let refused = |result: lvk::Result<vk::ImageView>, words: &str| match result {
        Err(Error::InvalidUsage { object, message }) => {
            let text = format!("{object}: {message}");
            assert!(text.contains(words), "{text}");
        }
        other => unreachable!("{words}: {other:?}"),
    };
    for (texture, name) in [(*stored, "stored"), (*drawn, "drawn")] {
        let words = format!("{name}: create the texture with TextureUsage(SAMPLED) in its usage");
        refused(ctx.raw_image_view(texture), &words);
    }
    refused(ctx.raw_target_view(*sampled, 0, 0), "sampled: create the texture with TextureUsage(TARGET)");
    refused(ctx.raw_target_view(*drawn, 1, 0), "drawn: mip 1 of layer 0 does not exist");
    refused(ctx.raw_target_view(*drawn, 0, u32::MAX), "drawn: mip 0 of layer 4294967295 does not exist");
    ctx.raw_image_view(*sampled).unwrap();
    ctx.raw_target_view(*drawn, 0, 0).unwrap();
}
