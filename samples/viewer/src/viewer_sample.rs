//! What the viewer does in each frame, and in a window.

use std::path::Path;

use glam::{Quat, Vec3};
use lvk::{Context, TextureHandle};
use lvk_samples::app::cli::warn;
use lvk_samples::app::frame::Frame;
use lvk_samples::app::run_error::RunError;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::scene::Camera;

use crate::config::{Method, ViewerConfig};
use crate::gpu::DrawnInstances;
#[cfg(feature = "window")]
use crate::panel;
use crate::present::Present;
use crate::renderer::Renderer;
use crate::viewer::Viewer;

/// Most rounds of frames that look for the mip levels of a picture. Other levels may bend rays, which read other levels then.
const MOST_ROUNDS: u32 = 4;
/// Frames of a round.
const FRAMES_OF_ROUND: u32 = 4;

impl Viewer {
    /// One more sample, or one more frame of the real-time method, which never ends.
    fn record_progress(&mut self, frame: &mut Frame<'_>) -> Result<(), RunError> {
        if self.shown.gpu.stream_textures(&self.ctx)? {
            self.done = 0;
        }
        self.shown.gpu.clear_wanted_mips(&mut frame.cmd)?;
        let is_whole = self.config.method == Method::PathTrace && self.done >= self.config.samples;
        let count = if is_whole { 0 } else { 1 };
        if count > 0 {
            self.add_samples(frame, count, true)?;
        }
        Ok(())
    }

    /// Begins a picture anew.
    pub(crate) fn begin(&mut self) {
        (self.done, self.frame_number, self.before) = (0, 0, self.camera);
    }

    /// Renders a few frames that nobody sees until the mip levels are resident that they read.
    fn load_wanted_textures(&mut self) -> lvk::Result<()> {
        if self.shown.gpu.texture_memory().is_none() {
            return Ok(());
        }
        for round in 0..MOST_ROUNDS {
            let mut frame = Frame::free(&self.ctx)?;
            self.shown.gpu.clear_wanted_mips(&mut frame.cmd)?;
            for _ in 0..FRAMES_OF_ROUND {
                self.add_samples(&mut frame, 1, false)?;
                frame.next_step()?;
            }
            frame.finish()?;
            self.begin();
            if !self.shown.gpu.load_wanted_textures(&self.ctx, round == 0)? {
                break;
            }
        }
        let count = self.texture_memory().map_or(0, |memory| memory.coarse_count);
        if count > 0 && !self.has_warned_of_textures {
            self.has_warned_of_textures = true;
            warn(&[format!(
                "{count} images are coarser than the picture needs; a larger --texture-budget shows them"
            )]);
        }
        Ok(())
    }
}

impl Sample for Viewer {
    fn context(&self) -> &Context {
        &self.ctx
    }

    /// The animation goes on; without one the camera goes around what it looks at. Outside of windows each frame begins anew, so
    /// that it does not depend on those before.
    fn update(&mut self, time: FrameTime) {
        self.playback.elapsed = time.seconds();
        self.pose();
        let phase = if self.playback.animation.is_some() { 0.0 } else { time.phase() };
        self.set_camera(&around(&self.shown.cameras[self.chosen].camera, phase));
        if !self.config.is_progressive {
            self.begin();
        }
    }

    /// Unless an animation was asked for.
    fn stands_at_first(&self) -> bool {
        self.playback.animation.is_none()
    }

    fn steps_per_frame(&self) -> u64 {
        if self.config.is_progressive { 1 } else { self.config.samples.div_ceil(self.step_samples()).into() }
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        self.take_dropped();
        if self.config.is_progressive {
            self.record_progress(frame)?;
            return Ok(self.target.image());
        }
        self.begin();
        self.load_wanted_textures()?;
        while self.done < self.config.samples {
            if self.done > 0 {
                frame.next_step()?;
            }
            let count = (self.config.samples - self.done).min(self.step_samples());
            self.add_samples(frame, count, self.done + count == self.config.samples)?;
        }
        Ok(self.target.image())
    }

    fn after_frame(&mut self) -> Result<(), RunError> {
        self.drawn_instances()?;
        Ok(())
    }

