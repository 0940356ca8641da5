//! Geometry passes of the `hybrid` sample: they find the surfaces that rays find, also of degenerate triangles.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::Context;
use lvk_samples::hybrid::{Geometry, HybridConfig, HybridRenderer, Method, Raster, RasterTuning, RayPath};
use lvk_samples::scene::{Camera, Scene};
use lvk_tests::device;
use lvk_tests::hybrid::{HybridHarness, paths};
use lvk_tests::image_comparison::{Tolerance, assert_similar};
use lvk_tests::scene_obj::obj_scene;

const SIZE: [u32; 2] = [163, 91];

/// Tolerance of the compute rasteriser, which leaves to rays what rounding decides: no pixel in ten thousand.
const SAME_PIXELS: Tolerance = Tolerance { psnr: 60.0, ssim: 0.9999, differing_share: 1e-4, flip: 1e-3 };
/// Tolerance of the device's rasteriser, which leaves to rays what its grid decides.
const SAME_EDGES: Tolerance = Tolerance { psnr: 60.0, ssim: 0.999, differing_share: 2e-4, flip: 1e-3 };
/// Tolerance of the paper's geometry pass, which has the edges of the device's rasteriser.
const SAME_VIEW: Tolerance = Tolerance { psnr: 40.0, ssim: 0.995, differing_share: 3e-3, flip: 0.01 };

const COMPUTE: Geometry = Geometry::Visibility(Some(Raster::Compute));
const HARDWARE: Geometry = Geometry::Visibility(Some(Raster::Hardware));

fn config(path: RayPath, geometry: Geometry) -> HybridConfig {
    HybridConfig { path, geometry, width: SIZE[0], height: SIZE[1], max_depth: 1, ..HybridConfig::default() }
}

fn render_images(ctx: &Context, scene: &Scene, config: &HybridConfig, cameras: &[Camera]) -> Vec<RgbaImage> {
    let mut harness = HybridHarness::with_config(ctx, scene, config);
    cameras.iter().map(|camera| harness.render(camera)).collect()
}

/// Compares all geometry passes with rays alone, through each camera and by each path.
fn assert_geometry_agrees(ctx: &Context, scene: &Scene, cameras: &[Camera], by_hardware: Tolerance) {
    let path = paths(ctx)[0];
    let standalone = HybridConfig { method: Method::Standalone, ..config(path, COMPUTE) };
    let expected = render_images(ctx, scene, &standalone, cameras);
    for (geometry, tolerance) in
        [(COMPUTE, SAME_PIXELS), (HARDWARE, by_hardware), (Geometry::Paper, SAME_VIEW)]
    {
        let mut by_path: Vec<Vec<RgbaImage>> = Vec::new();
        for path in paths(ctx) {
            by_path.push(render_images(ctx, scene, &config(path, geometry), cameras));
        }
        for (number, expected) in expected.iter().enumerate() {
            let what = format!("camera {} {geometry:?}", number + 1);
            assert_similar(&what, &by_path[0][number], expected, &tolerance);
            for other in &by_path[1..] {
                assert!(other[number] == by_path[0][number], "{what}: pipeline and query differ");
            }
        }
    }
}

#[test]
fn every_geometry_pass_finds_what_rays_find() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    assert_geometry_agrees(&ctx, &scene, &scene.cameras, SAME_EDGES);
}

/// Just above the floor and beside a wall, so that large triangles begin far behind the eye, and with a corner at it.
#[test]
fn triangles_through_the_near_plane_are_clipped_where_rays_begin() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    let corner = scene.positions[scene.triangles[0][0] as usize];
    let cameras = [
        Camera::looking_along([0.3, 0.002, 1.5], [-0.2, 0.01, -1.0], 100.0),
        Camera::looking_along([0.3, 0.4, 1.5], [0.1, -1.0, -0.2], 120.0),
        Camera::looking_along([corner[0], corner[1] + 0.001, corner[2]], [0.3, -0.2, -1.0], 90.0),
    ];
    // A pixel of 14,833 at the near plane, where hardware cuts triangles before it places their corners.
    let one_pixel = Tolerance { psnr: 50.0, ..SAME_EDGES };
    assert_geometry_agrees(&ctx, &scene, &cameras, one_pixel);
}

