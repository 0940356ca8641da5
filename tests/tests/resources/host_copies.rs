//! Initial texture contents by host image copies: bit for bit those of GPU copies, without a wait.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    Context, Dependencies, DeviceProfile, Format, OptionalFeature, Queue, TextureDesc, TextureKind,
    TextureRegion, TextureUsage,
};
use lvk_tests::compute::Evaluator;
use lvk_tests::device::TestDevice;
use lvk_tests::noise::noise;
use lvk_tests::queues::{for_each_queue_request, submit_on};
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{device, device_with};

/// The device with host copies, and without; `None`, loudly, where it does not use them.
fn both() -> Option<[TestDevice; 2]> {
    let hidden = OptionalFeature::HostImageCopy;
    let mut profile = DeviceProfile::default();
    profile.hidden = profile.hidden.with(hidden);
    let (by_host, staged) = (device()?, device_with(|desc| desc.profile = Some(&profile))?);
    assert!(!staged.capabilities().host_image_copy && !staged.capabilities().has(hidden));
    if !by_host.capabilities().host_image_copy {
        let name = &by_host.capabilities().device_name;
        assert!(
            !by_host.capabilities().is_cpu || !by_host.capabilities().has(hidden),
            "{name} should use them"
        );
        eprintln!("NOT TESTED, {name} fills textures by staging memory");
        return None;
    }
    Some([by_host, staged])
}

fn kinds() -> [(TextureKind, [u32; 2]); 6] {
    [
        (TextureKind::D1, [37, 1]),
        (TextureKind::D2, [37, 22]),
        (TextureKind::D2Array { layers: 3 }, [21, 18]),
        (TextureKind::D3 { depth: 7 }, [13, 10]),
        (TextureKind::Cube, [17, 17]),
        (TextureKind::CubeArray { cubes: 2 }, [9, 9]),
    ]
}

/// All bytes of a texture, mip after mip.
fn contents(ctx: &Context, desc: &TextureDesc<'_>, mips: u32) -> Vec<u8> {
    let texture = ctx.create_texture(desc).unwrap();
    let mip = |mip| TextureRegion { mip, layers: 0, ..TextureRegion::default() };
    (0..mips).flat_map(|number| ctx.download_texture(*texture, &mip(number)).unwrap()).collect()
}

fn bytes(format: Format, kind: TextureKind, extent: [u32; 2], mips: u32) -> u64 {
    let of_mip = |mip: u32| {
        let [width, height] = extent.map(|side| (side >> mip).max(1));
        format.bytes([width, height, (kind.depth() >> mip).max(1)]) * u64::from(kind.layers())
    };
    (0..mips).map(of_mip).sum()
}

/// Fills each kind of texture in each format both ways. Answers how many were compared.
fn compare([by_host, staged]: &[TestDevice; 2]) -> usize {
    let mut compared = 0;
    for (seed, format) in (0..).zip(Format::ALL.iter().copied().filter(|format| !format.is_yuv())) {
        for (number, (kind, extent)) in (0..).zip(kinds()) {
            // Plain images in all ways, other kinds in turn.
            let ways: &[(u32, u32)] = match kind {
                TextureKind::D2 => &[(1, 0), (3, 0), (3, 2)],
                _ if (seed + number) % 3 == 0 => &[(3, 0)],
                _ => &[],
            };
            for (mips, data_mips) in ways.iter().copied() {
                let count = bytes(format, kind, extent, if data_mips == 0 { mips } else { data_mips });
                let mut data = noise(seed, count as usize);
                if matches!(format, Format::D32Float | Format::D32FloatS8) {
                    data.chunks_exact_mut(4).for_each(|texel| {
                        let depth = f32::from(texel[0]) / 255.0;
                        texel.copy_from_slice(&depth.to_le_bytes());
                    });
                }
                let desc = TextureDesc {
                    kind,
                    format,
                    extent,
                    mips,
                    data_mips,
                    data: Some(&data),
                    ..TextureDesc::default()
                };
                if staged.supports_texture(&desc).is_err() {
                    continue;
                }
                let read = if data_mips == 0 { mips } else { data_mips };
                let mut pair = [by_host, staged].map(|ctx| contents(ctx, &desc, read));
                if matches!(format, Format::D24UnormS8 | Format::X8D24Unorm) {
                    pair.iter_mut()
                        .flat_map(|bytes| bytes.chunks_exact_mut(4))
                        .for_each(|texel| texel[3] = 0);
                }
                assert!(pair[0] == pair[1], "{format:?} {kind:?}, {mips} mips, data for {data_mips}");
                compared += 1;
            }
        }
    }
    compared
}

#[test]
fn every_format_and_kind_is_filled_the_same() {
    let Some(pair) = both() else { return };
    let compared = compare(&pair);
    assert!(compared > 200, "{compared}");
}

