//! Volumes and cube arrays: copied, sampled, stored to, drawn to, and viewed in parts.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    ClearValue, ColorAttachment, ColorLoadOp, Context, Dependencies, DepthAttachment, Error, Filter, Format,
    Holder, RenderPassDesc, TextureDesc, TextureHandle, TextureKind, TextureMemory, TextureRange,
    TextureRegion, TextureUsage, TextureViewDesc,
};
use lvk_tests::compute::{Evaluator, compute_pipeline};
use lvk_tests::device;
use lvk_tests::noise::noise;

const SHADERS: TextureUsage = TextureUsage::SAMPLED.union(TextureUsage::STORAGE);
const NONE: Dependencies<'_> = Dependencies {
    sampled_images: &[],
    storage_images: &[],
    buffers: &[],
    read_buffers: &[],
    acceleration_structures: &[],
    wait_for: &[],
};

fn texture(ctx: &Context, desc: &TextureDesc<'_>) -> Holder<TextureHandle> {
    ctx.create_texture(desc).unwrap()
}

/// A volume of floats.
fn volume(ctx: &Context, [width, height, depth]: [u32; 3], values: &[f32]) -> Holder<TextureHandle> {
    let desc = TextureDesc {
        kind: TextureKind::D3 { depth },
        format: Format::R32Float,
        extent: [width, height],
        usage: SHADERS,
        data: Some(bytemuck::cast_slice(values)),
        ..Default::default()
    };
    texture(ctx, &desc)
}

fn floats(ctx: &Context, texture: TextureHandle, region: &TextureRegion) -> Vec<f32> {
    bytemuck::pod_collect_to_vec(&ctx.download_texture(texture, region).unwrap())
}

fn mip(mip: u32) -> TextureRegion {
    TextureRegion { mip, ..Default::default() }
}

fn slice(z: u32) -> TextureRegion {
    TextureRegion { z, depth: 1, ..Default::default() }
}

fn values(seed: u32, count: usize) -> Vec<f32> {
    noise(seed, count).into_iter().map(f32::from).collect()
}

#[test]
fn every_box_of_every_mip_of_a_volume_is_a_region_of_its_own() {
    let Some(ctx) = device() else { return };
    let sizes = [[13_u32, 7, 9], [6, 3, 4], [3, 1, 2], [1, 1, 1]];
    let kind = TextureKind::D3 { depth: 9 };
    let desc = TextureDesc { kind, extent: [13, 7], mips: 0, format: Format::R32Float, ..Default::default() };
    let texture = texture(&ctx, &desc);
    let mut expected: Vec<_> =
        (0..4).map(|seed| values(seed, sizes[seed as usize].iter().product::<u32>() as usize)).collect();
    for (level, texels) in (0..).zip(&expected) {
        ctx.upload_texture(*texture, &mip(level), bytemuck::cast_slice(texels)).unwrap();
    }
    let part = TextureRegion { mip: 1, offset: [2, 1], extent: [3, 2], z: 1, depth: 2, ..Default::default() };
    let inner = values(9, 12);
    ctx.upload_texture(*texture, &part, bytemuck::cast_slice(&inner)).unwrap();
    for (index, value) in inner.iter().enumerate() {
        let (x, y, z) = (2 + index % 3, 1 + index / 3 % 2, 1 + index / 6);
        expected[1][(z * 3 + y) * 6 + x] = *value;
    }
    for (level, texels) in (0..).zip(&expected) {
        assert_eq!(floats(&ctx, *texture, &mip(level)), *texels, "mip {level}");
    }
    assert_eq!(floats(&ctx, *texture, &part), inner);
    assert_eq!(floats(&ctx, *texture, &slice(8)), expected[0][8 * 91..]);
    let rest = TextureRegion { z: 7, ..Default::default() };
    assert_eq!(floats(&ctx, *texture, &rest), expected[0][7 * 91..]);
}

#[test]
fn generated_mips_of_a_volume_are_the_means_of_eight_texels() {
    let Some(ctx) = device() else { return };
    let (mut side, mut expected) = (8_usize, values(3, 512));
    let desc = TextureDesc {
        kind: TextureKind::D3 { depth: 8 },
        format: Format::R32Float,
        extent: [8, 8],
        mips: 0,
        data: Some(bytemuck::cast_slice(&expected)),
        generate_mips: true,
        ..Default::default()
    };
    let Ok(texture) = ctx.create_texture(&desc) else {
        eprintln!("NOT TESTED, volumes of this format cannot be scaled");
        return;
    };
    for level in 1..4 {
        expected = eighth(&expected, side);
        side /= 2;
        let found = floats(&ctx, *texture, &mip(level));
        assert_eq!(found.len(), expected.len());
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1.0), "{found:?}, not {expected:?}");
    }
}

