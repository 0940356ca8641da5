//! Every sample that traces rays makes its picture by `--rt pipeline` under each device profile, and on SwiftShader, a driver without ray
//! tracing.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;
use std::process::Command;

use image::RgbaImage;
use lvk::DeviceProfile;
use lvk_dev_driver::{DriverRequest, prepare, swiftshader_icd};
use lvk_samples::app::metrics;

const SIZE: [u32; 2] = [96, 54];
/// Least PSNR of the pictures of two paths, in dB.
const LEAST_PSNR: f64 = 60.0;
/// The same of `rtx_textures` on SwiftShader, which selects one mip level for four invocations: two paths have other four together.
const LEAST_PSNR_OF_MIPS: f64 = 55.0;

/// A sample with the arguments that make its picture small work.
type Sample = (&'static str, &'static str, &'static [&'static str]);

const SAMPLES: [Sample; 8] = [
    ("hybrid", env!("CARGO_BIN_EXE_hybrid"), &["--samples", "1"]),
    ("hybrid_oit", env!("CARGO_BIN_EXE_hybrid_oit"), &["--supersampling", "1"]),
    (
        "large_scene",
        env!("CARGO_BIN_EXE_large_scene"),
        &["--triangles", "8000", "--copies", "9", "--samples", "1"],
    ),
    ("reflections", env!("CARGO_BIN_EXE_reflections"), &["--samples", "1"]),
    ("rtx_ao", env!("CARGO_BIN_EXE_rtx_ao"), &["--passes", "1"]),
    ("rtx_hello", env!("CARGO_BIN_EXE_rtx_hello"), &[]),
    ("rtx_pipeline", env!("CARGO_BIN_EXE_rtx_pipeline"), &[]),
    ("rtx_textures", env!("CARGO_BIN_EXE_rtx_textures"), &[]),
];

/// Returns the picture of a program, which must end with status 0, and what it printed.
fn picture_of(mut command: Command) -> (RgbaImage, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("picture.png");
    let [width, height] = SIZE.map(|side| side.to_string());
    command.args(["--frames", "1", "--width", &width, "--height", &height, "--out"]).arg(&file);
    command.env_remove("LVK_DEVICE").env("LVK_CACHE", "");
    let output = command.output().unwrap();
    let text = [&output.stdout[..], &output.stderr].map(String::from_utf8_lossy).concat();
    assert!(output.status.success(), "{command:?}: {text}");
    (image::open(&file).unwrap().into_rgba8(), text)
}

fn command(program: &str, args: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(args);
    command
}

fn assert_same(what: &str, image: &RgbaImage, expected: &RgbaImage, least_psnr: f64) {
    let difference = metrics::compare(image, expected, image.width(), image.height()).unwrap();
    println!("{what}: {difference}");
    assert!(difference.psnr >= least_psnr, "{what}: {difference}");
}

/// Under each profile, pictures by a pipeline are those of the device's own pipelines. The least device filters textures otherwise, so its
/// pictures are compared with those by ray queries.
#[test]
#[ignore = "minutes: .ci/slow lowered"]
fn every_sample_renders_by_a_pipeline_under_every_profile() {
    for (name, program, args) in SAMPLES {
        let by =
            |more: &[&str]| picture_of(command(program, &[args, &["--validate", "--rt"], more].concat()));
        let (expected, _) = by(&["hardware"]);
        for profile in DeviceProfile::names() {
            let (image, text) = by(&["pipeline", "--profile", profile]);
            assert!(text.contains("validation messages: 0"), "{name}, {profile}: {text}");
            let what = format!("{name}, {profile}");
            match profile {
                "core-only" => {
                    assert_same(&what, &image, &by(&["software", "--profile", profile]).0, LEAST_PSNR)
                }
                _ => assert_same(&what, &image, &expected, LEAST_PSNR),
            }
        }
    }
}

/// Another driver filters textures otherwise, so its pictures are compared with its own by ray queries in software.
#[test]
#[ignore = "minutes: .ci/slow lowered"]
fn every_sample_renders_by_a_pipeline_on_a_driver_without_ray_tracing() {
    let icd = swiftshader_icd().unwrap();
    for (name, program, args) in SAMPLES {
        let [image, expected] = ["pipeline", "software"].map(|path| {
            let mut sample = command(program, &[args, &["--validate", "--rt", path]].concat());
            on(&icd, &mut sample);
            let (image, text) = picture_of(sample);
            assert!(
                text.contains("SwiftShader") && text.contains("validation messages: 0"),
                "{name}: {text}"
            );
            image
        });
        let least_psnr = if name == "rtx_textures" { LEAST_PSNR_OF_MIPS } else { LEAST_PSNR };
        assert_same(name, &image, &expected, least_psnr);
    }
}

/// The smallest program asks for no path.
#[test]
fn the_triangle_is_the_same_on_a_driver_without_ray_tracing() {
    let icd = match (prepare(&DriverRequest::default()), swiftshader_icd()) {
        (Ok(_), Ok(icd)) => icd,
        (Err(error), _) | (_, Err(error)) => {
            assert!(std::env::var_os("LVK_REQUIRE_GPU").is_none(), "{error}");
            eprintln!("SKIPPED, a driver is missing: {error}");
            return;
        }
    };
    let picture = |icd: Option<&Path>| {
        let folder = tempfile::tempdir().unwrap();
        let mut triangle = command(env!("CARGO_BIN_EXE_triangle"), &[]);
        if let Some(icd) = icd {
            on(icd, &mut triangle);
        }
        let output = triangle.current_dir(folder.path()).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        image::open(folder.path().join("triangle.png")).unwrap().into_rgba8()
    };
    let (image, expected) = (picture(Some(&icd)), picture(None));
    assert_same("triangle", &image, &expected, LEAST_PSNR);
}

/// Lets a program find no driver but this one.
fn on(icd: &Path, command: &mut Command) {
    command.env("VK_DRIVER_FILES", icd).env_remove("VK_ICD_FILENAMES").env_remove("LVK_DRIVER");
}
