//! The path tracer against Cycles, the path tracer of Blender. `LVK_BLENDER` names the program; `.ci/cycles` fetches one.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::path::Path;
use std::process::Command;

use lvk_samples::hybrid::RayPath;
use lvk_tests::rtx_sample::software_device;

use crate::cycles_description::description;
use crate::cycles_scenes::{self, ComparedScene, SIZE};
use crate::scenes::{View, mean, radiance};

/// Side in pixels of the blocks whose means are compared.
const BLOCK: usize = 8;
/// Usual samples of each pixel.
const SAMPLES: u32 = 1024;
/// Seeds of Cycles, each with half of the samples.
const SEEDS: [u32; 2] = [1, 2];
/// The mean relative error that is too large.
const LIMIT: f64 = 0.02;

type Block = [f64; 3];

#[test]
#[ignore = "needs Blender: .ci/slow cycles"]
fn a_box_of_matte_walls_is_as_bright_as_by_cycles() {
    compare(&cycles_scenes::matte_box());
}

#[test]
#[ignore = "needs Blender: .ci/slow cycles"]
fn a_terrace_under_sky_sun_and_lamp_is_as_bright_as_by_cycles() {
    compare(&cycles_scenes::terrace());
}

#[test]
#[ignore = "needs Blender: .ci/slow cycles"]
fn glass_plastic_and_mirrors_are_as_bright_as_by_cycles() {
    compare(&cycles_scenes::cabinet());
}

#[test]
#[ignore = "needs Blender: .ci/slow cycles"]
fn rough_white_metals_are_as_bright_as_by_cycles() {
    compare(&cycles_scenes::metals());
}

/// Renders a scene by both, prints a row and asserts that they agree.
fn compare(scene: &ComparedScene) {
    let Some(ctx) = software_device() else { return };
    let folder = tempfile::tempdir().unwrap();
    let halves = by_cycles(scene, folder.path());
    let expected: Vec<_> = halves[0].iter().zip(&halves[1]).map(|(a, b)| middle(*a, *b)).collect();
    let samples = samples();
    let view = View { camera: scene.camera, size: SIZE, samples };
    let actual = radiance(&ctx, RayPath::Query, &scene.model, &scene.environment, &view);
    keep_pictures(scene, &actual, &expected);
    let [first, second] = halves.map(|half| blocks(&half));
    let (actual_blocks, expected_blocks) = (blocks(&actual), blocks(&expected));
    let error = mean_relative_error(&actual_blocks, &expected_blocks);
    let noise = 0.5 * mean_relative_error(&first, &second);
    let worst = worst_error(&actual_blocks, &expected_blocks);
    let of_means = 100.0 * relative_difference(mean(&actual), mean(&expected));
    let name = scene.name;
    eprintln!(
        "{name}: {samples} samples each, mean relative error {:.2} %, noise of Cycles {:.2} %, worst block {:.2} %, means {of_means:+.2} %",
        100.0 * error,
        100.0 * noise,
        100.0 * worst
    );
    assert!(error < LIMIT, "{name}: the mean relative error is {error}, the limit is {LIMIT}");
    let most = scene.block_limit;
    assert!(worst < most, "{name}: the relative error of a block is {worst}, the limit is {most}");
}

