//! The interface of a sample: a type that updates and records frames, with further methods for windows.
//!
//! - **new** is the sample's own constructor: from a context, a scene and a configuration. All slow work happens here: uploads,
//!   acceleration structures, every pipeline.
//! - [`Sample::update`] moves the animation to a [`FrameTime`]: cameras, lights, bones. The frame depends on the time alone and
//!   not on earlier frames, so that processes can share a sequence in ranges. A step-by-step simulation is evaluated in closed
//!   form, or from frame 0.
//! - [`Sample::record`] uploads the frame's data, records its commands, and returns the texture of the image. It neither
//!   submits nor waits; [`Frame::next_step`](super::frame::Frame::next_step) splits long frames.
//!
//! [`cli`](super::cli) does the rest: device, validation, `--frames`, images, progress, Ctrl-C, timings. The program follows
//! from [`SampleInfo`](super::sample_info::SampleInfo).
//!
//! ```ignore
//! impl Sample for Cloud {
//!     fn context(&self) -> &Context {
//!         &self.ctx
//!     }
//!
//!     fn update(&mut self, time: FrameTime) {
//!         self.constants.phase = time.phase();
//!     }
//!
//!     fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
//!         let constants = frame.cmd.upload(&self.constants)?;
//!         frame.pass("cloud", |cmd| self.draw(cmd, constants))?;
//!         Ok(self.target.image())
//!     }
//! }
//! ```
//!
//! For a window, a sample also implements [`resize`](Sample::resize), [`camera_mut`](Sample::camera_mut),
//! `panel`, which needs the feature `window`, [`reload`](Sample::reload) and [`drop_file`](Sample::drop_file). A sample that takes long to create is
//! [`Loading`](super::loading::Loading) there: a thread creates it while the window displays the progress.

use std::path::Path;

use lvk::{Context, TextureHandle};

use super::frame::Frame;
use super::run_error::RunError;
use crate::scene::Camera;

/// Frames a second of every animation.
pub const FRAMES_PER_SECOND: u32 = 30;

/// The time of a frame in an animation that repeats itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameTime {
    /// Number of the frame, from 0.
    pub frame: u32,
    /// Frames of one round of whatever goes round; at least 1.
    pub frames_per_round: u32,
    /// Frames a second; at least 1.
    pub frames_per_second: u32,
}

impl FrameTime {
    /// Frame `frame` of a sequence, whose time step is fixed.
    #[must_use]
    pub fn from_frame(frame: u32, frames_per_round: u32) -> Self {
        Self { frame, frames_per_round, frames_per_second: FRAMES_PER_SECOND }
    }

    /// The time `milliseconds` after frame 0 of a sequence with rounds of `frames_per_round` frames.
    #[must_use]
    pub fn from_millis(milliseconds: u32, frames_per_round: u32) -> Self {
        let round = u64::from(frames_per_round) * 1000 / u64::from(FRAMES_PER_SECOND);
        let frames_per_round = u32::try_from(round).unwrap_or(u32::MAX);
        Self { frame: milliseconds, frames_per_round, frames_per_second: 1000 }
    }

    /// Phase of the round, from 0 to below 1.
    #[must_use]
    pub fn phase(&self) -> f32 {
        let round = self.frames_per_round.max(1);
        (f64::from(self.frame % round) / f64::from(round)) as f32
    }

    /// Seconds since frame 0.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        f64::from(self.frame) / f64::from(self.frames_per_second.max(1))
    }
}

/// A sample, ready to render.
pub trait Sample {
    /// The device.
    fn context(&self) -> &Context;

    /// Moves everything, the camera included, to its place at a frame time, whatever frame came before.
    fn update(&mut self, time: FrameTime);

    /// Records a frame, and returns the texture of its image: red, green, blue and alpha of each pixel, 8 bits each, sRGB. It
    /// can be sampled, which gives the numbers as they are encoded: its format is `Rgba8Unorm`, or it is a view of that format.
    /// It holds the frame until the next one is recorded.
    ///
    /// # Errors
    /// Errors of the sample.
    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError>;

