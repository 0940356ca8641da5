//! Images of the `large_scene` sample: instanced and combined worlds agree on every path and under the profiles of
//! phones, acceleration structures are built once and loaded later, and the valley equals the reference.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_samples::app::sample_error::SampleError;
use std::cmp::Reverse;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};

use image::RgbaImage;
use lvk::{Context, DeviceProfile};
use lvk_samples::app::progress::Progress;
use lvk_samples::app::scene_list::{self, SceneFile};
use lvk_samples::hybrid::RayPath;
use lvk_samples::large_scene::{LargeScene, LargeSceneConfig, Origin, Show, World};
use lvk_samples::rtx::RtxConfig;
use lvk_samples::scene::{ObjOptions, Scene};
use lvk_tests::hybrid::paths;
use lvk_tests::image_comparison::{
    Tolerance, assert_matches_reference, assert_similar, assert_swiftshader_matches,
};
use lvk_tests::rtx_sample::{SIZE, contexts_and_paths, image_of, software_device};
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::{device, device_with};

const SAME_RAYS: Tolerance = Tolerance { psnr: 50.0, ssim: 0.999, differing_share: 0.01, flip: 2e-3 };
/// Tolerance on SwiftShader, which filters textures with fewer bits.
const OTHER_FILTERS: Tolerance = Tolerance { psnr: 40.0, ssim: 0.99, differing_share: 0.4, flip: 0.05 };

fn config(path: RayPath) -> LargeSceneConfig {
    LargeSceneConfig::new(RtxConfig { path, width: SIZE[0], height: SIZE[1] })
}

fn make(ctx: &Context, world: &World, config: &LargeSceneConfig) -> LargeScene {
    LargeScene::new(ctx, world, config, &mut Progress::hidden()).unwrap()
}

fn valley() -> World {
    World::valley(12_000, 40, &mut Progress::hidden()).unwrap()
}

/// Two still lives, one of them turned.
fn street() -> World {
    World::street(vec![obj_scene()], 2).unwrap()
}

#[test]
fn instances_and_one_mesh_render_the_same_on_every_path() {
    let Some(ctx) = device() else { return };
    let software = software_device();
    for world in [valley(), street()] {
        let combined = world.combined().unwrap();
        let mut first = None;
        for (ctx, path) in contexts_and_paths(&ctx, software.as_deref()) {
            for world in [&world, &combined] {
                let mut sample = make(ctx, world, &config(path));
                let figures = sample.figures();
                assert_eq!(figures.shown_triangles, combined.triangle_count());
                assert_eq!(
                    (figures.structures.len(), figures.instances),
                    (world.parts().len(), world.instances().len())
                );
                let image = image_of(&mut sample, 0);
                let expected = first.get_or_insert_with(|| image.clone());
                assert_similar(&format!("{} by {path:?}", world.name()), &image, expected, &SAME_RAYS);
            }
        }
    }
}

#[test]
fn phones_split_the_mesh_and_render_the_same() {
    let Some(whole) = device() else { return };
    let combined = valley().combined().unwrap();
    let expected = image_of(&mut make(&whole, &combined, &config(paths(&whole)[0])), 0);
    for phone in [DeviceProfile::mali_g715(), DeviceProfile::xclipse_940()] {
        let phone = DeviceProfile { max_blas_primitives: 10_000, ..phone };
        let Some(ctx) = device_with(|desc| desc.profile = Some(&phone)) else { return };
        for path in paths(&ctx) {
            let mut sample = make(&ctx, &combined, &config(path));
            let least = combined.triangle_count().div_ceil(10_000) as u32;
            assert!(sample.figures().parts() >= least, "{} parts of {least}", sample.figures().parts());
            assert!(least > 5);
            assert_similar(&phone.name, &image_of(&mut sample, 0), &expected, &SAME_RAYS);
        }
    }
}

/// The only files of the cache.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// Structures that were loaded, built, and built anew in place of damaged files; and the image.
fn start(ctx: &Context, path: RayPath, world: &World, folder: &Path) -> ([usize; 3], RgbaImage) {
    let config = LargeSceneConfig { cache: Some(folder.to_owned()), ..config(path) };
    let mut sample = make(ctx, world, &config);
    let counts =
        [Origin::Loaded, Origin::Built, Origin::Rebuilt].map(|origin| sample.figures().count(origin));
    (counts, image_of(&mut sample, 0))
}