/// The radiance of each pixel by Cycles, rows from the top, for each seed.
fn by_cycles(scene: &ComparedScene, folder: &Path) -> [Vec<[f32; 3]>; 2] {
    let blender =
        std::env::var_os("LVK_BLENDER").expect("LVK_BLENDER names no Blender; .ci/cycles fetches one");
    let (file, out) = (folder.join("scene.json"), folder.join("radiance"));
    std::fs::write(&file, description(scene)).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/viewer/cycles.py");
    let done = Command::new(blender)
        .args(["--background", "--factory-startup", "--python-exit-code", "1", "--python"])
        .args([&script, Path::new("--"), &file, &out])
        .arg((samples() / 2).to_string())
        .args(SEEDS.map(|seed| seed.to_string()))
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&done.stdout);
    let version = text.lines().find(|line| line.starts_with("version "));
    assert!(done.status.success(), "{text}\n{}", String::from_utf8_lossy(&done.stderr));
    eprintln!("Blender, {}", version.unwrap_or("of unknown version"));
    SEEDS.map(|seed| {
        let bytes = std::fs::read(out.with_extension(seed.to_string())).unwrap();
        assert_eq!(bytes.len(), (SIZE[0] * SIZE[1]) as usize * 16);
        let texel =
            |bytes: &[u8]| [0, 1, 2].map(|i| f32::from_ne_bytes(bytes[4 * i..4 * i + 4].try_into().unwrap()));
        bytes.chunks(16).map(texel).collect()
    })
}

/// Samples of each pixel by either program, even.
fn samples() -> u32 {
    std::env::var("LVK_CYCLES_SAMPLES").map_or(SAMPLES, |number| number.parse().unwrap())
}

fn middle(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|channel| 0.5 * (a[channel] + b[channel]))
}

/// Means of blocks, row by row.
fn blocks(pixels: &[[f32; 3]]) -> Vec<Block> {
    let [width, height] = SIZE.map(|length| length as usize);
    let corners = (0..height / BLOCK).flat_map(|row| (0..width / BLOCK).map(move |column| (column, row)));
    let pixels_of = |(column, row): (usize, usize)| -> Vec<_> {
        let firsts = (0..BLOCK).map(|y| (row * BLOCK + y) * width + column * BLOCK);
        firsts.flat_map(|first| pixels[first..first + BLOCK].to_vec()).collect()
    };
    corners.map(|corner| mean(&pixels_of(corner))).collect()
}

/// The difference over what is expected, of each channel of each block.
fn relative_errors(actual: &[Block], expected: &[Block]) -> impl Iterator<Item = f64> {
    let channels = actual.as_flattened().iter().zip(expected.as_flattened());
    channels.map(|(actual, expected)| (actual - expected).abs() / expected)
}

fn mean_relative_error(actual: &[Block], expected: &[Block]) -> f64 {
    relative_errors(actual, expected).sum::<f64>() / (3 * actual.len()) as f64
}

fn worst_error(actual: &[Block], expected: &[Block]) -> f64 {
    relative_errors(actual, expected).fold(0.0, f64::max)
}

/// The difference of two means, each over its channels, relative to the second.
fn relative_difference(actual: Block, expected: Block) -> f64 {
    actual.iter().sum::<f64>() / expected.iter().sum::<f64>() - 1.0
}

/// Writes both pictures and the ratio of their pixels, which is grey where they agree, to `LVK_CYCLES_PICTURES`.
fn keep_pictures(scene: &ComparedScene, actual: &[[f32; 3]], expected: &[[f32; 3]]) {
    let Some(folder) = std::env::var_os("LVK_CYCLES_PICTURES") else { return };
    let encoded = |value: f32| (255.0 * value.clamp(0.0, 1.0).powf(1.0 / 2.2)).round() as u8;
    let ratio = |a: f32, b: f32| (0.5 + 5.0 * (a - b) / b.max(1e-6)).clamp(0.0, 1.0);
    let ratios: Vec<_> = (0..actual.len())
        .map(|pixel| [0, 1, 2].map(|i| ratio(actual[pixel][i], expected[pixel][i])))
        .collect();
    for (what, pixels) in [("lvk", actual), ("cycles", expected), ("ratio", &ratios)] {
        let bytes: Vec<u8> = pixels.as_flattened().iter().map(|value| encoded(*value)).collect();
        let picture = image::RgbImage::from_raw(SIZE[0], SIZE[1], bytes).unwrap();
        picture.save(Path::new(&folder).join(format!("{}_{what}.png", scene.name))).unwrap();
    }
}
