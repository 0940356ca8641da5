//! Images of the samples that trace rays.
#![expect(clippy::expect_used, reason = "a test whose sample cannot render has failed")]

use image::RgbaImage;
use lvk::{Context, RayQueryRequest, RayTracingPipelineRequest};
use lvk_samples::app::headless;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::hybrid::RayPath;
use lvk_samples::rtx::RtxConfig;

use crate::hybrid::paths;
use crate::image_comparison::{Tolerance, assert_similar};
use crate::raster_sample::ROUND;
use crate::{TestDevice, device_with};

/// Size of the images, no multiple of a workgroup.
pub const SIZE: [u32; 2] = [158, 89];

/// Renders a frame of a sample made for images of [`SIZE`].
///
/// # Panics
/// When rendering fails.
pub fn image_of<S: Sample>(sample: &mut S, frame: u32) -> RgbaImage {
    sample.update(FrameTime::from_frame(frame, ROUND));
    let pixels = headless::picture(sample);
    RgbaImage::from_raw(SIZE[0], SIZE[1], pixels.expect("the sample renders"))
        .expect("the image has this size")
}

/// Returns a context that has ray queries in software alone.
pub fn software_device() -> Option<TestDevice> {
    device_with(|desc| {
        (desc.ray_tracing_pipeline, desc.ray_query) =
            (RayTracingPipelineRequest::Off, RayQueryRequest::Software);
    })
}

/// Returns the paths of a context, and the one of a context that traces in software.
pub fn contexts_and_paths<'a>(
    ctx: &'a Context,
    software: Option<&'a Context>,
) -> Vec<(&'a Context, RayPath)> {
    let own = paths(ctx).into_iter().map(|path| (ctx, path));
    own.chain(software.map(|ctx| (ctx, RayPath::Query))).collect()
}

/// Asserts that samples, made by `make` for each context and path, render similar images of each frame.
///
/// # Panics
/// As said, and when rendering fails.
pub fn assert_paths_agree<S: Sample>(
    what: &str,
    ctx: &Context,
    frames: &[u32],
    tolerance: &Tolerance,
    make: impl Fn(&Context, RayPath) -> S,
) {
    let software = software_device();
    let all = contexts_and_paths(ctx, software.as_deref());
    let mut all: Vec<_> = all.into_iter().map(|(ctx, path)| make(ctx, path)).collect();
    for &frame in frames {
        let images: Vec<_> = all.iter_mut().map(|sample| image_of(sample, frame)).collect();
        for other in &images[1..] {
            assert_similar(&format!("{what} in frame {frame}"), other, &images[0], tolerance);
        }
    }
}

/// Asserts that `make` refuses image sizes that no device supports.
///
/// # Panics
/// When it does not.
pub fn assert_refuses_impossible_sizes(ctx: &Context, make: impl Fn(&RtxConfig) -> Option<SampleError>) {
    let path = paths(ctx)[0];
    for (width, height) in [(0, 8), (8, 0), (1 << 30, 8)] {
        let error = make(&RtxConfig { path, width, height });
        assert!(matches!(error, Some(SampleError::BadSize { .. })), "{error:?}");
    }
}
