//! The pictures of the `hybrid` sample by software ray queries are those of the device's own queries.

use lvk::{FeatureRequest, RayQueryPath, RayQueryRequest};
use lvk_samples::hybrid::{Method, RayPath};
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