/// Halves a cube of this side.
fn eighth(texels: &[f32], side: usize) -> Vec<f32> {
    let half = side / 2;
    let mean = |index: usize| {
        let [x, y, z] = [index % half, index / half % half, index / half / half];
        let corner = |i: usize| {
            let [x, y, z] = [2 * x + (i & 1), 2 * y + (i >> 1 & 1), 2 * z + (i >> 2)];
            texels[(z * side + y) * side + x]
        };
        (0..8).map(corner).sum::<f32>() / 8.0
    };
    (0..half * half * half).map(mean).collect()
}

#[test]
fn shaders_sample_and_store_volumes() {
    let Some(ctx) = device() else { return };
    let sampler = ctx.create_sampler(&lvk::SamplerDesc::default()).unwrap();
    let texels: Vec<f32> = (0..24_u8).map(f32::from).collect();
    let made = volume(&ctx, [2, 3, 4], &texels);
    let words = [made.index(), sampler.index(), 0];
    let fetch = "texelFetch(kTextures3D[a], ivec3(i % 2, i / 2 % 3, i / 6), 0)";
    let fetched = Evaluator::new(&ctx, fetch).run(&ctx, words, 24, &NONE);
    assert_eq!(fetched.iter().map(|texel| texel[0]).collect::<Vec<_>>(), texels);
    let size = Evaluator::new(&ctx, "vec4(textureBindlessSize3D(a), 0)").run(&ctx, words, 1, &NONE);
    assert_eq!(size, [[2.0, 3.0, 4.0, 0.0]]);
    let between = Evaluator::new(&ctx, "textureBindless3D(a, b, vec3(0.25, 0.5 / 3.0, 0.5))");
    let seen = between.run(&ctx, words, 1, &NONE)[0][0];
    assert!((seen - 9.0).abs() < 0.05, "{seen} is not halfway between slices 1 and 2");
    let write = Evaluator::new(
        &ctx,
        "vec4(1); imageStore(kImages3D[a], ivec3(i % 2, i / 2 % 3, i / 6), vec4(100 - i))",
    );
    write.run(&ctx, words, 24, &Dependencies { storage_images: &[*made], ..NONE });
    let expected: Vec<f32> = texels.iter().map(|value| 100.0 - value).collect();
    assert_eq!(floats(&ctx, *made, &mip(0)), expected);
}

/// The mips of a volume by a shader that samples one and stores the next.
#[test]
fn a_mip_of_a_volume_is_sampled_while_the_next_is_stored() {
    let Some(ctx) = device() else { return };
    let (mut side, mut expected) = (8_u32, values(4, 512));
    let desc = TextureDesc {
        kind: TextureKind::D3 { depth: 8 },
        format: Format::R32Float,
        extent: [8, 8],
        mips: 0,
        usage: SHADERS,
        data: Some(bytemuck::cast_slice(&expected)),
        ..Default::default()
    };
    let chain = texture(&ctx, &desc);
    let level = |base_mip| {
        let desc = TextureViewDesc { texture: Some(*chain), base_mip, mips: 1, ..Default::default() };
        ctx.create_texture_view(&desc).unwrap()
    };
    let levels: Vec<_> = (0..4).map(level).collect();
    let halve = compute_pipeline(
        &ctx,
        "layout(local_size_x = 1) in;
         layout(push_constant, scalar) uniform Push { uint from; uint to; };
         void main() {
             ivec3 p = ivec3(gl_GlobalInvocationID);
             vec4 sum = vec4(0.0);
             for (int i = 0; i < 8; i++) sum += texelFetch(kTextures3D[from], 2 * p + ivec3(i & 1, i >> 1 & 1, i >> 2), 0);
             imageStore(kImages3D[to], p, sum * 0.125);
         }",
    );
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*halve).unwrap();
    for pair in levels.windows(2) {
        side /= 2;
        cmd.push_constants(&[pair[0].index(), pair[1].index()]).unwrap();
        let deps = Dependencies { sampled_images: &[*pair[0]], storage_images: &[*pair[1]], ..NONE };
        cmd.dispatch([side; 3], &deps).unwrap();
    }
    ctx.submit(cmd).unwrap();
    for level in 1..4 {
        expected = eighth(&expected, 16 >> level);
        assert_eq!(floats(&ctx, *chain, &mip(level)), expected, "mip {level}");
    }
}

