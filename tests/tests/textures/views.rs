//! Texture views: parts of a texture with another kind, format or swizzle behave as textures.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    Channel, ClearValue, ColorAttachment, ColorLoadOp, Context, Dependencies, Error, Filter, Format, Holder,
    RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle, Swizzle, TextureDesc, TextureHandle,
    TextureKind, TextureRange, TextureRegion, TextureUsage, TextureViewDesc,
};
use lvk_tests::compute::{Evaluator, compute_pipeline};
use lvk_tests::noise::noise;
use lvk_tests::raster::{COVER, render_pipeline};
use lvk_tests::{device, device_with};

const SHADERS: TextureUsage = TextureUsage::SAMPLED.union(TextureUsage::STORAGE);

fn texture(ctx: &Context, desc: &TextureDesc<'_>) -> Holder<TextureHandle> {
    ctx.create_texture(desc).unwrap()
}

fn view(ctx: &Context, of: TextureHandle, desc: TextureViewDesc<'_>) -> Holder<TextureHandle> {
    ctx.create_texture_view(&TextureViewDesc { texture: Some(of), ..desc }).unwrap()
}

fn one_mip(ctx: &Context, of: TextureHandle, base_mip: u32) -> Holder<TextureHandle> {
    view(ctx, of, TextureViewDesc { base_mip, mips: 1, debug_name: "one mip", ..Default::default() })
}

fn region_of(mip: u32, layer: u32) -> TextureRegion {
    TextureRegion { mip, layer, ..Default::default() }
}

fn floats(ctx: &Context, texture: TextureHandle, region: &TextureRegion) -> Vec<f32> {
    bytemuck::pod_collect_to_vec(&ctx.download_texture(texture, region).unwrap())
}

/// Texel (0, 0) as shaders see it.
fn first_texel(ctx: &Context, texture: &Holder<TextureHandle>) -> [f32; 4] {
    let fetch = Evaluator::new(ctx, "textureBindlessFetch2D(a, ivec2(0), 0)");
    fetch.run(ctx, [texture.index(), 0, 0], 1, &Dependencies::default())[0]
}

fn usage_error<T: std::fmt::Debug>(result: lvk::Result<T>, words: &[&str]) {
    let error = result.unwrap_err();
    assert!(matches!(error, Error::InvalidUsage { .. }), "{error}");
    words.iter().for_each(|word| assert!(error.to_string().contains(word), "'{word}' in '{error}'"));
}

/// Each dispatch samples one mip of the texture and stores the next.
#[test]
fn a_mip_is_sampled_while_the_next_is_stored() {
    let Some(ctx) = device() else { return };
    let values: Vec<f32> = (0..256_u16).map(|i| f32::from(i * 37 % 101)).collect();
    let chain = texture(
        &ctx,
        &TextureDesc {
            format: Format::R32Float,
            extent: [16, 16],
            mips: 0,
            usage: SHADERS,
            data: Some(bytemuck::cast_slice(&values)),
            ..Default::default()
        },
    );
    let mips: Vec<_> = (0..5).map(|mip| one_mip(&ctx, *chain, mip)).collect();
    let halve = compute_pipeline(
        &ctx,
        "layout(local_size_x = 1) in;
         layout(push_constant, scalar) uniform Push { uint from; uint to; };
         void main() {
             ivec2 p = ivec2(gl_GlobalInvocationID.xy);
             vec4 sum = vec4(0.0);
             for (int i = 0; i < 4; i++) sum += textureBindlessFetch2D(from, 2 * p + ivec2(i & 1, i >> 1), 0);
             imageStore(kImages2D[to], p, sum * 0.25);
         }",
    );
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*halve).unwrap();
    for (mip, pair) in (1..).zip(mips.windows(2)) {
        cmd.push_constants(&[pair[0].index(), pair[1].index()]).unwrap();
        let side = 16_u32 >> mip;
        let (sampled_images, storage_images) = (&[*pair[0]][..], &[*pair[1]][..]);
        let deps = Dependencies { sampled_images, storage_images, ..Default::default() };
        cmd.dispatch([side, side, 1], &deps).unwrap();
    }
    ctx.submit(cmd).unwrap();
    let mut expected = values;
    for mip in 0..5 {
        assert_eq!(floats(&ctx, *chain, &region_of(mip, 0)), expected, "mip {mip}");
        let side = 16 >> mip;
        let texel = |x: usize, y: usize| expected[y * side + x];
        let mean = |x, y| {
            0.25 * (texel(2 * x, 2 * y)
                + texel(2 * x + 1, 2 * y)
                + texel(2 * x, 2 * y + 1)
                + texel(2 * x + 1, 2 * y + 1))
        };
        expected =
            (0..side / 2).flat_map(|y| (0..side / 2).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect();
    }
}

