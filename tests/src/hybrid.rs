//! Images of the `hybrid` sample.
#![expect(clippy::expect_used, reason = "a test without its image has failed")]

use image::RgbaImage;
use lvk::Context;
use lvk_samples::hybrid::{HybridConfig, HybridRenderer, Method, RayPath};
use lvk_samples::scene::{Camera, Scene};

use crate::ray_tracer::Method as TraceMethod;

/// The sample with one configuration of a scene.
pub struct HybridHarness {
    /// The sample.
    pub renderer: HybridRenderer,
    size: [u32; 2],
}

impl HybridHarness {
    /// Creates the sample for images of `size` pixels and rays of up to `max_depth` bounces.
    ///
    /// # Panics
    /// When the sample cannot be created.
    pub fn new(
        ctx: &Context,
        scene: &Scene,
        (method, path): (Method, RayPath),
        size: [u32; 2],
        max_depth: u32,
    ) -> Self {
        let [width, height] = size;
        let config = HybridConfig { method, path, width, height, max_depth, ..HybridConfig::default() };
        Self::with_config(ctx, scene, &config)
    }

    /// Creates the sample with `config`.
    ///
    /// # Panics
    /// When the sample cannot be created.
    pub fn with_config(ctx: &Context, scene: &Scene, config: &HybridConfig) -> Self {
        let renderer = HybridRenderer::new(ctx, scene, config).expect("the sample can be set up");
        Self { renderer, size: [config.width, config.height] }
    }

    /// Renders an image.
    ///
    /// # Panics
    /// When rendering fails.
    pub fn render(&mut self, camera: &Camera) -> RgbaImage {
        self.renderer.render(camera).expect("the sample renders");
        let pixels = self.renderer.read_image().expect("the image can be read");
        RgbaImage::from_raw(self.size[0], self.size[1], pixels).expect("an image has four bytes a pixel")
    }
}

/// Returns the ray paths of the device. Prints which one is not tested.
///
/// # Panics
/// When it has none.
pub fn paths(ctx: &Context) -> Vec<RayPath> {
    let path = |method| match method {
        TraceMethod::Pipeline => RayPath::Pipeline,
        TraceMethod::Query => RayPath::Query,
    };
    TraceMethod::available(ctx).into_iter().map(path).collect()
}