#[test]
fn slices_are_copied_to_layers_and_back() {
    let Some(ctx) = device() else { return };
    let texels = values(5, 4 * 4 * 4);
    let made = volume(&ctx, [4, 4, 4], &texels);
    let kind = TextureKind::D2Array { layers: 2 };
    let desc = TextureDesc { kind, format: Format::R32Float, extent: [4, 4], ..Default::default() };
    let array = texture(&ctx, &desc);
    let other = volume(&ctx, [4, 4, 4], &[0.0; 64]);
    let layer = |layer| TextureRegion { layer, ..Default::default() };
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.copy_texture(*made, &slice(2), *array, &layer(1)).unwrap();
    cmd.copy_texture(*array, &layer(1), *other, &slice(3)).unwrap();
    let upper = TextureRegion { z: 2, ..Default::default() };
    cmd.copy_texture(*made, &upper, *other, &TextureRegion::default()).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(floats(&ctx, *array, &layer(1)), texels[32..48]);
    let expected = [&texels[32..64], &[0.0; 16], &texels[32..48]].concat();
    assert_eq!(floats(&ctx, *other, &mip(0)), expected);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let too_deep = cmd.copy_texture(*made, &mip(0), *array, &layer(0)).unwrap_err();
    assert!(matches!(too_deep, Error::InvalidUsage { .. }), "{too_deep}");
    cmd.blit_texture(*made, &slice(1), *other, &slice(2), Filter::Nearest).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(floats(&ctx, *other, &slice(2)), texels[16..32]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.clear_texture(*other, ClearValue::Color([0.5; 4]), &TextureRange::default()).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(floats(&ctx, *other, &mip(0)), [0.5; 64]);
}

#[test]
fn passes_draw_to_slices() {
    let Some(ctx) = device() else { return };
    let kind = TextureKind::D3 { depth: 4 };
    let usage = TextureUsage::TARGET | TextureUsage::SAMPLED;
    let made = texture(&ctx, &TextureDesc { kind, extent: [2, 2], usage, mips: 2, ..Default::default() });
    let draw = |places: &[(u32, u32, f32)]| {
        let color: Vec<_> = places
            .iter()
            .map(|(mip, layer, gray)| ColorAttachment {
                mip: *mip,
                layer: *layer,
                ..ColorAttachment::clear(*made, [*gray; 4])
            })
            .collect();
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).map(drop)?;
        ctx.submit(cmd)
    };
    draw(&[(0, 0, 0.0), (0, 3, 1.0)]).unwrap();
    draw(&[(0, 1, 0.2)]).unwrap();
    draw(&[(0, 2, 0.4)]).unwrap();
    draw(&[(1, 1, 0.6)]).unwrap();
    for (z, byte) in [(0, 0), (1, 51), (2, 102), (3, 255)] {
        assert_eq!(ctx.download_texture(*made, &slice(z)).unwrap(), [byte; 16], "slice {z}");
    }
    let last = TextureRegion { mip: 1, z: 1, ..Default::default() };
    assert_eq!(ctx.download_texture(*made, &last).unwrap(), [153; 4]);
    for (places, words) in [
        (&[(0, 4, 0.0)][..], "slice 4"),
        (&[(1, 2, 0.0)][..], "slice 2"),
        (&[(0, 1, 0.0), (0, 1, 0.0)][..], "twice"),
    ] {
        let error = draw(places).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
    }
}

