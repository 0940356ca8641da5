//! Frames of a sample without a window: each is waited for and can be read.

use lvk::{TextureHandle, TextureRegion};

use super::frame::Frame;
use super::pass_times::PassTimes;
use super::run_error::RunError;
use super::sample::{FrameTime, Sample};
use super::sequence::FrameSource;

/// A frame that the GPU has finished.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendered {
    /// The picture, as [`Sample::record`] has it.
    pub picture: TextureHandle,
    /// GPU times of the passes.
    pub times: PassTimes,
}

/// Renders a frame of `sample` and waits for it; `after_step` is told how many steps are done.
///
/// # Errors
/// The sample's own.
pub fn render<S: Sample>(sample: &mut S, after_step: &mut dyn FnMut(u64)) -> Result<Rendered, RunError> {
    let mut frame = Frame::waited(sample.context(), after_step)?;
    let picture = sample.record(&mut frame)?;
    let times = frame.finish()?;
    sample.after_frame()?;
    Ok(Rendered { picture, times })
}

/// Renders a frame of `sample` and reads it: red, green, blue and alpha of each pixel, 8 bits each, sRGB, rows from the
/// top.
///
/// # Errors
/// The sample's own.
pub fn picture<S: Sample>(sample: &mut S) -> Result<Vec<u8>, RunError> {
    let picture = render(sample, &mut |_| {})?.picture;
    Ok(sample.context().download_texture(picture, &TextureRegion::default())?)
}

/// Plays a sample.
pub struct Headless<'a, S> {
    sample: &'a mut S,
    picture: Option<TextureHandle>,
}

impl<'a, S: Sample> Headless<'a, S> {
    /// For `sample`, of which nothing is rendered yet.
    pub fn new(sample: &'a mut S) -> Self {
        Self { sample, picture: None }
    }
}

impl<S: Sample> FrameSource for Headless<'_, S> {
    fn update(&mut self, time: FrameTime) {
        self.sample.update(time);
    }

    fn steps_per_frame(&self) -> u64 {
        self.sample.steps_per_frame()
    }

    fn render(&mut self, after_step: &mut dyn FnMut(u64)) -> Result<PassTimes, RunError> {
        let Rendered { picture, times } = render(self.sample, after_step)?;
        self.picture = Some(picture);
        Ok(times)
    }

    fn picture(&self) -> Result<Vec<u8>, RunError> {
        let Some(picture) = self.picture else { return Ok(Vec::new()) };
        Ok(self.sample.context().download_texture(picture, &TextureRegion::default())?)
    }
}
