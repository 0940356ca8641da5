//! Images of the `render_to_cube_map` sample: both methods to draw the faces agree, and every texel of a face has
//! what a ray in its direction hits.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::{Mat3, Vec3};
use lvk::{Context, DeviceProfile, Error, OptionalFeature, TextureRegion};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::render_to_cube_map::{Block, CubeMapFaces, RenderToCubeMap, RenderToCubeMapConfig};
use lvk_tests::half::from_half;
use lvk_tests::image_comparison::{Tolerance, assert_matches_reference, assert_similar, reference_image};
use lvk_tests::raster::has;
use lvk_tests::raster_sample::{SIZE, assert_refuses_impossible_sizes, image_of};
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{device, device_with};

/// Tolerance on SwiftShader, whose filters have fewer bits.
const OTHER_DRIVER: Tolerance = Tolerance { psnr: 36.0, ssim: 0.98, differing_share: 0.4, flip: 0.03 };
/// Side of a face.
const FACE: u32 = 64;
/// As in `shaders/render_to_cube_map`.
const DROP: Vec3 = Vec3::new(0.0, 1.35, 0.0);
const TO_SUN: Vec3 = Vec3::new(0.5121, 0.6401, 0.5729);
const SUN: Vec3 = Vec3::new(2.9, 2.5, 2.0);
const HORIZON: Vec3 = Vec3::new(1.75, 1.42, 1.2);

fn config(faces: CubeMapFaces) -> RenderToCubeMapConfig {
    RenderToCubeMapConfig { face_size: FACE, ..RenderToCubeMapConfig::new(SIZE, faces) }
}

fn sample(ctx: &Context, faces: CubeMapFaces) -> RenderToCubeMap {
    RenderToCubeMap::new(ctx, &config(faces)).unwrap()
}

/// Bytes of a mip of all faces.
fn faces(ctx: &Context, sample: &RenderToCubeMap, mip: u32) -> Vec<u8> {
    let region = TextureRegion { mip, layers: 6, ..TextureRegion::default() };
    ctx.download_texture(sample.cube_map(), &region).unwrap()
}

/// Both ways, in several frames, with all mips.
fn assert_one_pass_equals_six(ctx: &Context) {
    let (mut six, mut one) = (sample(ctx, CubeMapFaces::SixPasses), sample(ctx, CubeMapFaces::OnePass));
    for frame in [0, 40] {
        assert!(image_of(&mut six, frame) == image_of(&mut one, frame), "frame {frame}");
        for mip in 0..=FACE.ilog2() {
            assert!(faces(ctx, &six, mip) == faces(ctx, &one, mip), "mip {mip} in frame {frame}");
        }
    }
}

/// The direction that the specification of Vulkan gives a place of a face, from -1 to 1.
fn direction(face: usize, s: f32, t: f32) -> Vec3 {
    let direction = match face {
        0 => Vec3::new(1.0, -t, -s),
        1 => Vec3::new(-1.0, -t, s),
        2 => Vec3::new(s, 1.0, t),
        3 => Vec3::new(s, -1.0, -t),
        4 => Vec3::new(s, -t, 1.0),
        _ => Vec3::new(-s, -t, -1.0),
    };
    direction.normalize()
}

/// Distance and normal of where a ray from the drop's middle enters a block.
fn entry(block: &Block, direction: Vec3) -> Option<(f32, Vec3)> {
    let turned = Mat3::from_rotation_y(block.turn);
    let (from, along) =
        (turned.transpose() * (DROP - Vec3::from(block.middle)), turned.transpose() * direction);
    let half = Vec3::from(block.half_size);
    let (low, high) = ((-half - from) / along, (half - from) / along);
    let (near, far) = (low.min(high), low.max(high));
    let distance = near.max_element();
    let normal = Vec3::select(near.cmpeq(Vec3::splat(distance)), -along.signum(), Vec3::ZERO);
    (distance > 0.0 && distance < far.min_element()).then(|| (distance, turned * normal))
}

fn sky(direction: Vec3) -> Vec3 {
    let color = HORIZON.lerp(Vec3::new(0.12, 0.42, 1.25), 1.0 - (-3.0 * direction.y.max(0.0)).exp());
    let towards_sun = direction.dot(TO_SUN).max(0.0);
    let edge = ((towards_sun - 0.9990) / 0.0005).clamp(0.0, 1.0);
    color + SUN * (0.25 * towards_sun.powf(24.0) + 9.0 * edge * edge * (3.0 - 2.0 * edge))
}

fn lit(albedo: Vec3, at: Vec3, normal: Vec3) -> Vec3 {
    let offset = DROP - at;
    let along = offset.dot(TO_SUN);
    let beside = (((offset - along * TO_SUN).length() - 0.85) / 0.25).clamp(0.0, 1.0);
    let sun = if along > 0.0 { beside * beside * (3.0 - 2.0 * beside) } else { 1.0 };
    let open = 1.0 - normal.dot(offset.normalize()).max(0.0) / offset.length_squared().max(1.0);
    let (below, above) = (Vec3::new(0.22, 0.17, 0.15), Vec3::new(0.45, 0.50, 0.62));
    let ambient = below.lerp(above, 0.5 + 0.5 * normal.y);
    let light = ambient * open + SUN * sun * normal.dot(TO_SUN).max(0.0);
    (albedo * light).lerp(HORIZON, 1.0 - (-0.0003 * at.length_squared()).exp())
}