#[test]
fn arrays_of_cubes_are_sampled_stored_to_and_seen_in_parts() {
    let Some(ctx) = device() else { return };
    let kind = TextureKind::CubeArray { cubes: 3 };
    let faces: Vec<f32> = (0..18_u8).flat_map(|face| [f32::from(face); 4]).collect();
    let data = Some(bytemuck::cast_slice(&faces));
    let desc = TextureDesc {
        kind,
        format: Format::R32Float,
        extent: [2, 2],
        usage: SHADERS,
        data,
        ..Default::default()
    };
    let cubes = match ctx.create_texture(&desc) {
        Err(error) if !ctx.capabilities().cube_arrays => {
            assert!(matches!(error, Error::Unsupported { .. }), "{error}");
            eprintln!("NOT TESTED, the device has no arrays of cubes");
            return;
        }
        made => made.unwrap(),
    };
    let sampler = ctx.create_sampler(&lvk::SamplerDesc::default()).unwrap();
    let sample = compute_pipeline(
        &ctx,
        "layout(local_size_x = 1) in;
         LVK_TEXTURES(textureCubeArray, kTexturesCubeArray);
         layout(buffer_reference, scalar) writeonly buffer Result { vec4 values[]; };
         layout(push_constant, scalar) uniform Push { Result result; uint tex; uint smp; };
         void main() {
             uint i = gl_GlobalInvocationID.x;
             uint face = i % 6;
             vec3 dir = vec3(face == 0, face == 2, face == 4) - vec3(face == 1, face == 3, face == 5);
             float seen = textureBindlessCubeArray(tex, smp, vec4(dir, i / 6)).r;
             float lod = textureBindlessCubeArrayLod(tex, smp, vec4(dir, i / 6), 0.0).r;
             result.values[i] = vec4(seen, lod, textureBindlessSizeCubeArray(tex).z, 0.0);
         }",
    );
    let seen = |texture: &Holder<TextureHandle>, count: u32| {
        let result = lvk_tests::compute::vec4_buffer(&ctx, count);
        let address = ctx.buffer_address(*result).unwrap();
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.bind_compute_pipeline(*sample).unwrap();
        let words = [address as u32, (address >> 32) as u32, texture.index(), sampler.index()];
        cmd.push_constants(&words).unwrap();
        let deps = Dependencies { buffers: &[*result], sampled_images: &[**texture], ..NONE };
        cmd.dispatch([count, 1, 1], &deps).unwrap();
        ctx.submit(cmd).unwrap();
        lvk_tests::compute::read_vec4(&ctx, *result, count)
    };
    let rows = |first: u8, count: u8, cubes: f32| -> Vec<[f32; 4]> {
        (first..first + count).map(|face| [f32::from(face), f32::from(face), cubes, 0.0]).collect()
    };
    assert_eq!(seen(&cubes, 18), rows(0, 18, 3.0));
    let view = |desc: TextureViewDesc<'_>| {
        ctx.create_texture_view(&TextureViewDesc { texture: Some(*cubes), ..desc }).unwrap()
    };
    let rest = view(TextureViewDesc { base_layer: 6, ..Default::default() });
    assert_eq!(seen(&rest, 12), rows(6, 12, 2.0));
    let one = view(TextureViewDesc { kind: Some(TextureKind::Cube), base_layer: 3, ..Default::default() });
    let toward_z = Evaluator::new(&ctx, "textureBindlessCube(a, b, vec3(0, 0, 1))");
    assert_eq!(toward_z.run(&ctx, [one.index(), sampler.index(), 0], 1, &NONE)[0][0], 7.0);
    let write = Evaluator::new(&ctx, "vec4(1); imageStore(kImages2DArray[a], ivec3(1, 1, i), vec4(50 + i))");
    write.run(&ctx, [cubes.index(), 0, 0], 18, &Dependencies { storage_images: &[*cubes], ..NONE });
    for layer in 0..18_u8 {
        let found = floats(&ctx, *cubes, &TextureRegion { layer: layer.into(), ..Default::default() });
        let face = f32::from(layer);
        assert_eq!(found, [face, face, face, 50.0 + face]);
    }
}

