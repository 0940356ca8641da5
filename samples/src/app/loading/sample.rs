//! A sample that may still be loading.

use std::path::Path;

use lvk::{Context, Holder, TextureHandle};

use super::background::background;
use super::thread::LoadThread;
use crate::app::cli::ReadySample;
use crate::app::frame::Frame;
use crate::app::print_line;
use crate::app::progress::Progress;
use crate::app::run_error::RunError;
use crate::app::sample::{FrameTime, Sample};
use crate::scene::Camera;

/// A sample that a thread may still be loading. Until it is there, frames are empty, with the progress over them.
pub struct Loading<S> {
    ctx: Context,
    state: State<S>,
}

enum State<S> {
    UnderWay(UnderWay<S>),
    Ready(S),
}

/// The thread that loads, and what is shown meanwhile.
struct UnderWay<S> {
    thread: LoadThread<Made<S>>,
    background: Holder<TextureHandle>,
    /// The size that pictures are to have by now, if not that from the beginning.
    extent: Option<[u32; 2]>,
    frames: u32,
}

type Made<S> = Result<ReadySample<S>, RunError>;

impl<S: Sample> Loading<S> {
    /// Wraps a sample that is already loaded.
    #[must_use]
    pub fn ready(sample: S) -> Self {
        Self { ctx: sample.context().clone(), state: State::Ready(sample) }
    }

    /// Runs `load` on a thread of its own. `load` must call [`Progress::go_on`] from time to time. The log lines about
    /// the sample are printed when it is loaded.
    ///
    /// # Errors
    /// [`RunError`] if the thread or the texture cannot be created. Errors of `load` come from [`Sample::is_loading`].
    pub fn start(
        ctx: &Context,
        load: impl FnOnce(&mut Progress) -> Made<S> + Send + 'static,
    ) -> Result<Self, RunError>
    where
        S: Send + 'static,
    {
        let (background, thread) = (background(ctx)?, LoadThread::start(load)?);
        let under_way = UnderWay { thread, background, extent: None, frames: 0 };
        Ok(Self { ctx: ctx.clone(), state: State::UnderWay(under_way) })
    }

    /// The sample, if it is there.
    fn sample(&self) -> Option<&S> {
        match &self.state {
            State::UnderWay(_) => None,
            State::Ready(sample) => Some(sample),
        }
    }

    fn sample_mut(&mut self) -> Option<&mut S> {
        match &mut self.state {
            State::UnderWay(_) => None,
            State::Ready(sample) => Some(sample),
        }
    }
}

impl<S: Sample> UnderWay<S> {
    /// Takes the result of the thread, once it has ended and a frame was shown.
    fn take_after_a_frame(&mut self) -> Option<Made<S>> {
        if self.frames == 0 {
            return None;
        }
        let ReadySample { mut sample, summary } = match self.thread.take()? {
            Ok(opened) => opened,
            Err(error) => return Some(Err(error)),
        };
        if let Some(extent) = self.extent
            && let Err(error) = sample.resize(extent)
        {
            return Some(Err(error));
        }
        let seconds = self.thread.elapsed().as_secs_f32();
        eprintln!("loaded in {seconds:.1} s, with {} frames shown meanwhile", self.frames);
        Some(Ok(ReadySample { sample, summary }))
    }
}

impl<S: Sample> Sample for Loading<S> {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn is_loading(&mut self) -> Result<bool, RunError> {
        let State::UnderWay(under_way) = &mut self.state else { return Ok(false) };
        // One frame comes first even where the thread is faster.
        let Some(made) = under_way.take_after_a_frame() else { return Ok(true) };
        let ReadySample { sample, summary } = made?;
        print_line(&summary);
        self.state = State::Ready(sample);
        Ok(false)
    }

    fn update(&mut self, time: FrameTime) {
        if let Some(sample) = self.sample_mut() {
            sample.update(time);
        }
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        match &mut self.state {
            State::Ready(sample) => sample.record(frame),
            State::UnderWay(under_way) => {
                under_way.frames += 1;
                Ok(*under_way.background)
            }
        }
    }

    fn steps_per_frame(&self) -> u64 {
        self.sample().map_or(1, S::steps_per_frame)
    }

    fn after_frame(&mut self) -> Result<(), RunError> {
        self.sample_mut().map_or(Ok(()), |sample| sample.after_frame())
    }

    fn remark(&self) -> Result<Option<String>, RunError> {
        self.sample().map_or(Ok(None), S::remark)
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        match &mut self.state {
            State::Ready(sample) => sample.resize(extent),
            State::UnderWay(under_way) => {
                under_way.extent = Some(extent);
                Ok(())
            }
        }
    }

    fn stands_at_first(&self) -> bool {
        self.sample().is_some_and(S::stands_at_first)
    }

    fn view(&mut self) -> Option<Camera> {
        self.sample_mut().and_then(S::view)
    }

    fn set_view(&mut self, camera: &Camera) {
        if let Some(sample) = self.sample_mut() {
            sample.set_view(camera);
        }
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        if let Some(sample) = self.sample_mut() {
            sample.panel(ui);
        }
    }

    #[cfg(feature = "window")]
    fn overlay(&mut self, ui: &egui::Context) {
        match &mut self.state {
            State::Ready(sample) => sample.overlay(ui),
            State::UnderWay(under_way) => under_way.thread.show(ui),
        }
    }

    fn orbits_at_first(&self) -> bool {
        self.sample().is_some_and(S::orbits_at_first)
    }

    fn takes_camera_back(&mut self) -> bool {
        self.sample_mut().is_some_and(S::takes_camera_back)
    }

    fn drop_file(&mut self, path: &Path) {
        if let Some(sample) = self.sample_mut() {
            sample.drop_file(path);
        }
    }

    fn next(&mut self) {
        if let Some(sample) = self.sample_mut() {
            sample.next();
        }
    }

    fn reload(&mut self) -> Result<(), RunError> {
        self.sample_mut().map_or(Ok(()), |sample| sample.reload())
    }
}