/// Two views that share some mips are read by one command, beside a third that is stored to.
#[test]
fn overlapping_views_are_read_together() {
    let Some(ctx) = device() else { return };
    let desc = TextureDesc {
        extent: [64, 64],
        mips: 6,
        usage: SHADERS,
        format: Format::R32Float,
        ..Default::default()
    };
    let whole = texture(&ctx, &desc);
    for mip in 0..6_u8 {
        let texels = vec![f32::from(mip); (64 >> mip) * (64 >> mip)];
        ctx.upload_texture(*whole, &region_of(mip.into(), 0), bytemuck::cast_slice(&texels)).unwrap();
    }
    let mips = |base_mip, mips| view(&ctx, *whole, TextureViewDesc { base_mip, mips, ..Default::default() });
    let (low, high, stored) = (mips(0, 4), mips(2, 3), mips(5, 1));
    let fetch = Evaluator::new(
        &ctx,
        "vec4(textureBindlessFetch2D(a, ivec2(0), 3).r, textureBindlessFetch2D(b, ivec2(0), 2).r,
              textureBindlessQueryLevels2D(a), textureBindlessQueryLevels2D(b));
         imageStore(kImages2D[c], ivec2(0), vec4(9.0))",
    );
    let deps = Dependencies {
        sampled_images: &[*low, *high, *low],
        storage_images: &[*stored],
        ..Default::default()
    };
    let found = fetch.run(&ctx, [low.index(), high.index(), stored.index()], 1, &deps);
    assert_eq!(found, [[3.0, 4.0, 4.0, 3.0]]);
    assert_eq!(floats(&ctx, *whole, &region_of(5, 0))[0], 9.0);
}

#[test]
fn uses_of_the_same_texels_that_exclude_each_other_name_both_views() {
    let Some(ctx) = device() else { return };
    let usage = TextureUsage::all() - TextureUsage::SHADING_RATE;
    let whole = texture(
        &ctx,
        &TextureDesc { extent: [8, 8], mips: 4, usage, debug_name: "whole", ..Default::default() },
    );
    let named = |base_mip, mips, debug_name| {
        view(&ctx, *whole, TextureViewDesc { base_mip, mips, debug_name, ..Default::default() })
    };
    let (head, tail) = (named(0, 2, "head"), named(1, 3, "tail"));
    let fetch = compute_pipeline(&ctx, "layout(local_size_x = 1) in; void main() {}");
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*fetch).unwrap();
    let mut dispatch = |sampled: &[TextureHandle], stored: &[TextureHandle]| {
        let deps = Dependencies { sampled_images: sampled, storage_images: stored, ..Default::default() };
        cmd.dispatch([1, 1, 1], &deps)
    };
    usage_error(dispatch(&[*head], &[*tail]), &["head", "tail", "two ways"]);
    usage_error(dispatch(&[*whole], &[*tail]), &["whole", "tail"]);
    dispatch(&[*tail], &[*head]).unwrap();
    let color = [ColorAttachment::clear(*tail, [0.0; 4])];
    let deps = Dependencies { sampled_images: &[*head], ..Default::default() };
    let pass = RenderPassDesc { color: &color, dependencies: deps, ..Default::default() };
    usage_error(cmd.begin_rendering(&pass).map(drop), &["head", "tail"]);
    let twice = [
        ColorAttachment { mip: 1, ..color[0] },
        ColorAttachment { mip: 2, ..ColorAttachment::clear(*whole, [0.0; 4]) },
    ];
    let pass = RenderPassDesc { color: &twice, ..Default::default() };
    usage_error(cmd.begin_rendering(&pass).map(drop), &["twice"]);
    usage_error(cmd.copy_texture(*head, &region_of(1, 0), *tail, &region_of(0, 0)), &["head", "tail"]);
    ctx.submit(cmd).unwrap();
}