/// Returns the radiance along a ray from the middle of the drop.
fn radiance(blocks: &[Block], direction: Vec3) -> Vec3 {
    let entries = blocks.iter().filter_map(|block| Some((block, entry(block, direction)?)));
    let nearest = entries.min_by(|(_, (a, _)), (_, (b, _))| a.total_cmp(b));
    let Some((block, (distance, normal))) = nearest else { return sky(direction) };
    let at = DROP + distance * direction;
    let is_dark = (at.x.floor() + at.z.floor()).rem_euclid(2.0) == 0.0;
    let albedo = match (block.is_floor, is_dark) {
        (0, _) => Vec3::from(block.color),
        (_, true) => Vec3::new(0.09, 0.10, 0.12),
        (_, false) => Vec3::new(0.62, 0.58, 0.53),
    };
    lit(albedo, at, normal)
}

/// The share of texels that show something even, and of those the share that is as traced.
fn compare_with_rays(texels: &[u8], blocks: &[Block]) -> [f32; 2] {
    let channels: Vec<u16> = bytemuck::pod_collect_to_vec(texels);
    let place = |pixel: usize, within: f32| 2.0 * (pixel as f32 + within) / FACE as f32 - 1.0;
    let (mut even, mut right) = (0, 0);
    for (number, texel) in channels.chunks(4).enumerate() {
        let side = FACE as usize;
        let (face, x, y) = (number / (side * side), number % side, number / side % side);
        let traced = |u, v| radiance(blocks, direction(face, place(x, u), place(y, v)));
        let middle = traced(0.5, 0.5);
        let edges = [traced(-0.5, -0.5), traced(1.5, -0.5), traced(-0.5, 1.5), traced(1.5, 1.5)];
        let shown = Vec3::from_array([0, 1, 2].map(|channel| from_half(texel[channel])));
        if edges.iter().all(|edge| edge.distance(middle) < 0.1) {
            even += 1;
            right += i32::from(shown.distance(middle) < 0.02 + 0.01 * middle.length());
        }
    }
    [even as f32 / (channels.len() / 4) as f32, right as f32 / even as f32]
}

#[test]
fn one_pass_draws_what_six_draw() {
    let Some(ctx) = device() else { return };
    if has(&ctx, OptionalFeature::Multiview) {
        assert_one_pass_equals_six(&ctx);
    }
}

#[test]
fn faces_contain_what_rays_hit() {
    let Some(ctx) = device() else { return };
    let mut sample = sample(&ctx, CubeMapFaces::SixPasses);
    image_of(&mut sample, 25);
    let [even, right] = compare_with_rays(&faces(&ctx, &sample, 0), sample.blocks());
    assert!(even > 0.5 && right > 0.995, "{even} of the texels are even, {right} of them as traced");
}

#[test]
fn roughness_blurs_the_mirror_and_nothing_else() {
    let Some(ctx) = device() else { return };
    let rough = RenderToCubeMapConfig { roughness: 0.7, ..config(CubeMapFaces::SixPasses) };
    let mut rough = RenderToCubeMap::new(&ctx, &rough).unwrap();
    let (rough, clear) = (image_of(&mut rough, 0), image_of(&mut sample(&ctx, CubeMapFaces::SixPasses), 0));
    let [middle, corner] = [[SIZE[0] / 2, SIZE[1] / 2], [3, SIZE[1] - 3]];
    let differ =
        |[x, y]: [u32; 2]| (0..20).any(|step| rough.get_pixel(x, y - step) != clear.get_pixel(x, y - step));
    assert!(differ(middle) && !differ(corner));
}

#[test]
fn the_drop_looks_as_it_always_did() {
    let Some(ctx) = device() else { return };
    assert_matches_reference(
        "render_to_cube_map_small",
        &image_of(&mut sample(&ctx, CubeMapFaces::SixPasses), 0),
    );
}

#[test]
fn six_passes_need_no_feature_and_one_pass_says_which() {
    let profile = DeviceProfile::core_only();
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    let refused = RenderToCubeMap::new(&ctx, &config(CubeMapFaces::OnePass)).err();
    let Some(error @ SampleError::Missing { .. }) = refused else { unreachable!("{refused:?}") };
    let text = error.to_string();
    assert!(text.contains("six views") && text.contains("--faces six-passes"), "{text}");
    let image = image_of(&mut sample(&ctx, CubeMapFaces::SixPasses), 0);
    assert_similar(
        "cube map without features",
        &image,
        &reference_image("render_to_cube_map_small"),
        &Tolerance::ACROSS_DRIVERS,
    );
}

#[test]
fn another_driver_renders_it_by_both_paths() {
    on_swiftshader(another_driver_renders_it_by_both_paths, || {
        let Some(ctx) = device() else { return };
        assert_one_pass_equals_six(&ctx);
        let image = image_of(&mut sample(&ctx, CubeMapFaces::OnePass), 0);
        assert_similar(
            "SwiftShader cube map",
            &image,
            &reference_image("render_to_cube_map_small"),
            &OTHER_DRIVER,
        );
    });
}

#[test]
fn impossible_images_and_faces_are_refused() {
    let Some(ctx) = device() else { return };
    assert_refuses_impossible_sizes(|extent| {
        RenderToCubeMap::new(&ctx, &RenderToCubeMapConfig { extent, ..config(CubeMapFaces::SixPasses) })
    });
    for face_size in [0, 1 << 20] {
        let wish = RenderToCubeMapConfig { face_size, ..config(CubeMapFaces::SixPasses) };
        let refused = RenderToCubeMap::new(&ctx, &wish).err();
        let expected = matches!(
            refused,
            Some(SampleError::Device(Error::LimitExceeded { .. } | Error::InvalidUsage { .. }))
        );
        assert!(expected, "{face_size}: {refused:?}");
    }
}
