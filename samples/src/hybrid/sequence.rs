//! The sample as an animation: a tour through the scene's cameras, and a lamp that may move.

use crate::app::run_error::RunError;
use glam::Vec3;
use lvk::{Context, TextureHandle};

use super::renderer::goes_on;
use super::{HybridConfig, HybridRenderer};
#[cfg(feature = "window")]
use super::{Raster, panel};
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::app::ui::PendingSettings;
use crate::scene::{Camera, CameraPath, Scene};

/// Radius of the lamp's circle, as a share of the diagonal of the scene's bounding box.
const LAMP_SHARE: f32 = 0.04;

/// A renderer, and what moves.
pub struct HybridSequence {
    renderer: HybridRenderer,
    path: CameraPath,
    lamp: LampCircle,
    lamp_moves: bool,
    camera: Camera,
    wanted: PendingSettings<HybridConfig>,
    goes_on: bool,
    /// Description of the scene for the panel.
    scene: String,
}

/// A level circle that passes through the lamp's own place at phase 0.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LampCircle {
    place: Vec3,
    radius: f32,
}

impl HybridSequence {
    /// A tour through the cameras of `scene`, which is the one that `renderer` draws, from the camera with the index
    /// `first` on; with `lamp_moves` the lamp goes round once meanwhile.
    #[must_use]
    pub fn new(renderer: HybridRenderer, scene: &Scene, first: usize, lamp_moves: bool) -> Self {
        let path = CameraPath::tour(scene, first);
        Self {
            wanted: PendingSettings::new(*renderer.config()),
            goes_on: goes_on(scene),
            scene: format!("{}: {} triangles", scene.name, scene.triangles.len()),
            renderer,
            camera: path.at(0.0),
            path,
            lamp: LampCircle::from_scene(scene),
            lamp_moves,
        }
    }

    #[cfg(feature = "window")]
    fn show_rasters(&mut self, ui: &mut egui::Ui, mut raster: Raster) {
        ui.add_enabled_ui(self.renderer.can_choose_raster(), |ui| {
            ui.horizontal(|ui| {
                ui.radio_value(&mut raster, Raster::Compute, "compute");
                ui.radio_value(&mut raster, Raster::Hardware, "hardware rasteriser");
            });
        });
        if self.renderer.can_choose_raster() {
            self.renderer.take_raster(raster);
        }
    }

    /// Settings of the panel, which take effect with the next frame.
    pub fn wanted(&mut self) -> &mut HybridConfig {
        &mut self.wanted.config
    }
}

impl Sample for HybridSequence {
    fn context(&self) -> &Context {
        self.renderer.context()
    }

    fn update(&mut self, time: FrameTime) {
        self.camera = self.path.at(time.phase());
        if self.lamp_moves {
            self.renderer.move_lamp(self.lamp.at(time.phase()));
        }
    }

    fn steps_per_frame(&self) -> u64 {
        self.renderer.tile_count()
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        if let Some(config) = self.wanted.changed_from(*self.renderer.config()) {
            let done = self.renderer.change(&config);
            self.wanted.finish(done, *self.renderer.config());
        }
        Ok(self.renderer.record(frame, &self.camera)?)
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.renderer.resize(extent)?;
        [self.wanted.config.width, self.wanted.config.height] = extent;
        Ok(())
    }

    fn camera_mut(&mut self) -> Option<&mut Camera> {
        Some(&mut self.camera)
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        if ui.checkbox(&mut self.lamp_moves, "the lamp goes round").changed() && !self.lamp_moves {
            self.renderer.move_lamp(self.lamp.at(0.0));
        }
        let capabilities = self.renderer.context().capabilities();
        self.wanted.show(ui, |ui, config| panel::show_settings(ui, config, capabilities, self.goes_on));
        if let Some(raster) = self.renderer.raster() {
            self.show_rasters(ui, raster);
        }
        ui.label(&self.scene);
    }

    fn reload(&mut self) -> Result<(), RunError> {
        Ok(self.renderer.reload()?)
    }
}

impl LampCircle {
    fn from_scene(scene: &Scene) -> Self {
        let (low, high) = scene.bounds();
        let radius = LAMP_SHARE * Vec3::from(low).distance(Vec3::from(high));
        Self { place: Vec3::from(scene.light.position), radius }
    }

    fn at(&self, phase: f32) -> [f32; 3] {
        let (sin, cos) = (phase * std::f32::consts::TAU).sin_cos();
        (self.place + self.radius * Vec3::new(cos - 1.0, 0.0, sin)).to_array()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lamp_starts_at_its_place_and_comes_back() {
        let circle = LampCircle { place: Vec3::new(1.0, 2.0, 3.0), radius: 0.5 };
        assert_eq!(circle.at(0.0), [1.0, 2.0, 3.0]);
        let far = Vec3::from(circle.at(0.5)).distance(circle.place);
        assert!((far - 1.0).abs() < 1e-5, "{far}");
    }
}