fn from_srgb(byte: u8) -> f32 {
    let encoded = f64::from(byte) / 255.0;
    (if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }) as f32
}

#[test]
fn linear_and_srgb_views_read_the_same_bytes() {
    let Some(ctx) = device() else { return };
    let bytes = [10_u8, 100, 200, 128];
    let formats = [Format::Rgba8Unorm, Format::Rgba8Srgb];
    for own in 0..2 {
        let desc = TextureDesc {
            format: formats[own],
            view_formats: &[formats[1 - own]],
            usage: SHADERS,
            data: Some(&bytes),
            ..Default::default()
        };
        let base = match ctx.create_texture(&desc) {
            Err(Error::Unsupported { .. }) if own == 1 => {
                eprintln!("NOT TESTED, sRGB images that are stored to by another format");
                continue;
            }
            made => made.unwrap(),
        };
        let other =
            view(&ctx, *base, TextureViewDesc { format: Some(formats[1 - own]), ..Default::default() });
        let (linear, srgb) = if own == 0 { (&base, &other) } else { (&other, &base) };
        let [seen, decoded] = [linear, srgb].map(|texture| first_texel(&ctx, texture));
        for channel in 0..4 {
            let expected = f32::from(bytes[channel]) / 255.0;
            assert!((seen[channel] - expected).abs() < 1e-5, "{seen:?}");
            let expected = if channel == 3 { expected } else { from_srgb(bytes[channel]) };
            assert!((decoded[channel] - expected).abs() < 2e-3, "{decoded:?}");
        }
        store(&ctx, linear);
        assert_eq!(ctx.download_texture(**srgb, &TextureRegion::default()).unwrap(), [51, 102, 153, 255]);
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let pipeline = compute_pipeline(&ctx, "layout(local_size_x = 1) in; void main() {}");
        cmd.bind_compute_pipeline(*pipeline).unwrap();
        let deps = Dependencies { storage_images: &[**srgb], ..Default::default() };
        let plain = TextureDesc { format: Format::Rgba8Srgb, usage: SHADERS, ..Default::default() };
        if ctx.create_texture(&plain).is_err() {
            usage_error(cmd.dispatch([1, 1, 1], &deps), &["STORAGE", "Rgba8Srgb"]);
        }
    }
}

/// Stores (0.2, 0.4, 0.6, 1) to texel (0, 0).
fn store(ctx: &Context, texture: &Holder<TextureHandle>) {
    let pipeline = compute_pipeline(
        ctx,
        "layout(local_size_x = 1) in;
         layout(push_constant, scalar) uniform Push { uint to; };
         void main() { imageStore(kImages2D[to], ivec2(0), vec4(0.2, 0.4, 0.6, 1.0)); }",
    );
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.push_constants(&texture.index()).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { storage_images: &[**texture], ..Default::default() }).unwrap();
    ctx.submit(cmd).unwrap();
}

#[test]
fn a_target_is_encoded_in_the_format_of_its_view() {
    let Some(ctx) = device() else { return };
    let desc = TextureDesc {
        view_formats: &[Format::Rgba8Srgb, Format::R32Uint],
        extent: [2, 2],
        usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
        ..Default::default()
    };
    let base = texture(&ctx, &desc);
    let formatted =
        |format| view(&ctx, *base, TextureViewDesc { format: Some(format), ..Default::default() });
    let clear = |target: TextureHandle, load| {
        let color = [ColorAttachment { load, ..ColorAttachment::clear(target, [0.0; 4]) }];
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        drop(cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap());
        ctx.submit(cmd).unwrap();
        ctx.download_texture(*base, &TextureRegion::default()).unwrap()[..4].to_vec()
    };
    let gray = ColorLoadOp::Clear([0.5, 0.5, 0.5, 0.5]);
    let srgb = clear(*formatted(Format::Rgba8Srgb), gray);
    assert!(srgb[..3].iter().all(|byte| (187..=188).contains(byte)), "{srgb:?}");
    assert!((127..=128).contains(&srgb[3]), "{srgb:?}");
    assert!(clear(*base, gray).iter().all(|byte| (127..=128).contains(byte)));
    let word = ColorLoadOp::ClearUint([0x0403_0201; 4]);
    assert_eq!(clear(*formatted(Format::R32Uint), word), [1, 2, 3, 4]);
}

