//! Renders a scene along its five camera paths by both methods, and records frame times and image metrics.

use lvk::{Capabilities, Context};

use super::error::PaperError;
use super::image_metrics::ImageMetrics;
use super::report_images::ReportImages;
use super::times::{Statistic, Times};
use super::trace_path::TracePath;
use lvk_samples::app::progress::Progress;
use lvk_samples::hybrid::{HybridConfig, HybridRenderer, Method};
use lvk_samples::scene::{Camera, CameraPath, Scene};

/// Number of cameras of a scene.
pub const CAMERA_COUNT: usize = 5;

/// Settings of the experiment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExperimentPlan {
    /// Width and height of the images in pixels.
    pub size: [u32; 2],
    /// Frames along the path of each camera.
    pub frames: u32,
    /// Renderings of each frame by each method; the median counts.
    pub runs: u32,
    /// Unmeasured frames of each method before the first measured frame.
    pub warm_up: u32,
    /// Frames per camera, evenly along its path, whose images are compared.
    pub compared: u32,
    /// Maximum number of reflections and refractions of a ray.
    pub max_depth: u32,
    /// The measured ray tracing paths.
    pub paths: Vec<TracePath>,
}

/// Results of one camera and one ray tracing path.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraResult {
    /// The ray tracing path.
    pub path: TracePath,
    /// Index of the camera, 0 to 4.
    pub camera: usize,
    /// Times of each frame.
    pub frames: Vec<Times>,
    /// Image metrics between both methods.
    pub metrics: ImageMetrics,
}

/// Results of one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneResult {
    /// Name of the scene.
    pub name: String,
    /// Number of vertices, distinct by position, normal and texture coordinate.
    pub vertices: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Five results per ray tracing path, in the order of the plan.
    pub cells: Vec<CameraResult>,
    /// The rasteriser of the visibility pass for each path, with the reason.
    pub rasterisers: Vec<(TracePath, String)>,
    /// Image metrics between the first two paths, for each camera, stand-alone and hybrid; empty for a single path.
    pub path_metrics: Vec<(ImageMetrics, ImageMetrics)>,
}

impl ExperimentPlan {
    /// Returns the position of a frame on its camera path, from 0 to below 1.
    fn phase(&self, frame: u32) -> f32 {
        (f64::from(frame) / f64::from(self.frames.max(1))) as f32
    }

    /// Returns the frames whose images are compared; the first is frame 0.
    fn compared_frames(&self) -> Vec<u32> {
        let count = self.compared.clamp(1, self.frames.max(1));
        (0..count).map(|i| (u64::from(i) * u64::from(self.frames) / u64::from(count)) as u32).collect()
    }

    /// Returns the number of rendered frames per ray tracing path.
    fn steps(&self) -> u64 {
        let each = 2 * (u64::from(self.warm_up) + u64::from(self.frames) * u64::from(self.runs));
        CAMERA_COUNT as u64 * (each + 2 * self.compared_frames().len() as u64)
    }
}

impl SceneResult {
    /// Returns the results of a path, by camera.
    pub fn cameras_by(&self, path: TracePath) -> impl Iterator<Item = &CameraResult> {
        self.cells.iter().filter(move |cell| cell.path == path)
    }

    /// Returns the rasteriser of the visibility pass for a path, with the reason.
    pub(super) fn rasteriser(&self, path: TracePath) -> &str {
        self.rasterisers.iter().find(|(known, _)| *known == path).map_or("", |(_, choice)| choice)
    }

    /// Returns the average of a statistic over the cameras.
    #[must_use]
    pub fn mean(&self, path: TracePath, statistic: Statistic) -> Times {
        let rows: Vec<Times> = self.cameras_by(path).map(|cell| statistic.evaluate(&cell.frames)).collect();
        Times::mean(&rows)
    }
}

/// Measures `scene` and writes the first frame of each camera to `images`. The textures must fit the device limits.
///
/// # Errors
/// [`PaperError`] if the context does not match the plan, rendering fails, or an image cannot be written.
pub fn measure(
    ctx: &Context,
    scene: &Scene,
    plan: &ExperimentPlan,
    images: &ReportImages,
    progress: &mut Progress,
) -> Result<SceneResult, PaperError> {
    let capabilities = ctx.capabilities();
    if capabilities.limits.timestamp_bits == 0 {
        return Err(PaperError::NoTimestamps { device: capabilities.device_name.clone() });
    }
    check_paths(&plan.paths, capabilities)?;
    let (mut cells, mut rasterisers) = (Vec::new(), Vec::new());
    let mut firsts: Vec<Vec<[Vec<u8>; 2]>> = Vec::new();
    for &path in &plan.paths {
        let name = format!("{} by {}", scene.name, path.name());
        progress.stage(&format!("{name}: building"), 0);
        let mut pair = MethodPair::new(ctx, scene, plan, path)?;
        rasterisers.push((path, pair.rasteriser.clone()));
        progress.stage(&name, plan.steps());
        let mut images_of_path = Vec::new();
        for camera in 0..CAMERA_COUNT {
            let (result, first) = pair.measure_camera(scene, camera, progress)?;
            images.write(&scene.name, path, camera, &first)?;
            images_of_path.push(first);
            cells.push(result);
        }
        images.write_sheet(&scene.name, path, &images_of_path)?;
        firsts.push(images_of_path);
    }
    Ok(SceneResult {
        name: scene.name.clone(),
        vertices: scene.positions.len() as u64,
        triangles: scene.triangles.len() as u64,
        cells,
        rasterisers,
        path_metrics: compare_paths(&firsts, plan)?,
    })
}

