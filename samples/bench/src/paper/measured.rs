//! Renders a scene along its five paths by both methods, and keeps what each frame took and how the pictures differ.

use lvk::{Capabilities, Context};

use super::error::PaperError;
use super::likeness::Likeness;
use super::pictures::Pictures;
use super::times::{Statistic, Times};
use super::trace_path::TracePath;
use lvk_samples::app::progress::Progress;
use lvk_samples::hybrid::{HybridConfig, HybridRenderer, Method};
use lvk_samples::scene::{Camera, CameraPath, Scene};

/// Cameras of a scene.
pub const CAMERA_COUNT: usize = 5;

/// How much to measure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    /// Width and height of the pictures in pixels.
    pub size: [u32; 2],
    /// Frames along the path of each camera.
    pub frames: u32,
    /// How often each frame is rendered by each method; the median counts.
    pub runs: u32,
    /// Frames that are rendered by each method before any is timed.
    pub warm_up: u32,
    /// Frames of each camera, evenly along its path, whose pictures are compared.
    pub compared: u32,
    /// How often a ray may be reflected or refracted.
    pub max_depth: u32,
    /// The paths of ray tracing.
    pub paths: Vec<TracePath>,
}

/// What was measured of a camera by one path of ray tracing.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// By which path rays were traced.
    pub path: TracePath,
    /// Which of the five cameras, from 0.
    pub camera: usize,
    /// Each frame.
    pub frames: Vec<Times>,
    /// How alike the pictures of both methods are.
    pub likeness: Likeness,
}

/// What was measured of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneResult {
    /// Its name.
    pub name: String,
    /// Vertices, those that differ in normal or texture coordinate counted apart.
    pub vertices: u64,
    /// Triangles.
    pub triangles: u64,
    /// Five for each path of ray tracing, in the order of the plan.
    pub cells: Vec<Cell>,
    /// Which rasteriser found the visible triangles by each path, and why.
    pub rasterisers: Vec<(TracePath, String)>,
    /// How alike pictures by pipeline and by query are, for each camera and both methods; empty where there is one path.
    pub paths_alike: Vec<(Likeness, Likeness)>,
}

impl Plan {
    /// The frame's place on its path, 0 to below 1.
    fn phase(&self, frame: u32) -> f32 {
        (f64::from(frame) / f64::from(self.frames.max(1))) as f32
    }

    /// Frames whose pictures are compared; the first is frame 0.
    fn compared_frames(&self) -> Vec<u32> {
        let count = self.compared.clamp(1, self.frames.max(1));
        (0..count).map(|i| (u64::from(i) * u64::from(self.frames) / u64::from(count)) as u32).collect()
    }

    /// How many frames are rendered for each path of ray tracing.
    fn steps(&self) -> u64 {
        let each = 2 * (u64::from(self.warm_up) + u64::from(self.frames) * u64::from(self.runs));
        CAMERA_COUNT as u64 * (each + 2 * self.compared_frames().len() as u64)
    }
}

impl SceneResult {
    /// The cells of a path, by camera.
    pub fn of(&self, path: TracePath) -> impl Iterator<Item = &Cell> {
        self.cells.iter().filter(move |cell| cell.path == path)
    }

    /// Which rasteriser found the visible triangles by a path, and why.
    pub(super) fn rasteriser(&self, path: TracePath) -> &str {
        self.rasterisers.iter().find(|(known, _)| *known == path).map_or("", |(_, choice)| choice)
    }

    /// The average of a statistic over the cameras.
    #[must_use]
    pub fn mean(&self, path: TracePath, statistic: Statistic) -> Times {
        let rows: Vec<Times> = self.of(path).map(|cell| statistic.of(&cell.frames)).collect();
        Times::mean(&rows)
    }
}