#[test]
fn channels_are_seen_in_the_order_of_the_swizzle() {
    let Some(ctx) = device() else { return };
    let base = texture(
        &ctx,
        &TextureDesc { usage: SHADERS, data: Some(&[51, 102, 153, 204]), ..Default::default() },
    );
    let swizzled = |of, swizzle| view(&ctx, of, TextureViewDesc { swizzle, ..Default::default() });
    let close = |found: [f32; 4], expected: [f32; 4]| {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}, not {expected:?}");
    };
    let gray =
        Swizzle { red: Channel::Green, green: Channel::Green, blue: Channel::Green, alpha: Channel::One };
    let reversed =
        Swizzle { red: Channel::Alpha, green: Channel::Blue, blue: Channel::Green, alpha: Channel::Red };
    let (gray, reversed) = (swizzled(*base, gray), swizzled(*base, reversed));
    close(first_texel(&ctx, &gray), [0.4, 0.4, 0.4, 1.0]);
    close(first_texel(&ctx, &reversed), [0.8, 0.6, 0.4, 0.2]);
    let no_red = Swizzle { red: Channel::Zero, ..Swizzle::IDENTITY };
    let both = swizzled(*reversed, no_red);
    close(first_texel(&ctx, &both), [0.0, 0.6, 0.4, 0.2]);
    let back =
        Swizzle { red: Channel::Alpha, green: Channel::Blue, blue: Channel::Green, alpha: Channel::Red };
    store(&ctx, &swizzled(*reversed, back));
    assert_eq!(ctx.download_texture(*reversed, &TextureRegion::default()).unwrap(), [51, 102, 153, 255]);
    let usage = Some(TextureUsage::STORAGE);
    let stored = TextureViewDesc { texture: Some(*base), swizzle: no_red, usage, ..Default::default() };
    usage_error(ctx.create_texture_view(&stored), &["swizzle", "STORAGE"]);
}

#[test]
fn cubes_are_arrays_and_arrays_are_cubes() {
    let Some(ctx) = device() else { return };
    let layers: Vec<u8> = (0..8_u8).flat_map(|layer| [layer * 20; 16]).collect();
    let array = texture(
        &ctx,
        &TextureDesc {
            kind: TextureKind::D2Array { layers: 8 },
            format: Format::R8Unorm,
            extent: [4, 4],
            data: Some(&layers),
            ..Default::default()
        },
    );
    let cube = view(
        &ctx,
        *array,
        TextureViewDesc { kind: Some(TextureKind::Cube), base_layer: 2, ..Default::default() },
    );
    let sampler = ctx.create_sampler(&lvk::SamplerDesc::default()).unwrap();
    let along = Evaluator::new(
        &ctx,
        "textureBindlessCube(a, b, vec3(i < 2 ? 1 - 2 * int(i & 1) : 0, i / 2 == 1 ? 1 - 2 * int(i & 1) : 0,
             i / 2 == 2 ? 1 - 2 * int(i & 1) : 0))",
    );
    let seen = along.run(&ctx, [cube.index(), sampler.index(), 0], 6, &Dependencies::default());
    let fetch = Evaluator::new(&ctx, "texelFetch(kTextures2DArray[a], ivec3(1, 1, i), 0)");
    let faces = |texture: &Holder<TextureHandle>, count| {
        let found = fetch.run(&ctx, [texture.index(), 0, 0], count, &Dependencies::default());
        found.iter().map(|texel| (texel[0] * 255.0).round() as u32).collect::<Vec<_>>()
    };
    let rounded: Vec<_> = seen.iter().map(|texel| (texel[0] * 255.0).round() as u32).collect();
    assert_eq!(rounded, [40, 60, 80, 100, 120, 140]);
    let kind = Some(TextureKind::D2Array { layers: 3 });
    let sides = view(&ctx, *cube, TextureViewDesc { kind, base_layer: 1, ..Default::default() });
    assert_eq!(faces(&sides, 3), [60, 80, 100]);
    let kind = TextureKind::Cube;
    let desc = TextureDesc {
        kind,
        format: Format::R8Unorm,
        extent: [4, 4],
        data: Some(&layers[..96]),
        ..Default::default()
    };
    let own = texture(&ctx, &desc);
    let kind = Some(TextureKind::D2Array { layers: 6 });
    assert_eq!(
        faces(&view(&ctx, *own, TextureViewDesc { kind, ..Default::default() }), 6),
        [0, 20, 40, 60, 80, 100]
    );
    let rest = view(&ctx, *array, TextureViewDesc { base_layer: 5, ..Default::default() });
    assert_eq!(faces(&rest, 3), [100, 120, 140]);
}