#[test]
fn impossible_volumes_and_cubes_are_typed_errors() {
    let Some(ctx) = device() else { return };
    let limits = ctx.capabilities().limits;
    let make = |desc: TextureDesc<'_>| ctx.create_texture(&desc).map(drop);
    let d3 = |depth| TextureDesc { kind: TextureKind::D3 { depth }, ..Default::default() };
    let cubes = |cubes| TextureDesc { kind: TextureKind::CubeArray { cubes }, ..Default::default() };
    for (index, desc) in [
        d3(0),
        TextureDesc { mips: 4, ..d3(7) },
        TextureDesc { data: Some(&[0; 4]), ..d3(2) },
        cubes(0),
        TextureDesc { extent: [2, 1], ..cubes(1) },
    ]
    .into_iter()
    .enumerate()
    {
        let error = make(desc).unwrap_err();
        assert!(matches!(error, Error::InvalidUsage { .. }), "{index}: {error}");
    }
    let side = limits.max_texture_3d + 1;
    for desc in [
        d3(side),
        d3(u32::MAX),
        TextureDesc { extent: [side, 1], ..d3(1) },
        TextureDesc { extent: [1, side], ..d3(1) },
        cubes(limits.max_texture_layers / 6 + 1),
        cubes(u32::MAX),
    ] {
        let error = make(desc).unwrap_err();
        let no_cubes = !ctx.capabilities().cube_arrays && matches!(error, Error::Unsupported { .. });
        assert!(matches!(error, Error::LimitExceeded { .. }) || no_cubes, "{error}");
    }
    let made = texture(&ctx, &TextureDesc { mips: 0, ..d3(4) });
    let flat = texture(&ctx, &TextureDesc::default());
    let view = |of: TextureHandle, kind, base_mip| {
        let desc = TextureViewDesc { texture: Some(of), kind, base_mip, ..Default::default() };
        ctx.create_texture_view(&desc).map(drop)
    };
    view(*made, None, 1).unwrap();
    view(*made, Some(TextureKind::D3 { depth: 2 }), 1).unwrap();
    let refused = [
        view(*made, Some(TextureKind::D2), 0),
        view(*made, Some(TextureKind::D3 { depth: 2 }), 0),
        view(*flat, Some(TextureKind::D3 { depth: 1 }), 0),
        ctx.upload_texture(*made, &TextureRegion { z: 4, ..mip(0) }, &[0; 4]),
        ctx.upload_texture(*made, &TextureRegion { z: u32::MAX, depth: 2, ..mip(0) }, &[0; 8]),
        ctx.upload_texture(*made, &TextureRegion { depth: 3, ..mip(1) }, &[0; 12]),
        ctx.upload_texture(*made, &TextureRegion { layer: 1, ..mip(0) }, &[0; 16]),
        ctx.upload_texture(*flat, &slice(1), &[0; 4]),
        ctx.upload_texture(*flat, &TextureRegion { depth: 2, ..mip(0) }, &[0; 8]),
    ];
    for (index, result) in refused.into_iter().enumerate() {
        assert!(matches!(result, Err(Error::InvalidUsage { .. })), "{index}: {result:?}");
    }
}

/// Samples that both colour and depth may have, more than one.
fn sample_counts(ctx: &Context) -> Vec<u32> {
    let limits = ctx.capabilities().limits;
    let both = limits.color_samples & limits.depth_samples;
    (1..7).map(|bit| 1 << bit).filter(|count| both & count != 0).collect()
}

fn multisampled(format: Format, samples: u32) -> TextureDesc<'static> {
    let usage = TextureUsage::TARGET | TextureUsage::SAMPLED;
    TextureDesc { format, samples, usage, extent: [8, 4], debug_name: "samples", ..Default::default() }
}