#[test]
fn another_driver_fills_the_same() {
    on_swiftshader(another_driver_fills_the_same, || {
        let Some(pair) = both() else { return };
        let compared = compare(&pair);
        assert!(compared > 200, "{compared}");
    });
}

/// Nothing is recorded for them: there is nothing to submit, and shaders see them in the next submission.
#[test]
fn contents_are_there_without_a_submission() {
    let Some([by_host, staged]) = both() else { return };
    for (ctx, is_by_host) in [(&by_host, true), (&staged, false)] {
        let fetch = Evaluator::new(ctx, "textureBindlessFetch2D(a, ivec2(2, 1), 0)");
        ctx.wait_idle().unwrap();
        let before = ctx.flush().unwrap();
        let data: Vec<u8> = (0..4 * 16).collect();
        let desc = TextureDesc { extent: [4, 4], data: Some(&data), ..TextureDesc::default() };
        let texture = ctx.create_texture(&desc).unwrap();
        assert_eq!(ctx.flush().unwrap() == before, is_by_host, "a submission was made");
        let found = fetch.run(ctx, [texture.index(), 0, 0], 1, &Dependencies::default())[0];
        let expected = [24, 25, 26, 27].map(|byte: u8| f32::from(byte) / 255.0);
        assert!(
            found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-4),
            "{found:?}"
        );
    }
}

/// Whichever queue is the first to use them.
#[test]
fn every_queue_takes_them_over() {
    if both().is_none() {
        return;
    }
    for_each_queue_request(|ctx| {
        let (data, whole) = (noise(5, 4 * 64), TextureRegion::default());
        let desc = TextureDesc { extent: [8, 8], data: Some(&data), ..TextureDesc::default() };
        for queue in Queue::ALL {
            let from = ctx.create_texture(&desc).unwrap();
            let to = ctx.create_texture(&TextureDesc { data: None, ..desc }).unwrap();
            submit_on(ctx, queue, |cmd| cmd.copy_texture(*from, &whole, *to, &whole).unwrap());
            let fetch = Evaluator::new(ctx, "textureBindlessFetch2D(a, ivec2(0, 0), 0)");
            let seen = fetch.run(ctx, [from.index(), 0, 0], 1, &Dependencies::default())[0][0];
            assert!((seen - f32::from(data[0]) / 255.0).abs() < 1e-4, "{queue:?}: {seen}");
            assert!(ctx.download_texture(*to, &whole).unwrap() == data, "{queue:?}");
        }
    });
}

/// Textures written by host copies can be uploaded to, copied from and sampled like all others.
#[test]
fn such_textures_are_like_any_texture_afterwards() {
    let Some(pair) = both() else { return };
    let [data, more] = [1, 2].map(|seed| noise(seed, 4 * 64));
    let [first, second] = pair.each_ref().map(|ctx| {
        let desc = TextureDesc { extent: [8, 8], data: Some(&data), ..TextureDesc::default() };
        let (one, two) = (ctx.create_texture(&desc).unwrap(), ctx.create_texture(&desc).unwrap());
        let part = TextureRegion { offset: [1, 2], extent: [4, 4], ..TextureRegion::default() };
        ctx.upload_texture(*one, &part, &more[..64]).unwrap();
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.copy_texture(*one, &part, *two, &TextureRegion { offset: [4, 0], ..part }).unwrap();
        ctx.submit(cmd).unwrap();
        let fetch = Evaluator::new(ctx, "textureBindlessFetch2D(a, ivec2(4, 0), 0)");
        let seen = fetch.run(ctx, [two.index(), 0, 0], 1, &Dependencies::default())[0];
        let whole = TextureRegion::default();
        (ctx.download_texture(*one, &whole).unwrap(), ctx.download_texture(*two, &whole).unwrap(), seen)
    });
    assert!(first == second);
    assert!(first.0 != data && first.1 != data);
}

/// Textures that the GPU also writes, or whose texels may be viewed in other formats, go through staging memory.
#[test]
fn other_textures_are_filled_as_ever() {
    let Some([ctx, _]) = both() else { return };
    let data = noise(3, 4 * 64);
    let plain = TextureDesc { extent: [8, 8], data: Some(&data), ..TextureDesc::default() };
    for desc in [
        TextureDesc { usage: TextureUsage::SAMPLED | TextureUsage::STORAGE, ..plain },
        TextureDesc { usage: TextureUsage::SAMPLED | TextureUsage::TARGET, ..plain },
        TextureDesc { view_formats: &[Format::Rgba8Srgb], ..plain },
        TextureDesc { mips: 4, data_mips: 1, generate_mips: true, ..plain },
    ] {
        assert!(contents(&ctx, &desc, 1) == data, "{desc:?}");
    }
}