/// Draws what it fetches from the texture in the push constants.
fn fetching(ctx: &Context) -> Holder<RenderPipelineHandle> {
    let fragment = "
        layout(push_constant, scalar) uniform Push { vec4 color; float depth; uint tex; };
        layout(location = 0) out vec4 result;
        void main() { result = textureBindlessFetch2D(tex, ivec2(gl_FragCoord.xy), 0) + color; }";
    let color = [Format::Rgba8Unorm.into()];
    render_pipeline(ctx, COVER, fragment, &RenderPipelineDesc { color: &color, ..Default::default() })
}

/// Layer after layer, each drawn from the one before, in one command buffer.
#[test]
fn a_layer_is_drawn_to_while_another_is_sampled() {
    let Some(ctx) = device() else { return };
    let array = texture(
        &ctx,
        &TextureDesc {
            kind: TextureKind::D2Array { layers: 4 },
            extent: [4, 4],
            usage: TextureUsage::SAMPLED | TextureUsage::TARGET,
            ..Default::default()
        },
    );
    ctx.upload_texture(*array, &region_of(0, 0), &[10; 64]).unwrap();
    let layer = |base_layer| {
        view(&ctx, *array, TextureViewDesc { kind: Some(TextureKind::D2), base_layer, ..Default::default() })
    };
    let layers: Vec<_> = (0..4).map(layer).collect();
    let pipeline = fetching(&ctx);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    for (index, pair) in (1..).zip(layers.windows(2)) {
        // By its own view, and as a layer of the whole.
        let by_view = ColorAttachment::clear(*pair[1], [0.0; 4]);
        let by_layer = ColorAttachment { layer: index, ..ColorAttachment::clear(*array, [0.0; 4]) };
        let color = [if index == 2 { by_layer } else { by_view }];
        let dependencies = Dependencies { sampled_images: &[*pair[0]], ..Default::default() };
        let mut pass = cmd
            .begin_rendering(&RenderPassDesc { color: &color, dependencies, ..Default::default() })
            .unwrap();
        pass.bind_render_pipeline(*pipeline).unwrap();
        let step = (20.0_f32 / 255.0).to_bits();
        pass.push_constants(&[step, step, step, step, 0, pair[0].index()]).unwrap();
        pass.draw(0..3, 0..1).unwrap();
    }
    ctx.submit(cmd).unwrap();
    for index in 0..4_u8 {
        let found = ctx.download_texture(*array, &region_of(0, index.into())).unwrap();
        assert_eq!(found, [10 + 20 * index; 64], "layer {index}");
    }
}

#[test]
fn a_view_outlives_the_handle_of_its_texture() {
    let Some(ctx) = device() else { return };
    for round in 0..4_u8 {
        // Contents of the one may be written at once, those of the other wait for a submission.
        let usage =
            [TextureUsage::SAMPLED, TextureUsage::SAMPLED | TextureUsage::STORAGE][round as usize % 2];
        let base = texture(&ctx, &TextureDesc { data: Some(&[51 * round; 4]), usage, ..Default::default() });
        let first = view(&ctx, *base, TextureViewDesc::default());
        let second = view(&ctx, *first, TextureViewDesc::default());
        let handle = *base;
        drop(base);
        ctx.wait_idle().unwrap();
        // Takes the place of the texture if it is gone.
        let other = texture(&ctx, &TextureDesc { data: Some(&[1; 4]), ..Default::default() });
        let expected = f32::from(round) / 5.0;
        assert!(first_texel(&ctx, &first).iter().all(|seen| (seen - expected).abs() < 1e-5));
        drop(first);
        ctx.wait_idle().unwrap();
        assert!(first_texel(&ctx, &second).iter().all(|seen| (seen - expected).abs() < 1e-5));
        assert_eq!(ctx.download_texture(*second, &TextureRegion::default()).unwrap(), [51 * round; 4]);
        let stale = ctx.create_texture_view(&TextureViewDesc { texture: Some(handle), ..Default::default() });
        assert!(matches!(stale, Err(Error::StaleHandle { kind: "texture", .. })), "{stale:?}");
        drop((second, other));
    }
}