/// Starts three times, the last time with one file cut off and one changed.
fn starts_build_once(ctx: &Context, path: RayPath, world: &World) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("structures");
    let all = world.parts().len();
    let (counts, first) = start(ctx, path, world, &folder);
    assert_eq!(counts, [0, all, 0], "there is nothing to load");
    assert_eq!(files(&folder).len(), all);
    let (counts, second) = start(ctx, path, world, &folder);
    assert_eq!(counts, [all, 0, 0], "the second start builds none");
    assert!(second == first, "what was loaded is not what was built");
    let damaged = &files(&folder)[..2];
    let bytes = std::fs::read(&damaged[0]).unwrap();
    std::fs::write(&damaged[0], &bytes[..bytes.len() - 9]).unwrap();
    let mut bytes = std::fs::read(&damaged[1]).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    std::fs::write(&damaged[1], bytes).unwrap();
    let (counts, third) = start(ctx, path, world, &folder);
    assert_eq!(counts, [all - 2, 0, 2], "only damaged files are built anew");
    assert!(third == first);
    for file in damaged {
        let warnings = take_warnings(&file.display().to_string());
        assert!(warnings.iter().any(|warning| warning.contains("is dropped")), "{warnings:?}");
    }
    assert_eq!(start(ctx, path, world, &folder).0, [all, 0, 0], "and are whole again");
}

#[test]
fn a_second_start_builds_nothing_and_damaged_files_are_dropped_with_a_warning() {
    capture_warnings();
    let Some(ctx) = device() else { return };
    let software = software_device();
    for (ctx, path) in contexts_and_paths(&ctx, software.as_deref()) {
        starts_build_once(ctx, path, &valley());
    }
}

#[test]
fn accel_structs_that_were_split_are_kept_too_and_not_for_another_device() {
    capture_warnings();
    let phone = DeviceProfile { max_blas_primitives: 900, ..DeviceProfile::mali_g715() };
    let Some(ctx) = device_with(|desc| desc.profile = Some(&phone)) else { return };
    starts_build_once(&ctx, RayPath::Query, &street());
    let Some(other) = device() else { return };
    let folder = tempfile::tempdir().unwrap();
    let (world, all) = (street(), street().parts().len());
    assert_eq!(start(&ctx, RayPath::Query, &world, folder.path()).0, [0, all, 0]);
    assert_eq!(
        start(&other, paths(&other)[0], &world, folder.path()).0,
        [0, all, 0],
        "files of another device"
    );
    let combined = world.combined().unwrap();
    let all = combined.parts().len();
    assert_eq!(start(&ctx, RayPath::Query, &combined, folder.path()).0, [0, all, 0], "files of another mesh");
}

#[test]
fn figures_say_what_compaction_saves() {
    let Some(ctx) = device() else { return };
    let (world, path) = (valley(), paths(&ctx)[0]);
    let loose = make(&ctx, &world, &LargeSceneConfig { compact: false, ..config(path) });
    let [built, now] = loose.figures().structure_bytes();
    assert!(built > 0 && built == now, "{built} {now}");
    let compact = make(&ctx, &world, &config(path));
    let [built, now] = compact.figures().structure_bytes();
    eprintln!("{built} bytes compacted to {now}");
    assert!(now <= built);
    let held: u64 =
        ctx.accel_memory().structures.iter().map(|info| info.structure_bytes + info.table_bytes).sum();
    let told = |sample: &LargeScene| sample.figures().structure_bytes()[1] + sample.figures().top_level_bytes;
    assert_eq!(told(&loose) + told(&compact), held, "the context holds something else");
    let text = compact.figures().to_string();
    for part in ["triangles ", "instances ", "compacted from", "5 built", "MiB"] {
        assert!(text.contains(part), "{text}");
    }
}

#[test]
fn numbers_are_rendered_the_same_on_every_path() {
    let Some(ctx) = device() else { return };
    let software = software_device();
    for show in [Show::Instances, Show::Triangles] {
        let mut first: Option<RgbaImage> = None;
        for (ctx, path) in contexts_and_paths(&ctx, software.as_deref()) {
            let mut sample = make(ctx, &street(), &LargeSceneConfig { show, ..config(path) });
            let image = image_of(&mut sample, 0);
            let expected = first.get_or_insert_with(|| image.clone());
            assert_similar(&format!("{show:?}"), &image, expected, &SAME_RAYS);
        }
        let plain = image_of(&mut make(&ctx, &street(), &config(paths(&ctx)[0])), 0);
        assert!(first.is_some_and(|first| first != plain), "{show:?} shows the picture");
    }
}

#[test]
fn the_valley_and_the_street_look_as_they_always_did() {
    let Some(ctx) = device() else { return };
    let path = paths(&ctx)[0];
    assert_matches_reference(
        "large_scene_small",
        &image_of(
            &mut make(&ctx, &World::valley(60_000, 300, &mut Progress::hidden()).unwrap(), &config(path)),
            0,
        ),
    );
    assert_matches_reference("large_scene_street", &image_of(&mut make(&ctx, &street(), &config(path)), 0));
}

