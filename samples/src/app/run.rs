//! The program of every sample: device, frames, pictures, timings and what is said about them.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use lvk::{Context, ValidationSink, WindowHandles};

use super::caches::Caches;
use super::device::{self, DeviceNeeds};
use super::frame_name::FrameName;
use super::frames::Frames;
use super::headless::Headless;
use super::interrupt::Interrupt;
use super::play::{Job, Played, play};
use super::progress::Progress;
use super::run_args::RunArgs;
use super::run_error::RunError;
use super::sample::Sample;
use super::{library_warnings, png, say, window};
use crate::shader_folder;
use lvk_dev_driver::{DriverRequest, prepare};

/// Frames to time where none are asked for, on a GPU.
const GPU_FRAMES: u32 = 60;
/// Frames that a GPU renders before any is timed, so that its clocks are up.
const WARM_UP_FRAMES: u32 = 5;

/// What a sample is made with.
pub struct Opening<'a> {
    /// Shows which slow thing is under way.
    pub progress: Progress,
    /// What the device must be able to show pictures in.
    pub(super) window: Option<Arc<dyn WindowHandles>>,
    name: &'a str,
    args: &'a RunArgs,
    sink: &'a ValidationSink,
}

/// A sample that is ready to render.
pub struct Opened<S> {
    /// The sample.
    pub sample: S,
    /// What is said about it, in a line or several; nothing where it says that itself.
    pub headline: String,
}

impl<'a> Opening<'a> {
    pub(super) fn new(name: &'a str, args: &'a RunArgs, sink: &'a ValidationSink) -> Self {
        Self { progress: Progress::visible(), window: None, name, args, sink }
    }

    /// Opens the device that the command line names, or the best.
    ///
    /// # Errors
    /// [`RunError::Device`] and [`RunError::Driver`].
    pub fn device(&mut self, needs: &DeviceNeeds) -> Result<Context, RunError> {
        self.progress.pause();
        let driver = prepare(&DriverRequest { validation: self.args.validate.is_some() })?;
        self.progress.stage("opening the device", 0);
        device::open(self.name, self.args, &driver, self.sink, needs, self.window.clone())
    }

    /// Whether the sample is for a window, where it may be [loading](super::loading::Loading) while others are shown.
    #[must_use]
    pub fn is_for_window(&self) -> bool {
        self.window.is_some()
    }

    /// The folder of built acceleration structures, for samples that keep them, unless the user wants nothing kept. It need
    /// not exist.
    #[must_use]
    pub fn structure_cache(&self) -> Option<PathBuf> {
        let caches = if self.args.no_cache { None } else { Caches::open(self.name) };
        caches.map(|caches| caches.structures().to_owned())
    }

    /// Prints warnings to standard error, past the progress bar.
    pub fn warn(&mut self, warnings: &[String]) {
        if !warnings.is_empty() {
            self.progress.pause();
        }
        warn(warnings);
    }
}

/// Prints warnings to standard error.
pub(crate) fn warn(warnings: &[String]) {
    for warning in warnings {
        eprintln!("warning: {warning}");
    }
}

/// Does what the command line of the sample called `name` says; `make` makes it. Prints to standard output, errors in one
/// line to standard error; the status is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong
/// input, 130 after Ctrl-C.
#[must_use]
pub fn run<S: Sample>(
    name: &str,
    args: &RunArgs,
    make: impl FnOnce(&mut Opening<'_>) -> Result<Opened<S>, RunError>,
) -> ExitCode {
    library_warnings::print();
    match attempt(name, args, make) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.status())
        }
    }
}

fn attempt<S: Sample>(
    name: &str,
    args: &RunArgs,
    make: impl FnOnce(&mut Opening<'_>) -> Result<Opened<S>, RunError>,
) -> Result<(), RunError> {
    if args.list_devices {
        return device::list(args.profile.as_ref());
    }
    if args.window {
        return show(name, args, make);
    }
    let out = args.out_or(name);
    let mut job = Job {
        frames: args.frames.clone().unwrap_or(Frames::Still(GPU_FRAMES)),
        warm_up: WARM_UP_FRAMES,
        frames_per_round: args.round,
        size: [args.width, args.height],
        out: FrameName::new(&out),
        resume: args.resume,
    };
    job.check()?;
    let sink = ValidationSink::default();
    let mut opening = Opening::new(name, args, &sink);
    let Opened { mut sample, headline } = make(&mut opening)?;
    let context = sample.context().clone();
    drop(opening);
    say(&headline);
    if context.capabilities().is_cpu {
        job.warm_up = 0;
        job.frames = args.frames.clone().unwrap_or(Frames::Still(1));
    }
    let played = play(&mut Headless::new(&mut sample), &job, &mut Progress::visible(), &Interrupt::listen());
    let remark = sample.remark();
    drop(sample);
    context.wait_idle()?;
    drop(context);
    if args.validate.is_some() {
        device::report_validation(&sink)?;
    }
    say(&summary(&job, &played?, remark));
    Ok(())
}

fn show<S: Sample>(
    name: &str,
    args: &RunArgs,
    make: impl FnOnce(&mut Opening<'_>) -> Result<Opened<S>, RunError>,
) -> Result<(), RunError> {
    if matches!(args.frames, Some(Frames::Sequence(_))) {
        return Err(RunError::SequenceInWindow);
    }
    if let Some(out) = &args.out {
        png::check_writable(out)?;
    }
    if let Some(folder) = &args.hot_reload {
        shader_folder::take(folder).map_err(|folder| RunError::NoShaders { folder })?;
    }
    let sink = ValidationSink::default();
    window::run(name, args, &sink, make)?;
    args.validate.map_or(Ok(()), |_| device::report_validation(&sink))
}

fn summary(job: &Job, played: &Played, remark: Option<String>) -> String {
    let Played { timings, written, skipped } = played;
    let remark = remark.map_or_else(String::new, |remark| format!("\n{remark}"));
    let out = job.out.path().display();
    match (&job.frames, skipped) {
        (Frames::Still(_), _) => format!("{timings}{remark}\nwrote {out}"),
        (Frames::Sequence(_), 0) => format!("{timings}{remark}\nwrote {written} frames to {out}"),
        _ => format!("{timings}{remark}\nwrote {written} frames to {out}; {skipped} were there"),
    }
}