/// Points, lines, needles, a twin of another triangle and one as large as the world.
fn with_awkward_triangles(scene: &mut Scene) {
    let base = scene.positions.len() as u32;
    let corners = [
        [0.0, 0.5, 0.5],
        [1.0, 0.5, 0.5],
        [0.5, 0.5 + 1e-6, 0.5],
        [-4e3, -3.0, -4e3],
        [4e3, -3.0, -4e3],
        [0.0, -3.0, 5e3],
    ];
    for corner in corners {
        scene.positions.push(corner);
        scene.normals.push([0.0, 1.0, 0.0]);
        scene.texcoords.push([0.0; 2]);
    }
    let twin = scene.triangles[0];
    let mine = [[0, 0, 0], [0, 1, 0], [0, 1, 2], [3, 4, 5]].map(|t: [u32; 3]| t.map(|vertex| base + vertex));
    for triangle in mine.into_iter().chain([twin]) {
        scene.triangles.insert(0, triangle);
        scene.triangle_materials.insert(0, 0);
        scene.source_triangles.insert(0, 0);
        scene.opaque_triangle_count += 1;
    }
}

#[test]
fn awkward_triangles_are_seen_as_rays_see_them() {
    let Some(ctx) = device() else { return };
    let mut scene = obj_scene();
    with_awkward_triangles(&mut scene);
    let path = paths(&ctx)[0];
    let standalone = HybridConfig { method: Method::Standalone, ..config(path, COMPUTE) };
    let expected = render_images(&ctx, &scene, &standalone, &scene.cameras[..3]);
    let found = render_images(&ctx, &scene, &config(path, COMPUTE), &scene.cameras[..3]);
    for (number, (found, expected)) in found.iter().zip(&expected).enumerate() {
        assert_similar(&format!("awkward, camera {}", number + 1), found, expected, &SAME_PIXELS);
    }
}

/// The rasteriser of a triangle, and lists too short for it and its tiles, must not change the image.
#[test]
fn tuning_and_full_lists_do_not_change_the_image() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    let plain = config(paths(&ctx)[0], COMPUTE);
    let expected = render_images(&ctx, &scene, &plain, &scene.cameras[..2]);
    for (small, medium, set_aside, tiles) in [
        (0, 1024, 1 << 16, 1 << 16),
        (0, 0, 1 << 16, 1 << 16),
        (0, u32::MAX, 1 << 16, 0),
        (u32::MAX, 0, 1, 1),
        (0, 0, 0, 0),
        (8, 64, 7, 1),
        (8, 64, 1 << 16, 5),
        (64, 100, 40, 40),
    ] {
        let (small_pixels, medium_pixels) = (Some(small), Some(medium));
        let tuning = RasterTuning { small_pixels, medium_pixels, set_aside, tiles };
        let found = render_images(&ctx, &scene, &HybridConfig { tuning, ..plain }, &scene.cameras[..2]);
        assert!(found == expected, "{tuning:?} changes the picture");
    }
}

#[test]
fn the_choice_of_a_rasteriser_is_reported_and_leaves_an_image() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    let path = paths(&ctx)[0];
    for (geometry, reason) in
        [(COMPUTE, "as asked for"), (HARDWARE, "as asked for"), (Geometry::default(), "")]
    {
        let mut renderer = HybridRenderer::new(&ctx, &scene, &config(path, geometry)).unwrap();
        renderer.measure_rasters(&scene.cameras[0]).unwrap();
        let choice = renderer.raster_choice().unwrap();
        assert!(choice.to_string().contains(reason), "{choice}");
        let named = matches!(geometry, Geometry::Visibility(Some(raster)) if raster != choice.raster);
        assert!(!named, "{geometry:?} became {choice}");
        renderer.render(&scene.cameras[0]).unwrap();
        let expected = render_images(
            &ctx,
            &scene,
            &config(path, Geometry::Visibility(Some(choice.raster))),
            &scene.cameras[..1],
        );
        assert!(renderer.read_image().unwrap() == expected[0].as_raw()[..], "{choice}: another picture");
    }
    let mut paper = HybridRenderer::new(&ctx, &scene, &config(path, Geometry::Paper)).unwrap();
    paper.measure_rasters(&scene.cameras[0]).unwrap();
    assert_eq!(paper.raster_choice(), None);
}
