//! The pictures of the `hybrid` sample by software ray queries: on a device with queries of its own, and without any.

use lvk::{FeatureRequest, RayQueryPath, RayQueryRequest};
use lvk_samples::hybrid::{Method, RayPath};
use lvk_tests::child::without_ray_tracing;
use lvk_tests::hybrid::Studio;
use lvk_tests::picture::{Tolerance, assert_alike};
use lvk_tests::still_life::still_life;
use lvk_tests::{TestDevice, device_with};

const SIZE: [u32; 2] = [160, 90];
const DEPTH: u32 = 3;
const SAME_RAYS: Tolerance = Tolerance { psnr: 50.0, ssim: 0.9999, differing_share: 1e-3, flip: 1e-3 };

fn queries(request: RayQueryRequest) -> Option<TestDevice> {
    device_with(|desc| (desc.ray_tracing_pipeline, desc.ray_query) = (FeatureRequest::Off, request))
}

#[test]
fn software_and_the_device_make_the_same_picture() {
    let (Some(one), Some(other)) =
        (queries(RayQueryRequest::HardwareIfPresent), queries(RayQueryRequest::Software))
    else {
        return;
    };
    assert_eq!(other.capabilities().ray_query_path, RayQueryPath::Software);
    if one.capabilities().ray_query_path != RayQueryPath::Hardware {
        return eprintln!("NOT TESTED, {} has no ray queries", one.capabilities().device_name);
    }
    let scene = still_life();
    for method in [Method::Standalone, Method::Hybrid] {
        let studio = |ctx| Studio::new(ctx, &scene, (method, RayPath::Query), SIZE, DEPTH);
        let (mut expected, mut actual) = (studio(&*one), studio(&*other));
        for number in [0, 2] {
            let camera = &scene.cameras[number];
            let what = format!("{method:?} in software, camera {}", number + 1);
            assert_alike(&what, &actual.picture(camera), &expected.picture(camera), &SAME_RAYS);
        }
    }
}

/// The rasterised first hits are those of rays too, where nothing but the library traces.
#[test]
fn a_device_without_ray_tracing_makes_the_picture() {
    without_ray_tracing("a_device_without_ray_tracing_makes_the_picture", || {
        let Some(ctx) = queries(RayQueryRequest::Auto) else { return };
        assert!(ctx.capabilities().device_name.contains("SwiftShader"));
        let scene = still_life();
        let camera = &scene.cameras[0];
        let picture =
            |method| Studio::new(&ctx, &scene, (method, RayPath::Query), SIZE, DEPTH).picture(camera);
        let (standalone, hybrid) = (picture(Method::Standalone), picture(Method::Hybrid));
        let same_view = Tolerance { psnr: 40.0, ssim: 0.99, ..Tolerance::default() };
        assert_alike("hybrid without ray tracing", &hybrid, &standalone, &same_view);
        let colors: std::collections::HashSet<[u8; 4]> = standalone.pixels().map(|pixel| pixel.0).collect();
        assert!(colors.len() > 200, "{} colours", colors.len());
    });
}
