//! What a sample is to the program around it: a type with three verbs.
//!
//! - **new** is the sample's own: from a context, a scene and a configuration. All that is slow happens here: uploads,
//!   acceleration structures, every pipeline.
//! - [`Sample::update`] puts it at a [`Moment`] of its animation: cameras, lights, bones. What it shows afterwards
//!   depends on the moment alone and not on the moments before, so that a sequence can be cut into ranges that several
//!   processes share. Something that has to be simulated step by step is evaluated in closed form, or from frame 0.
//! - [`Sample::render`] renders one frame, waits for it and answers what its passes took.
//!
//! [`run`](super::run::run) does all the rest: device, validation, `--frames`, pictures, progress, Ctrl-C, timings. A
//! sample's `run.rs` is then
//!
//! ```ignore
//! pub fn run(args: &CloudArgs) -> ExitCode {
//!     app::run::run("cloud", &args.run, |opening| {
//!         let ctx = opening.device(&DeviceNeeds::default())?;
//!         let cloud = Cloud::new(&ctx, &args.config(&ctx)?)?;
//!         Ok(Opened { headline: cloud.headline(), sample: cloud, context: ctx })
//!     })
//! }
//! ```
//!
//! where `CloudArgs` holds `#[command(flatten)] pub run: RunArgs`, `CloudError: Into<RunError>` says which errors the
//! user can mend, and `Cloud` implements [`Sample`].

/// Frames a second of every animation.
pub const FRAMES_PER_SECOND: u32 = 30;

/// A moment of an animation that repeats itself after some frames. The time step is fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment {
    /// Number of the frame, from 0.
    pub frame: u32,
    /// Frames of one round of whatever goes round; at least 1.
    pub frames_per_round: u32,
}

impl Moment {
    /// Where in its round the animation is, from 0 to below 1.
    #[must_use]
    pub fn phase(&self) -> f32 {
        let round = self.frames_per_round.max(1);
        (f64::from(self.frame % round) / f64::from(round)) as f32
    }

    /// Seconds since frame 0.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        f64::from(self.frame) / f64::from(FRAMES_PER_SECOND)
    }
}

/// Names of a frame's passes, in the order in which they run, and what each took on the GPU in milliseconds. Empty where
/// the device has no timestamps.
pub type PassTimes = Vec<(&'static str, f64)>;

/// A sample, ready to render.
pub trait Sample {
    /// What can go wrong while it renders.
    type Error: Into<super::run_error::RunError>;

    /// Puts everything that moves where it is at `moment`, whatever was shown before.
    ///
    /// # Errors
    /// The sample's own.
    fn update(&mut self, moment: Moment) -> Result<(), Self::Error>;

    /// Into how many steps rendering a frame is cut, for the progress bar.
    fn steps_per_frame(&self) -> u64 {
        1
    }

    /// Renders a frame and waits for it. Calls `after_step` with the number of steps done.
    ///
    /// # Errors
    /// The sample's own.
    fn render(&mut self, after_step: &mut dyn FnMut(u64)) -> Result<PassTimes, Self::Error>;

    /// The last frame: red, green, blue and alpha of each pixel, 8 bits each, sRGB, rows from the top.
    ///
    /// # Errors
    /// The sample's own.
    fn picture(&self) -> Result<Vec<u8>, Self::Error>;

    /// What is to be said below the timings when the last frame is done.
    fn remark(&self) -> Option<String> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_ends_where_it_began() {
        let at = |frame| Moment { frame, frames_per_round: 240 };
        assert_eq!(at(0).phase(), 0.0);
        assert_eq!(at(60).phase(), 0.25);
        assert_eq!(at(240).phase(), 0.0);
        assert_eq!(at(u32::MAX - 15).phase(), at((u32::MAX - 15) % 240).phase());
        assert_eq!(at(240).seconds(), 8.0);
        assert_eq!(Moment { frame: 3, frames_per_round: 0 }.phase(), 0.0);
    }
}