/// Mips and layers of regions count from the view's first ones, in every transfer.
#[test]
fn transfers_count_from_the_first_mip_and_layer_of_a_view() {
    let Some(ctx) = device() else { return };
    let kind = TextureKind::D2Array { layers: 5 };
    let desc = TextureDesc { kind, extent: [16, 16], mips: 4, ..Default::default() };
    let base = texture(&ctx, &desc);
    let part = view(
        &ctx,
        *base,
        TextureViewDesc {
            kind: Some(TextureKind::D2Array { layers: 2 }),
            base_mip: 1,
            mips: 2,
            base_layer: 3,
            ..Default::default()
        },
    );
    for layer in 0..5 {
        for mip in 0..4 {
            ctx.upload_texture(*base, &region_of(mip, layer), &vec![7; 4 << (2 * (4 - mip))]).unwrap();
        }
    }
    let texels = noise(1, 4 * 8 * 8);
    ctx.upload_texture(*part, &region_of(0, 1), &texels).unwrap();
    assert_eq!(ctx.download_texture(*part, &region_of(0, 1)).unwrap(), texels);
    assert_eq!(ctx.download_texture(*base, &region_of(1, 4)).unwrap(), texels);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.copy_texture(*part, &region_of(0, 1), *part, &region_of(0, 0)).unwrap();
    let quarter = TextureRegion { extent: [4, 4], ..region_of(0, 0) };
    cmd.blit_texture(*part, &quarter, *base, &region_of(2, 0), Filter::Nearest).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(ctx.download_texture(*base, &region_of(1, 3)).unwrap(), texels);
    let corner: Vec<u8> = (0..4).flat_map(|row| texels[32 * row..32 * row + 16].to_vec()).collect();
    assert_eq!(ctx.download_texture(*base, &region_of(2, 0)).unwrap(), corner);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.clear_texture(*part, ClearValue::Color([1.0; 4]), &TextureRange::default()).unwrap();
    ctx.submit(cmd).unwrap();
    for layer in 0..5 {
        for mip in 0..4 {
            let cleared = layer >= 3 && (1..3).contains(&mip);
            let found = ctx.download_texture(*base, &region_of(mip, layer)).unwrap();
            assert_eq!(found.iter().all(|byte| *byte == 255), cleared, "mip {mip}, layer {layer}");
        }
    }
    ctx.upload_texture(*part, &region_of(0, 0), &[9; 4 * 64]).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.generate_mipmaps(*part).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(ctx.download_texture(*base, &region_of(2, 3)).unwrap(), [9; 64]);
    assert_eq!(ctx.download_texture(*base, &region_of(3, 3)).unwrap(), [7; 16]);
    let outside = ctx.download_texture(*part, &region_of(2, 0));
    usage_error(outside, &["2 mips and 2 layers"]);
}