#[test]
fn every_sample_of_a_cleared_texture_has_the_colour_and_resolves_to_it() {
    let Some(ctx) = device() else { return };
    let color = [0.25, 0.5, 0.75, 1.0];
    let fetch = Evaluator::new(&ctx, "textureBindlessFetch2DMS(a, ivec2(i % 8, i / 8 % 4), int(i / 32))");
    let shape = Evaluator::new(&ctx, "vec4(textureBindlessSize2DMS(a), textureBindlessSamples2DMS(a), 0)");
    let counts = sample_counts(&ctx);
    assert!(counts.contains(&4), "Vulkan promises four samples, not only {counts:?}");
    for samples in counts {
        let kind = TextureKind::D2Array { layers: 2 };
        let layers = texture(&ctx, &TextureDesc { kind, ..multisampled(Format::Rgba32Float, samples) });
        let view = TextureViewDesc {
            texture: Some(*layers),
            kind: Some(TextureKind::D2),
            base_layer: 1,
            ..Default::default()
        };
        let view = ctx.create_texture_view(&view).unwrap();
        let copy = texture(&ctx, &multisampled(Format::Rgba32Float, samples));
        let (format, extent) = (Format::Rgba32Float, [9, 9]);
        let resolved = texture(&ctx, &TextureDesc { format, extent, ..Default::default() });
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.clear_texture(*resolved, ClearValue::Color([2.0; 4]), &TextureRange::default()).unwrap();
        cmd.clear_texture(*layers, ClearValue::Color([0.0; 4]), &TextureRange::default()).unwrap();
        cmd.clear_texture(*view, ClearValue::Color(color), &TextureRange::default()).unwrap();
        let layer = TextureRegion { layer: 1, ..Default::default() };
        cmd.copy_texture(*layers, &layer, *copy, &TextureRegion::default()).unwrap();
        let from = TextureRegion { offset: [2, 1], extent: [3, 2], layer: 1, ..Default::default() };
        let to = TextureRegion { offset: [5, 6], ..Default::default() };
        cmd.resolve_texture(*layers, &from, *resolved, &to).unwrap();
        ctx.submit(cmd).unwrap();
        for seen in [&view, &copy] {
            let words = [seen.index(), 0, 0];
            assert_eq!(fetch.run(&ctx, words, 32 * samples, &NONE), vec![color; 32 * samples as usize]);
            assert_eq!(shape.run(&ctx, words, 1, &NONE), [[8.0, 4.0, samples as f32, 0.0]]);
        }
        let found = floats(&ctx, *resolved, &TextureRegion::default());
        for (i, texel) in found.chunks(4).enumerate() {
            let inside = (5..8).contains(&(i % 9)) && (6..8).contains(&(i / 9));
            assert_eq!(texel, if inside { color } else { [2.0; 4] }, "{i}");
        }
    }
}

#[test]
fn passes_clear_several_samples_of_colour_and_depth() {
    let Some(ctx) = device() else { return };
    let fetch = Evaluator::new(&ctx, "textureBindlessFetch2DMS(a, ivec2(i % 8, i / 8 % 4), int(i / 32))");
    for samples in sample_counts(&ctx) {
        let color = texture(&ctx, &multisampled(Format::Rgba8Unorm, samples));
        let depth = texture(&ctx, &multisampled(Format::D32Float, samples));
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let pass = RenderPassDesc {
            color: &[ColorAttachment::clear(*color, [1.0, 0.0, 0.0, 1.0])],
            depth: Some(DepthAttachment::clear(*depth, 0.5)),
            ..Default::default()
        };
        drop(cmd.begin_rendering(&pass).unwrap());
        ctx.submit(cmd).unwrap();
        let seen =
            |texture: &Holder<TextureHandle>| fetch.run(&ctx, [texture.index(), 0, 0], 32 * samples, &NONE);
        assert!(seen(&color).iter().all(|texel| *texel == [1.0, 0.0, 0.0, 1.0]));
        assert!(seen(&depth).iter().all(|texel| texel[0] == 0.5));
    }
}

