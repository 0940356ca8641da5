//! Memory that the load of a large model takes. The heap is counted, so this program has one test.
//!
//! Counted are the bytes that Rust's allocator has given: the loader's, the viewer's and the library's. The driver's are not, nor is
//! memory of the GPU, which is host memory where the GPU is the CPU.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_gltf::{LoadOptions, Model};
use lvk_samples::hybrid::RayPath;
use lvk_tests::device;
use lvk_viewer::city::{CityConfig, city};
use lvk_viewer::light::{Environment, SunSetting};
use lvk_viewer::{Viewer, ViewerConfig, ViewerScene};
use peak_alloc::PeakAlloc;

#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

/// Runs `work`. Returns the most bytes in use meanwhile beyond `before`.
fn most_bytes<R>(before: usize, work: impl FnOnce() -> R) -> (R, usize) {
    HEAP.reset_peak_usage();
    let result = work();
    (result, HEAP.peak_usage().saturating_sub(before))
}

#[test]
fn a_city_is_loaded_within_twice_the_size_of_its_file() {
    let Some(ctx) = device() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("city.glb");
    let glb = city(&CityConfig::default()).unwrap().glb;
    std::fs::write(&path, &glb).unwrap();
    let file_bytes = glb.len();
    drop(glb);
    assert!(file_bytes > 8_000_000, "{file_bytes} bytes are too few to measure by");

    let before = HEAP.current_usage();
    let (model, loading) = most_bytes(before, || Model::load(&path, &LoadOptions::default()).unwrap());
    let environment = Environment::day(&SunSetting::default());
    let scene = ViewerScene { name: "city".into(), model, environment, disc_radius: 0.01 };
    let config = ViewerConfig::new(RayPath::Query, 64, 36);
    let (viewer, showing) = most_bytes(before, || Viewer::new(&ctx, scene, &config).unwrap());
    let kept = HEAP.current_usage() - before;
    let times = |bytes: usize| bytes as f64 / file_bytes as f64;
    eprintln!(
        "{file_bytes} bytes of the file; times that: {:.2} while it is loaded, {:.2} while it is uploaded, {:.2} kept",
        times(loading),
        times(showing),
        times(kept)
    );
    assert!(loading > file_bytes / 2, "the heap is not counted");
    assert!(loading <= 2 * file_bytes && showing <= 2 * file_bytes);
    assert!(kept < file_bytes / 2, "vertices stay in the host's memory");
    drop(viewer);
}