    /// Number of steps into which [`record`](Self::record) splits a frame.
    fn steps_per_frame(&self) -> u64 {
        1
    }

    /// Reads what a frame left for the host. The GPU has finished the frame; only called where frames are waited for, so not
    /// in windows.
    ///
    /// # Errors
    /// Errors of the sample.
    fn after_frame(&mut self) -> Result<(), RunError> {
        Ok(())
    }

    /// Returns the text below the timings after the last frame.
    ///
    /// # Errors
    /// Errors of the sample.
    fn remark(&self) -> Result<Option<String>, RunError> {
        Ok(None)
    }

    /// Resizes the images to `extent` pixels. Images of samples without this method are stretched.
    ///
    /// # Errors
    /// Errors of the sample. It must still be able to render, with the old extent.
    fn resize(&mut self, _extent: [u32; 2]) -> Result<(), RunError> {
        Ok(())
    }

    /// True if the animation of its window waits for the space key: for pictures that get better while nothing moves.
    fn stands_at_first(&self) -> bool {
        false
    }

    /// The camera of the next frame, which windows move; `None` where the sample has no camera that could be elsewhere.
    fn camera_mut(&mut self) -> Option<&mut Camera> {
        None
    }

    /// Returns the camera of the next frame.
    fn view(&mut self) -> Option<Camera> {
        self.camera_mut().copied()
    }

    /// Moves the camera until the next [`update`](Self::update).
    fn set_view(&mut self, camera: &Camera) {
        if let Some(own) = self.camera_mut() {
            *own = *camera;
        }
    }

    /// True if dragging the mouse goes around what the camera looks at, until the user chooses to fly; else it turns the camera.
    fn orbits_at_first(&self) -> bool {
        false
    }

    /// True once after the sample has chosen another camera, which takes the place of the user's. Asked before every frame of a
    /// window.
    fn takes_camera_back(&mut self) -> bool {
        false
    }

    /// A file was dropped on the window. A sample that can show it loads it [on a thread](super::loading::LoadThread), and
    /// shows what it showed before until then.
    fn drop_file(&mut self, _path: &Path) {}

    /// Lays out the sample's own switches in the panel of its window.
    #[cfg(feature = "window")]
    fn panel(&mut self, _ui: &mut egui::Ui) {}

    /// Lays out what stands over the picture and beside the panel, seen or not.
    #[cfg(feature = "window")]
    fn overlay(&mut self, _ui: &egui::Context) {}

    /// True if it is still being loaded by another thread, asked before every frame of a window: then its frames are no
    /// pictures of it yet, and are not counted.
    ///
    /// # Errors
    /// Errors of loading.
    fn is_loading(&mut self) -> Result<bool, RunError> {
        Ok(false)
    }

    /// Switches to the next variant that the sample can show, from the next frame on: the action of the key N.
    fn next(&mut self) {}

    /// Recreates all pipelines from changed shaders.
    ///
    /// # Errors
    /// Errors of the sample. It must still be able to render, by the old pipelines.
    fn reload(&mut self) -> Result<(), RunError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_ends_where_it_began() {
        let at = |frame| FrameTime::from_frame(frame, 240);
        assert_eq!(at(0).phase(), 0.0);
        assert_eq!(at(60).phase(), 0.25);
        assert_eq!(at(240).phase(), 0.0);
        assert_eq!(at(u32::MAX - 15).phase(), at((u32::MAX - 15) % 240).phase());
        assert_eq!(at(240).seconds(), 8.0);
        assert_eq!(FrameTime::from_frame(3, 0).phase(), 0.0);
    }

    #[test]
    fn the_clock_gives_each_frame_its_frame_time() {
        for (milliseconds, frame) in [(0, 0), (1000, 30), (2500, 75), (9000, 270)] {
            let (by_clock, by_frame) =
                (FrameTime::from_millis(milliseconds, 240), FrameTime::from_frame(frame, 240));
            assert_eq!(by_clock.seconds(), by_frame.seconds());
            assert_eq!(by_clock.phase(), by_frame.phase());
        }
        assert_eq!(FrameTime::from_millis(5, 0).phase(), 0.0);
    }
}