#[test]
fn usages_that_several_samples_exclude_are_errors() {
    let Some(ctx) = device() else { return };
    let samples = 4;
    let plain = multisampled(Format::Rgba8Unorm, samples);
    let wrong = [
        TextureDesc { samples: 0, ..plain },
        TextureDesc { samples: 3, ..plain },
        TextureDesc { samples: 128, ..plain },
        TextureDesc { mips: 0, ..plain },
        TextureDesc { mips: 2, ..plain },
        TextureDesc { kind: TextureKind::Cube, extent: [4, 4], ..plain },
        TextureDesc { kind: TextureKind::D3 { depth: 2 }, ..plain },
        TextureDesc { usage: TextureUsage::STORAGE, ..plain },
        TextureDesc { data: Some(&[0; 128]), ..plain },
    ];
    for (index, desc) in wrong.iter().enumerate() {
        let error = ctx.create_texture(desc).unwrap_err();
        assert!(
            matches!(&error, Error::InvalidUsage { object, .. } if object == "samples"),
            "{index}: {error}"
        );
    }
    let known = ctx.capabilities().limits.color_samples;
    if let Some(unknown) = (1..7).map(|bit| 1 << bit).find(|count| known & count == 0) {
        let error = ctx.create_texture(&multisampled(Format::Rgba8Unorm, unknown)).unwrap_err();
        assert!(matches!(&error, Error::Unsupported { what, .. } if what.contains("'samples'")), "{error}");
    }
    let (many, one) = (texture(&ctx, &plain), texture(&ctx, &TextureDesc { samples: 1, ..plain }));
    let floats = texture(&ctx, &TextureDesc { format: Format::Rgba16Float, samples: 1, ..plain });
    let depth = texture(&ctx, &multisampled(Format::D32Float, samples));
    let flat = texture(&ctx, &TextureDesc { samples: 1, ..multisampled(Format::D32Float, 1) });
    let buffer = lvk::BufferDesc { size_bytes: 128, ..Default::default() };
    let buffer = ctx.create_buffer(&buffer).unwrap();
    let whole = TextureRegion::default();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let (color, clear) = (ColorAttachment::clear(*many, [0.0; 4]), DepthAttachment::clear(*flat, 1.0));
    let pass = RenderPassDesc { color: &[color], depth: Some(clear), ..Default::default() };
    let results = [
        cmd.begin_rendering(&pass).map(drop),
        ctx.upload_texture(*many, &whole, &[0; 128]),
        ctx.download_texture(*many, &whole).map(drop),
        cmd.copy_buffer_to_texture(*buffer, 0, *many, &whole),
        cmd.copy_texture_to_buffer(*many, &whole, *buffer, 0),
        cmd.copy_texture(*many, &whole, *one, &whole),
        cmd.blit_texture(*many, &whole, *one, &whole, Filter::Nearest),
        cmd.blit_texture(*one, &whole, *many, &whole, Filter::Nearest),
        cmd.generate_mipmaps(*many),
        cmd.resolve_texture(*one, &whole, *many, &whole),
        cmd.resolve_texture(*one, &whole, *one, &whole),
        cmd.resolve_texture(*many, &whole, *floats, &whole),
        cmd.resolve_texture(*depth, &whole, *flat, &whole),
        cmd.resolve_texture(*many, &TextureRegion { offset: [8, 0], ..whole }, *one, &whole),
    ];
    for (index, result) in results.into_iter().enumerate() {
        assert!(matches!(result, Err(Error::InvalidUsage { .. })), "{index}: {result:?}");
    }
}

#[test]
fn transient_targets_live_in_their_pass_only() {
    let Some(ctx) = device() else { return };
    let usage = TextureUsage::TARGET;
    let memory = TextureMemory::Transient;
    let plain = TextureDesc { usage, memory, extent: [4, 4], debug_name: "transient", ..Default::default() };
    let color = texture(&ctx, &plain);
    let depth = texture(&ctx, &TextureDesc { format: Format::D32Float, ..plain });
    let cleared = ColorAttachment { store: false, ..ColorAttachment::clear(*color, [1.0; 4]) };
    let deep = DepthAttachment { store: false, ..DepthAttachment::clear(*depth, 1.0) };
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let pass = RenderPassDesc { color: &[cleared], depth: Some(deep), ..Default::default() };
    drop(cmd.begin_rendering(&pass).unwrap());
    let whole = TextureRegion::default();
    let stored =
        RenderPassDesc { color: &[ColorAttachment { store: true, ..cleared }], ..Default::default() };
    let loaded = ColorAttachment { load: ColorLoadOp::Load, ..cleared };
    let loaded = RenderPassDesc { color: &[loaded], ..Default::default() };
    let kept = RenderPassDesc { depth: Some(DepthAttachment { store: true, ..deep }), ..Default::default() };
    let other = texture(&ctx, &TextureDesc { extent: [4, 4], ..Default::default() });
    let results = [
        cmd.begin_rendering(&stored).map(drop),
        cmd.begin_rendering(&loaded).map(drop),
        cmd.begin_rendering(&kept).map(drop),
        cmd.copy_texture(*color, &whole, *other, &whole),
        cmd.copy_texture(*other, &whole, *color, &whole),
        cmd.clear_texture(*color, ClearValue::Color([0.0; 4]), &TextureRange::default()),
        ctx.upload_texture(*color, &whole, &[0; 64]),
        ctx.download_texture(*color, &whole).map(drop),
        ctx.create_texture(&TextureDesc { usage: usage | TextureUsage::SAMPLED, ..plain }).map(drop),
        ctx.create_texture(&TextureDesc { data: Some(&[0; 64]), ..plain }).map(drop),
    ];
    for (index, result) in results.into_iter().enumerate() {
        assert!(
            matches!(&result, Err(Error::InvalidUsage { object, .. }) if object == "transient"),
            "{index}: {result:?}"
        );
    }
    ctx.submit(cmd).unwrap();
}