    fn remark(&self) -> Result<Option<String>, RunError> {
        if let Some(rays) = self.ray_count()? {
            let paths = f64::from(self.config.width) * f64::from(self.config.height) * f64::from(self.done);
            let (rays, mean) = (rays as f64 / 1e6, rays as f64 / paths);
            return Ok(Some(format!("rays      {rays:.1} million a frame, {mean:.1} a path")));
        }
        let all = self.counts().1;
        let text = |drawn: DrawnInstances| {
            let DrawnInstances { count, triangle_count, in_frustum } = drawn;
            format!(
                "culling   {count} of {all} instances rasterised ({triangle_count} triangles), {in_frustum} in the frustum"
            )
        };
        Ok(self.drawn.known().filter(|_| self.config.culls()).map(text))
    }

    fn resize(&mut self, [width, height]: [u32; 2]) -> Result<(), RunError> {
        Ok(self.configure(&ViewerConfig { width, height, ..self.config })?)
    }

    fn view(&mut self) -> Option<Camera> {
        Some(self.camera)
    }

    fn set_view(&mut self, camera: &Camera) {
        self.set_camera(camera);
    }

    /// Looks through the next camera of the model.
    fn next(&mut self) {
        self.choose_camera((self.chosen + 1) % self.shown.cameras.len());
    }

    fn orbits_at_first(&self) -> bool {
        true
    }

    fn takes_camera_back(&mut self) -> bool {
        std::mem::take(&mut self.has_chosen_camera)
    }

    fn drop_file(&mut self, path: &Path) {
        let light = (&self.shown.environment, self.shown.disc_radius);
        self.dropped.load(&self.ctx, path, light, self.config.texture_budget);
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        panel::show_model(ui, &self.shown.name, self.dropped.error());
        if let Some(chosen) = panel::choose_camera(ui, &self.shown.cameras, self.chosen) {
            self.choose_camera(chosen);
        }
        let animations = &self.shown.gpu.rig().animations;
        if let Some(animation) = panel::choose_animation(ui, animations, self.playback.animation) {
            self.play(animation, 0.0);
        }
        let mut config = self.config;
        let counts_steps = crate::config::counts_steps(self.ctx.capabilities());
        panel::show_settings(ui, &mut config, counts_steps);
        if config != self.config {
            self.refused = self.configure(&config).err().map(|error| error.to_string());
        }
        panel::show_error(ui, self.refused.as_deref());
        let (triangles, instances) = self.counts();
        ui.label(format!("samples: {}; {triangles} triangles, {instances} instances", self.done));
        if self.config.culls() && self.drawn.poll(&self.ctx, self.shown.gpu.culling()).is_ok() {
            panel::show_drawn(ui, self.drawn.known());
        }
        panel::show_memory(ui, self.shown.gpu.structure_bytes);
        panel::show_textures(ui, self.texture_memory());
    }

    #[cfg(feature = "window")]
    fn overlay(&mut self, ui: &egui::Context) {
        self.dropped.show(ui);
    }

    fn reload(&mut self) -> Result<(), RunError> {
        let occludes = self.config.occludes(self.counts().1);
        let (renderer, present) =
            (Renderer::new(&self.ctx, &self.config, occludes)?, Present::new(&self.ctx)?);
        (self.renderer, self.present, self.done, self.frame_number) = (renderer, present, 0, 0);
        Ok(())
    }
}

/// The camera after a part of a round about the vertical through what it looks at.
fn around(camera: &Camera, phase: f32) -> Camera {
    let (eye, target) = (Vec3::from(camera.eye), Vec3::from(camera.target));
    let turn = Quat::from_rotation_y(std::f32::consts::TAU * phase);
    let eye = if phase == 0.0 { eye } else { target + turn * (eye - target) };
    Camera { eye: eye.to_array(), up: (turn * Vec3::from(camera.up)).to_array(), ..*camera }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_leads_around_the_target_and_back() {
        let camera = Camera::looking_at([3.0, 1.0, 0.0], [1.0, 0.0, 0.0], 40.0);
        assert_eq!(around(&camera, 0.0), camera);
        let opposite = around(&camera, 0.5);
        assert!(Vec3::from(opposite.eye).distance(Vec3::new(-1.0, 1.0, 0.0)) < 1e-5);
        assert_eq!(opposite.target, camera.target);
    }
}