#[test]
fn depth_samples_and_frame_time_count() {
    let Some(ctx) = device() else { return };
    let path = paths(&ctx)[0];
    let world = valley();
    let mut sample = make(&ctx, &world, &config(path));
    let first = image_of(&mut sample, 0);
    assert_ne!(image_of(&mut sample, 30), first, "the camera moves");
    assert_eq!(image_of(&mut sample, 100), first, "a round has no seam");
    for other in
        [LargeSceneConfig { depth: 0, ..config(path) }, LargeSceneConfig { samples: 1, ..config(path) }]
    {
        assert_ne!(image_of(&mut make(&ctx, &world, &other), 0), first, "{other:?}");
    }
    let mut second = make(&ctx, &world, &config(path)).from_camera(&world, 1);
    assert_eq!(image_of(&mut second, 0), image_of(&mut sample, 20), "the second of five cameras");
}

/// Small archives of scenes that may lie beside the project, in `../shared/scenes`.
const ARCHIVES: [&str; 2] = ["cornell_box.tar.xz", "teapot.tar.xz"];

/// Scenes unpacked in the folder of LVK_SCENES, else in `scratch` from the archives beside the project.
fn scenes(scratch: &Path) -> Option<PathBuf> {
    if let Some(folder) = scene_list::folder() {
        return Some(folder);
    }
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes");
    if !ARCHIVES.iter().all(|archive| beside.join(archive).exists()) {
        return None;
    }
    for archive in ARCHIVES {
        let done = Command::new("tar").arg("-xJf").arg(beside.join(archive)).arg("-C").arg(scratch).status();
        assert!(done.as_ref().is_ok_and(ExitStatus::success), "tar does not unpack {archive}: {done:?}");
    }
    Some(scratch.to_owned())
}

/// The largest OBJ below 12 MB of each folder, three of them at most.
fn small_scenes(folder: &Path) -> Vec<SceneFile> {
    let mut found = scene_list::find(folder);
    found.retain(|scene| scene.bytes < 12_000_000);
    found.sort_by_key(|scene| (scene.path.parent().map(Path::to_owned), Reverse(scene.bytes)));
    found.dedup_by_key(|scene| scene.path.parent().map(Path::to_owned));
    found.truncate(3);
    found
}

/// Scenes from files, combined and as instances: those of LVK_SCENES, or of the archives beside the project.
#[test]
fn the_archives_make_a_street() {
    let scratch = tempfile::tempdir().unwrap();
    let Some(folder) = scenes(scratch.path()) else {
        eprintln!(
            "NOT TESTED, no scenes from files: unpack some in a folder and name that in {}, or put {ARCHIVES:?} into \
             ../shared/scenes",
            scene_list::FOLDER_VARIABLE
        );
        return;
    };
    let Some(ctx) = device() else { return };
    let small = small_scenes(&folder);
    assert!(!small.is_empty(), "no small OBJ in {}", folder.display());
    let load = |path: &Path| Scene::from_obj(path, &ObjOptions::default(), &mut Progress::hidden()).unwrap();
    let world = World::street(small.iter().map(|scene| load(&scene.path)).collect(), 2).unwrap();
    let software = software_device();
    let mut first = None;
    for (ctx, path) in contexts_and_paths(&ctx, software.as_deref()) {
        for world in [&world, &world.combined().unwrap()] {
            let image = image_of(&mut make(ctx, world, &config(path)), 0);
            let expected = first.get_or_insert_with(|| image.clone());
            assert_similar(&format!("archives by {path:?}"), &image, expected, &SAME_RAYS);
        }
    }
}

#[test]
#[ignore = "a minute, of the check swiftshader of .ci/slow"]
fn a_driver_without_ray_tracing_renders_the_street() {
    assert_swiftshader_matches(
        a_driver_without_ray_tracing_renders_the_street,
        "large_scene_street",
        &OTHER_FILTERS,
        |ctx| image_of(&mut make(ctx, &street(), &config(RayPath::Query)), 0),
    );
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = device() else { return };
    let path = paths(&ctx)[0];
    for (width, height) in [(0, 8), (8, 0), (1 << 30, 8)] {
        let config = LargeSceneConfig::new(RtxConfig { path, width, height });
        let error = LargeScene::new(&ctx, &street(), &config, &mut Progress::hidden()).err();
        assert!(matches!(error, Some(SampleError::BadSize { .. })), "{error:?}");
    }
}