/// Measures `scene`, whose textures fit the device, and gives `pictures` the first frame of each camera.
///
/// # Errors
/// [`PaperError`].
pub fn measure(
    ctx: &Context,
    scene: &Scene,
    plan: &Plan,
    pictures: &Pictures,
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
        let mut pair = Pair::new(ctx, scene, plan, path)?;
        rasterisers.push((path, pair.rasteriser.clone()));
        progress.stage(&name, plan.steps());
        let mut shown = Vec::new();
        for camera in 0..CAMERA_COUNT {
            let (cell, first) = pair.measure_camera(scene, camera, progress)?;
            pictures.write(&scene.name, path, camera, &first)?;
            shown.push(first);
            cells.push(cell);
        }
        pictures.write_sheet(&scene.name, path, &shown)?;
        firsts.push(shown);
    }
    Ok(SceneResult {
        name: scene.name.clone(),
        vertices: scene.positions.len() as u64,
        triangles: scene.triangles.len() as u64,
        cells,
        rasterisers,
        paths_alike: compare_paths(&firsts, plan)?,
    })
}

/// So that no figure bears the name of another path.
fn check_paths(paths: &[TracePath], capabilities: &Capabilities) -> Result<(), PaperError> {
    let other = paths.iter().map(|&path| [path, TracePath::of(path.ray_path(), capabilities)]);
    match other.into_iter().find(|[planned, found]| planned != found) {
        Some([planned, found]) => Err(PaperError::OtherPath { planned: planned.name(), found: found.name() }),
        None => Ok(()),
    }
}

/// Both methods, ready to take turns.
struct Pair<'a> {
    plan: &'a Plan,
    path: TracePath,
    standalone: HybridRenderer,
    hybrid: HybridRenderer,
    rasteriser: String,
    done: u64,
}

impl<'a> Pair<'a> {
    fn new(ctx: &Context, scene: &Scene, plan: &'a Plan, path: TracePath) -> Result<Self, PaperError> {
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
        let choice = hybrid.choose_raster(&scene.cameras[0])?;
        let rasteriser = choice.map_or_else(|| "none".to_owned(), |choice| choice.to_string());
        Ok(Self { plan, path, standalone, hybrid, rasteriser, done: 0 })
    }

    /// The camera's cell, and its first picture by both methods.
    fn measure_camera(
        &mut self,
        scene: &Scene,
        camera: usize,
        progress: &mut Progress,
    ) -> Result<(Cell, [Vec<u8>; 2]), PaperError> {
        let way = CameraPath::sway(scene, camera);
        for _ in 0..self.plan.warm_up {
            self.frame(&way.at(0.0), 0)?;
        }
        let mut frames = Vec::with_capacity(self.plan.frames as usize);
        for frame in 0..self.plan.frames {
            let view = way.at(self.plan.phase(frame));
            let runs: Result<Vec<Times>, PaperError> =
                (0..self.plan.runs.max(1)).map(|run| self.frame(&view, frame + run)).collect();
            frames.push(Statistic::MEDIAN.of(&runs?));
            progress.set(self.done);
        }
        let mut pairs = Vec::new();
        for frame in self.plan.compared_frames() {
            self.frame(&way.at(self.plan.phase(frame)), 0)?;
            pairs.push([self.standalone.read_image()?, self.hybrid.read_image()?]);
        }
        progress.set(self.done);
        let likeness = Likeness::of(&pairs, self.plan.size)?;
        let first = pairs.swap_remove(0);
        Ok((Cell { path: self.path, camera, frames, likeness }, first))
    }

    /// A frame by both methods. They take turns at being first, so that neither has the warmer device.
    fn frame(&mut self, view: &Camera, turn: u32) -> Result<Times, PaperError> {
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

/// For each camera how alike the first two paths are, stand-alone and hybrid.
fn compare_paths(firsts: &[Vec<[Vec<u8>; 2]>], plan: &Plan) -> Result<Vec<(Likeness, Likeness)>, PaperError> {
    let [first, second, ..] = firsts else { return Ok(Vec::new()) };
    let compared = first.iter().zip(second).map(|(a, b)| {
        let alike = |method: usize| Likeness::of(&[[a[method].clone(), b[method].clone()]], plan.size);
        Ok((alike(0)?, alike(1)?))
    });
    compared.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(frames: u32, compared: u32) -> Plan {
        Plan { size: [8, 8], frames, runs: 2, warm_up: 1, compared, max_depth: 1, paths: Vec::new() }
    }

    #[test]
    fn a_device_with_other_queries_than_planned_is_refused() {
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
