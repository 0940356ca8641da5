//! Images of OBJ files as exporters write them: vertex colours by every sample that loads files, and models of any size.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fmt::Write as _;

use image::RgbaImage;
use lvk::Context;
use lvk_samples::app::headless;
use lvk_samples::app::progress::Progress;
use lvk_samples::hybrid::{Geometry, HybridConfig, Method, Raster};
use lvk_samples::rtx::RtxConfig;
use lvk_samples::rtx_ao::{RtxAo, RtxAoConfig};
use lvk_samples::rtx_pipeline::{RtxPipeline, RtxPipelineConfig};
use lvk_samples::scene::{ObjOptions, Scene};
use lvk_samples::sponza::{Sponza, SponzaConfig};
use lvk_tests::device;
use lvk_tests::hybrid::{HybridHarness, paths};
use lvk_tests::image_comparison::{Tolerance, assert_similar};
use lvk_tests::rtx_sample::{SIZE, image_of};

/// Tolerance between albedos by a material and by vertices: they are rounded differently.
const SAME_COLORS: Tolerance = Tolerance { psnr: 45.0, ssim: 0.999, differing_share: 0.05, flip: 2e-3 };

/// Four tetrahedra of the given size; `ends` are appended to the positions of each.
fn tetrahedra(size: f64, ends: [&str; 4], materials: [&str; 4]) -> String {
    let mut text = String::from("mtllib a.mtl\n");
    for (number, (end, material)) in ends.iter().zip(materials).enumerate() {
        let x = 3.0 * number as f64;
        for [dx, y, z] in [[0.0, 0.0, 0.0], [2.0, 0.0, 0.5], [1.0, 0.0, 2.0], [1.0, 2.0, 1.0]] {
            let [x, y, z] = [x + dx, y, z].map(|value| value * size);
            writeln!(text, "v {x:e} {y:e} {z:e}{end}").unwrap();
        }
        writeln!(text, "usemtl {material}\nf -4 -3 -2\nf -4 -1 -3\nf -3 -1 -2\nf -2 -1 -4").unwrap();
    }
    text
}

fn load(obj: &str, mtl: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mesh.obj"), obj).unwrap();
    std::fs::write(folder.path().join("a.mtl"), mtl).unwrap();
    let options = ObjOptions::default();
    Scene::from_obj(&folder.path().join("mesh.obj"), &options, &mut Progress::hidden()).unwrap()
}

/// The same colours by vertices and by materials: half of 255 in sRGB is 0.2158 in linear light.
fn colored_twice() -> [Scene; 2] {
    let white = ["white"; 4];
    let ends = [" 1 0 0", " 0 0.501961 0", " 0 0 1", " 0.501961 0.501961 0"];
    let by_vertices = load(&tetrahedra(1.0, ends, white), "newmtl white\nKd 1 1 1\n");
    let mtl = "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 0.2158605 0\nnewmtl c\nKd 0 0 1\nnewmtl d\nKd 0.2158605 0.2158605 0\n";
    let by_materials = load(&tetrahedra(1.0, [""; 4], ["a", "b", "c", "d"]), mtl);
    assert!(by_vertices.warnings.is_empty() && by_materials.warnings.is_empty());
    assert!(!by_vertices.colors.is_empty() && by_materials.colors.is_empty());
    [by_vertices, by_materials]
}

/// Images of the `hybrid` sample, by every path, traced from the camera and by every geometry pass.
fn hybrid_images(ctx: &Context, scene: &Scene) -> Vec<RgbaImage> {
    let [width, height] = SIZE;
    let passes = [
        Geometry::Visibility(Some(Raster::Compute)),
        Geometry::Visibility(Some(Raster::Hardware)),
        Geometry::Paper,
    ];
    let hybrid = passes.map(|geometry| (Method::Hybrid, geometry));
    let all = [(Method::Standalone, Geometry::Paper)].into_iter().chain(hybrid);
    let mut images = Vec::new();
    for (method, geometry) in all {
        for path in paths(ctx) {
            let config = HybridConfig { method, path, geometry, width, height, ..HybridConfig::default() };
            images.push(HybridHarness::with_config(ctx, scene, &config).render(&scene.cameras[0]));
        }
    }
    images
}

#[test]
fn hybrid_shows_vertex_colors_by_every_method() {
    let Some(ctx) = device() else { return };
    let [by_vertices, by_materials] = colored_twice().map(|scene| hybrid_images(&ctx, &scene));
    for (number, (found, expected)) in by_vertices.iter().zip(&by_materials).enumerate() {
        assert_similar(&format!("way {number}"), found, expected, &SAME_COLORS);
    }
    // Red, green, blue and dark yellow are seen.
    let has = |is_it: fn([u8; 4]) -> bool| by_vertices[0].pixels().any(|pixel| is_it(pixel.0));
    assert!(
        has(|[r, g, b, _]| r > 100 && g < 30 && b < 30) && has(|[r, g, b, _]| b > 100 && r < 30 && g < 30)
    );
}

#[test]
fn other_samples_show_vertex_colors() {
    let Some(ctx) = device() else { return };
    let scenes = colored_twice();
    let path = paths(&ctx)[0];
    let rtx = RtxConfig { path, width: SIZE[0], height: SIZE[1] };
    let [found, expected] = scenes.each_ref().map(|scene| {
        let config = RtxPipelineConfig { rtx, depth: 2 };
        image_of(&mut RtxPipeline::new(&ctx, scene, &config).unwrap(), 0)
    });
    assert_similar("rtx_pipeline", &found, &expected, &SAME_COLORS);
    let [found, expected] = scenes.each_ref().map(|scene| {
        let config = RtxAoConfig { passes: 4, rays: 1, ..RtxAoConfig::new(rtx) };
        image_of(&mut RtxAo::new(&ctx, scene, None, &config).unwrap(), 0)
    });
    assert_similar("rtx_ao", &found, &expected, &SAME_COLORS);
    let [found, expected] = scenes.map(|scene| {
        let config = SponzaConfig { samples: 1, shadow_size: 512, ..SponzaConfig::new(SIZE) };
        let mut sample = Sponza::new(&ctx, scene, &config).unwrap();
        RgbaImage::from_raw(SIZE[0], SIZE[1], headless::picture(&mut sample).unwrap()).unwrap()
    });
    assert_similar("sponza", &found, &expected, &SAME_COLORS);
}

/// Powers of two change no digit: the images are equal. Powers of ten round.
#[test]
fn a_model_of_any_size_has_the_same_image() {
    let Some(ctx) = device() else { return };
    let mtl = "newmtl m\nKd 0.8 0.6 0.4\nKs 0.3 0.3 0.3\nNs 20\n";
    let image = |size: f64| {
        let scene = load(&tetrahedra(size, [""; 4], ["m"; 4]), mtl);
        let config =
            HybridConfig { path: paths(&ctx)[0], width: SIZE[0], height: SIZE[1], ..HybridConfig::default() };
        HybridHarness::with_config(&ctx, &scene, &config).render(&scene.cameras[0])
    };
    let usual = image(1.0);
    for size in [1e-16, 1e-12, 1e10, 1e20, 1e40] {
        assert_similar(&format!("size {size}"), &image(size), &usual, &SAME_COLORS);
    }
}