#[test]
fn impossible_views_are_typed_errors() {
    let Some(ctx) = device() else { return };
    let array = |extent, layers, view_formats| {
        let kind = TextureKind::D2Array { layers };
        let desc =
            TextureDesc { kind, extent, mips: 0, view_formats, debug_name: "shown", ..Default::default() };
        texture(&ctx, &desc)
    };
    let square = array([8, 8], 7, &[Format::Rgba8Srgb]);
    let oblong = array([8, 4], 7, &[]);
    let refused = |of: TextureHandle, desc: TextureViewDesc<'_>, words: &[&str]| {
        let desc = TextureViewDesc { texture: Some(of), debug_name: "odd one", ..desc };
        let words = [words, &["odd one"]].concat();
        usage_error(ctx.create_texture_view(&desc), &words);
    };
    let none = TextureViewDesc::default();
    let kind = |kind| TextureViewDesc { kind: Some(kind), ..none };
    usage_error(ctx.create_texture_view(&none), &["give the view a texture"]);
    for range in [
        TextureViewDesc { base_mip: 4, ..none },
        TextureViewDesc { mips: 5, ..none },
        TextureViewDesc { base_mip: 3, mips: u32::MAX, ..none },
        TextureViewDesc { base_layer: 7, ..none },
        TextureViewDesc { base_layer: u32::MAX, ..kind(TextureKind::D2) },
        TextureViewDesc { base_layer: 2, ..kind(TextureKind::Cube) },
        kind(TextureKind::D2Array { layers: 8 }),
        kind(TextureKind::D2Array { layers: 0 }),
    ] {
        refused(*square, range, &["shown", "4 mips and 7 layers"]);
    }
    refused(*oblong, kind(TextureKind::Cube), &["shown", "cube"]);
    let format = |format| TextureViewDesc { format: Some(format), ..none };
    refused(*square, format(Format::R32Uint), &["R32Uint", "view_formats"]);
    refused(*oblong, format(Format::Rgba8Srgb), &["Rgba8Srgb", "view_formats"]);
    refused(*square, TextureViewDesc { usage: Some(TextureUsage::STORAGE), ..none }, &["STORAGE"]);
    refused(*square, TextureViewDesc { usage: Some(TextureUsage::empty()), ..none }, &["SAMPLED"]);
    for (format, other) in [
        (Format::Rgba8Unorm, Format::Rg8Unorm),
        (Format::D32Float, Format::R32Float),
        (Format::R32Float, Format::D32Float),
    ] {
        let desc = TextureDesc { format, view_formats: &[other], ..Default::default() };
        usage_error(ctx.create_texture(&desc), &["texels of"]);
    }
    assert!(ctx.create_texture_view(&TextureViewDesc { texture: Some(*square), ..none }).is_ok());
}

/// Views take slots as textures do, and free them.
#[test]
fn running_out_of_slots_for_views_is_an_error_that_passes() {
    let Some(ctx) = device_with(|desc| desc.max_textures = 4) else { return };
    let base = texture(&ctx, &TextureDesc { mips: 1, ..Default::default() });
    let views = [(); 2].map(|()| one_mip(&ctx, *base, 0));
    let desc = TextureViewDesc { texture: Some(*base), debug_name: "one too many", ..Default::default() };
    let error = ctx.create_texture_view(&desc).unwrap_err();
    assert!(matches!(&error, Error::LimitExceeded { object, .. } if object == "one too many"), "{error}");
    drop(views);
    ctx.wait_idle().unwrap();
    assert!(ctx.create_texture_view(&desc).is_ok());
}

#[test]
fn texels_written_through_one_view_are_read_through_another() {
    let Some(ctx) = device() else { return };
    let base = texture(&ctx, &TextureDesc { usage: SHADERS, mips: 1, ..Default::default() });
    let (written, read) = (one_mip(&ctx, *base, 0), one_mip(&ctx, *base, 0));
    store(&ctx, &written);
    let fetch = Evaluator::new(&ctx, "textureBindlessFetch2D(a, ivec2(0), 0)");
    let deps = Dependencies { sampled_images: &[*read], ..Default::default() };
    let seen = fetch.run(&ctx, [read.index(), 0, 0], 1, &deps)[0];
    assert!(seen.iter().zip([0.2, 0.4, 0.6, 1.0]).all(|(a, b)| (a - b).abs() < 1e-5), "{seen:?}");
}

#[test]
fn threads_make_and_drop_views_of_one_texture() {
    let Some(ctx) = device() else { return };
    let base = texture(&ctx, &TextureDesc { data: Some(&[255; 4]), mips: 1, ..Default::default() });
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..5 {
                    let own = one_mip(&ctx, *base, 0);
                    assert_eq!(first_texel(&ctx, &own), [1.0; 4]);
                }
            });
        }
    });
}