/// Checks that the context traces by the planned paths, so that results have the right name.
fn check_paths(paths: &[TracePath], capabilities: &Capabilities) -> Result<(), PaperError> {
    let other = paths.iter().map(|&path| [path, TracePath::new(path.ray_path(), capabilities)]);
    match other.into_iter().find(|[planned, found]| planned != found) {
        Some([planned, found]) => Err(PaperError::OtherPath { planned: planned.name(), found: found.name() }),
        None => Ok(()),
    }
}

/// The renderers of both methods.
struct MethodPair<'a> {
    plan: &'a ExperimentPlan,
    path: TracePath,
    standalone: HybridRenderer,
    hybrid: HybridRenderer,
    rasteriser: String,
    done: u64,
}

impl<'a> MethodPair<'a> {
    fn new(
        ctx: &Context,
        scene: &Scene,
        plan: &'a ExperimentPlan,
        path: TracePath,
    ) -> Result<Self, PaperError> {
        let [width, height] = plan.size;
        let renderer = |method| {
            let max_depth = plan.max_depth;
            let config = HybridConfig {
                method,
                path: path.ray_path(),
                width,
                height,
                max_depth,
                ..HybridConfig::default()
            };
            HybridRenderer::new(ctx, scene, &config)
        };
        let (standalone, mut hybrid) = (renderer(Method::Standalone)?, renderer(Method::Hybrid)?);
        hybrid.measure_rasters(&scene.cameras[0])?;
        let rasteriser =
            hybrid.raster_choice().map_or_else(|| "none".to_owned(), |choice| choice.to_string());
        Ok(Self { plan, path, standalone, hybrid, rasteriser, done: 0 })
    }

    /// Measures a camera. Returns its results, and its first image by both methods.
    fn measure_camera(
        &mut self,
        scene: &Scene,
        camera: usize,
        progress: &mut Progress,
    ) -> Result<(CameraResult, [Vec<u8>; 2]), PaperError> {
        let path = CameraPath::sway(scene, camera);
        for _ in 0..self.plan.warm_up {
            self.render_frame(&path.at(0.0), 0)?;
        }
        let mut frames = Vec::with_capacity(self.plan.frames as usize);
        for frame in 0..self.plan.frames {
            let view = path.at(self.plan.phase(frame));
            let runs: Result<Vec<Times>, PaperError> =
                (0..self.plan.runs.max(1)).map(|run| self.render_frame(&view, frame + run)).collect();
            frames.push(Statistic::MEDIAN.evaluate(&runs?));
            progress.set(self.done);
        }
        let mut pairs = Vec::new();
        for frame in self.plan.compared_frames() {
            self.render_frame(&path.at(self.plan.phase(frame)), 0)?;
            pairs.push([self.standalone.read_image()?, self.hybrid.read_image()?]);
        }
        progress.set(self.done);
        let metrics = ImageMetrics::compare_pairs(&pairs, self.plan.size)?;
        let first = pairs.swap_remove(0);
        Ok((CameraResult { path: self.path, camera, frames, metrics }, first))
    }

    /// Renders a frame by both methods. They alternate in order, so that neither benefits from a warmer device.
    fn render_frame(&mut self, view: &Camera, turn: u32) -> Result<Times, PaperError> {
        let (alone, hybrid) = if turn.is_multiple_of(2) {
            let alone = self.standalone.render(view)?;
            (alone, self.hybrid.render(view)?)
        } else {
            let hybrid = self.hybrid.render(view)?;
            (self.standalone.render(view)?, hybrid)
        };
        self.done += 2;
        Ok(Times {
            standalone: alone.total_ms(),
            rays: hybrid.rays_ms,
            geometry: hybrid.geometry_ms,
            standalone_span: alone.span_ms,
            hybrid_span: hybrid.span_ms,
        })
    }
}

/// Compares the images of the first two paths for each camera, stand-alone and hybrid.
fn compare_paths(
    firsts: &[Vec<[Vec<u8>; 2]>],
    plan: &ExperimentPlan,
) -> Result<Vec<(ImageMetrics, ImageMetrics)>, PaperError> {
    let [first, second, ..] = firsts else { return Ok(Vec::new()) };
    let compared = first.iter().zip(second).map(|(a, b)| {
        let compare =
            |method: usize| ImageMetrics::compare_pairs(&[[a[method].clone(), b[method].clone()]], plan.size);
        Ok((compare(0)?, compare(1)?))
    });
    compared.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(frames: u32, compared: u32) -> ExperimentPlan {
        ExperimentPlan {
            size: [8, 8],
            frames,
            runs: 2,
            warm_up: 1,
            compared,
            max_depth: 1,
            paths: Vec::new(),
        }
    }

    #[test]
    fn a_context_with_other_ray_queries_than_planned_is_rejected() {
        use TracePath::{Pipeline, Query, SoftwareQuery};
        let software =
            Capabilities { ray_query_path: lvk::RayQueryPath::Software, ..Capabilities::default() };
        assert!(check_paths(&[Pipeline, SoftwareQuery], &software).is_ok());
        let refused = check_paths(&[Pipeline, Query], &software).unwrap_err().to_string();
        assert!(refused.contains("by query") && refused.contains("by software query"), "{refused}");
        assert!(check_paths(&[SoftwareQuery], &Capabilities::default()).is_err());
        assert!(check_paths(&[Pipeline, Query], &Capabilities::default()).is_ok());
    }

    #[test]
    fn compared_frames_are_spread_and_begin_with_the_first() {
        assert_eq!(plan(4000, 4).compared_frames(), [0, 1000, 2000, 3000]);
        assert_eq!(plan(3, 9).compared_frames(), [0, 1, 2]);
        assert_eq!(plan(3, 0).compared_frames(), [0]);
        assert_eq!(plan(4000, 4).phase(1000), 0.25);
    }
}
