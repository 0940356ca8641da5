//! What a sample is to the program around it: a type with two verbs, and some more where it has a window.
//!
//! - **new** is the sample's own: from a context, a scene and a configuration. All that is slow happens here: uploads,
//!   acceleration structures, every pipeline.
//! - [`Sample::update`] puts it at a [`FrameTime`] of its animation: cameras, lights, bones. What it shows afterwards
//!   depends on the moment alone and not on the moments before, so that a sequence can be cut into ranges that several
//!   processes share. Something that has to be simulated step by step is evaluated in closed form, or from frame 0.
//! - [`Sample::record`] uploads what the frame needs, records it, and answers the texture that shows it. It neither
//!   submits nor waits; [`Frame::next_step`](super::frame::Frame::next_step) cuts frames that take long.
//!
//! [`run`](super::cli::run_with) does all the rest: device, validation, `--frames`, pictures, progress, Ctrl-C, timings. A
//! sample's `run.rs` is then
//!
//! ```ignore
//! pub fn run(args: &CloudArgs) -> ExitCode {
//!     app::cli::run_with("cloud", &args.run, |setup| {
//!         let ctx = setup.device(&DeviceNeeds::default())?;
//!         let cloud = Cloud::new(&ctx, &args.config(&ctx)?)?;
//!         Ok(ReadySample { summary: cloud.summary(), sample: cloud })
//!     })
//! }
//! ```
//!
//! where `CloudArgs` holds `#[command(flatten)] pub run: RunArgs`, `CloudError: Into<RunError>` says which errors the
//! user can mend, and `Cloud` implements [`Sample`]. Samples that trace rays have [`RayArgs`](super::ray_args::RayArgs) beside
//! it, and ask for a device by `DeviceNeeds::tracing`; those that only rasterise share `crate::raster`.
//!
//! ```ignore
//! impl Sample for Cloud {
//!     type Error = CloudError;
//!
//!     fn context(&self) -> &Context {
//!         &self.ctx
//!     }
//!
//!     fn update(&mut self, time: FrameTime) -> Result<(), CloudError> {
//!         self.constants.phase = time.phase();
//!         Ok(())
//!     }
//!
//!     fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, CloudError> {
//!         self.ctx.upload_buffer(*self.frame, 0, bytemuck::bytes_of(&self.constants))?;
//!         frame.pass("cloud", |cmd| self.draw(cmd))?;
//!         Ok(*self.picture)
//!     }
//! }
//! ```
//!
//! For a window it also says how to [`resize`](Sample::resize), to be looked at from elsewhere
//! ([`view`](Sample::view), [`set_view`](Sample::set_view)), which switches it has ([`panel`](Sample::panel)), and to compile its
//! shaders again ([`reload`](Sample::reload)). One that takes long to make is [`Loading`](super::loading::Loading) there: a thread
//! makes it while the window shows how far that is.

use lvk::{Context, TextureHandle};

use super::frame::Frame;
use super::run_error::RunError;
use crate::scene::Camera;

/// Frames a second of every animation.
pub const FRAMES_PER_SECOND: u32 = 30;

/// A moment of an animation that repeats itself after some frames.
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

    /// So many milliseconds after frame 0 of a sequence with rounds of `frames_per_round` frames.
    #[must_use]
    pub fn from_millis(milliseconds: u32, frames_per_round: u32) -> Self {
        let round = u64::from(frames_per_round) * 1000 / u64::from(FRAMES_PER_SECOND);
        let frames_per_round = u32::try_from(round).unwrap_or(u32::MAX);
        Self { frame: milliseconds, frames_per_round, frames_per_second: 1000 }
    }

    /// Where in its round the animation is, from 0 to below 1.
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
    /// What can go wrong while it renders.
    type Error: From<lvk::Error> + Into<RunError>;

    /// The device.
    fn context(&self) -> &Context;

    /// Puts everything that moves where it is at `moment`, whatever was shown before, the camera included.
    ///
    /// # Errors
    /// The sample's own.
    fn update(&mut self, time: FrameTime) -> Result<(), Self::Error>;

    /// Records a frame, and answers the texture that shows it: red, green, blue and alpha of each pixel, 8 bits each, sRGB. It
    /// can be sampled, which gives the numbers as they are encoded: its format is `Rgba8Unorm`, or it is a view of that format.
    /// It holds the frame until the next one is recorded.
    ///
    /// # Errors
    /// The sample's own.
    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, Self::Error>;

    /// Into how many steps [`record`](Self::record) cuts a frame.
    fn steps_per_frame(&self) -> u64 {
        1
    }

    /// Reads what a frame left for the host. The GPU has finished the frame; only called where frames are waited for, so not
    /// in windows.
    ///
    /// # Errors
    /// The sample's own.
    fn after_frame(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }

    /// What is to be said below the timings when the last frame is done.
    fn remark(&self) -> Option<String> {
        None
    }

    /// Renders pictures of `extent` pixels from now on. Where a sample does not, its pictures are stretched.
    ///
    /// # Errors
    /// The sample's own. It must still be able to render, with the old extent.
    fn resize(&mut self, _extent: [u32; 2]) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Whether the animation of its window waits for the space key: for pictures that get better while nothing moves.
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

    /// Lays out the sample's own switches in the panel of its window.
    fn panel(&mut self, _ui: &mut egui::Ui) {}

    /// Lays out what stands over the picture and beside the panel, seen or not.
    fn overlay(&mut self, _ui: &egui::Context) {}

    /// Whether it is still being loaded by another thread, asked before every frame of a window: then its frames are no
    /// pictures of it yet, and are not counted.
    ///
    /// # Errors
    /// What kept it from being loaded.
    fn is_loading(&mut self) -> Result<bool, Self::Error> {
        Ok(false)
    }

    /// Goes on to the next of what the sample can show, from the next frame on: what the key N of its window asks.
    fn next(&mut self) {}

    /// Makes all pipelines anew, of shaders that have changed.
    ///
    /// # Errors
    /// The sample's own. It must still be able to render, by the old pipelines.
    fn reload(&mut self) -> Result<(), Self::Error> {
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
    fn frames_are_moments_by_the_clock() {
        for (milliseconds, frame) in [(0, 0), (1000, 30), (2500, 75), (9000, 270)] {
            let (by_clock, by_frame) =
                (FrameTime::from_millis(milliseconds, 240), FrameTime::from_frame(frame, 240));
            assert_eq!(by_clock.seconds(), by_frame.seconds());
            assert_eq!(by_clock.phase(), by_frame.phase());
        }
        assert_eq!(FrameTime::from_millis(5, 0).phase(), 0.0);
    }
}
