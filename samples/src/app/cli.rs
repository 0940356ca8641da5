//! The program of every sample, made from its [`SampleInfo`]: command line, device, frames, images, timings and log lines.

use super::sample_info::SampleInfo;
use super::summary::{raster_summary, ray_summary};
pub use super::window::{EventLoopBuilder, event_loop};

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::{CommandFactory as _, FromArgMatches as _, Parser};
use lvk::{Context, ValidationSink, WindowHandles};

use super::caches::Caches;
use super::device::{self, DeviceNeeds};
use super::frame_name::FrameName;
use super::frames::Frames;
use super::headless::Headless;
use super::interrupt::Interrupt;
use super::progress::Progress;
use super::ray_args::RayTracing;
use super::run_args::RunArgs;
use super::run_error::RunError;
use super::sample::Sample;
use super::sequence::{RenderReport, RenderRequest, render_frames};
use super::{file_size_limit, library_warnings, png, print_line, print_message, window};
use crate::hybrid::{RayPath, fit_textures, textures_needed};
use crate::rtx::RtxConfig;
use crate::scene::Scene;
use crate::shader_folder;
use lvk_dev_driver::{DriverRequest, prepare};

/// Frames to time where none are asked for, on a GPU.
const GPU_FRAMES: u32 = 60;
/// Frames that a GPU renders before any is timed, so that its clocks are up.
const WARM_UP_FRAMES: u32 = 5;
/// Frames of more steps are rendered without those, and once unless `--frames` asks for more.
const MOST_TIMED_STEPS: u64 = 16;

/// Width of the commands in the examples of a help.
const EXAMPLE_WIDTH: usize = 55;
/// Exit statuses of every sample, as the help tells them.
const EXIT_STATUS: &str = "\
Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";

/// The command line of a sample: its own arguments, and those of every sample.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(version)]
pub struct CommandLine<A: clap::Args> {
    /// Arguments of the sample.
    #[command(flatten)]
    pub sample: A,
    /// Frames, images and device.
    #[command(flatten)]
    pub run: RunArgs,
}

/// Returns the description of the sample's command line.
#[must_use]
pub fn command<S: SampleInfo>() -> clap::Command {
    let paragraphs = |texts: &[&str]| {
        texts.iter().filter(|text| !text.is_empty()).copied().collect::<Vec<_>>().join("\n\n")
    };
    let example = |args: &str, meaning: &str| {
        let command = format!("{} {}", S::NAME, args.trim());
        format!("\n  {:EXAMPLE_WIDTH$} {}", command.trim_end(), meaning.trim())
    };
    let lines = S::EXAMPLES.lines().filter_map(|line| line.split_once('|'));
    let mut examples: String = lines.map(|(args, meaning)| example(args, meaning)).collect();
    if !S::ROUND.is_empty() {
        let meaning = format!("{}; several machines can share a range", S::ROUND);
        examples += &example("--frames 0..240 --out dir/frame_####.png", &meaning);
    }
    let command = CommandLine::<S::Args>::command().name(S::NAME).about(S::ABOUT);
    let command = match S::DETAILS {
        "" => command,
        details => command.long_about(format!("{}.\n\n{details}", S::ABOUT)),
    };
    command.after_help(paragraphs(&[&format!("Examples:{examples}"), S::NOTES, EXIT_STATUS]))
}

/// Reads the command line of a sample, of which the first word is the name of the program.
///
/// # Errors
/// Those of the command line, the request for help among them.
pub fn parse<S: SampleInfo>(
    words: impl IntoIterator<Item = impl Into<OsString> + Clone>,
) -> Result<CommandLine<S::Args>, clap::Error> {
    let mut command = command::<S>();
    let mut matches = command.try_get_matches_from_mut(words)?;
    CommandLine::from_arg_matches_mut(&mut matches).map_err(|error| error.format(&mut command))
}

/// Runs the program of a sample with the arguments of the process.
#[must_use]
pub fn main<S: SampleInfo>() -> ExitCode {
    main_with::<S>(std::env::args_os().collect(), &mut event_loop())
}

/// Runs the program of a sample with other arguments, of which the first is its name, and another event loop for its
/// window.
#[must_use]
pub fn main_with<S: SampleInfo>(words: Vec<OsString>, event_loop: &mut EventLoopBuilder) -> ExitCode {
    match parse::<S>(&words) {
        Ok(args) => run_with::<S>(&args, event_loop),
        Err(error) => {
            print_usage(&error, &words);
            ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
        }
    }
}

/// Prints the help or the error of a command line. Words with control characters, and long ones, are shown without colours
/// and in part.
fn print_usage(error: &clap::Error, words: &[OsString]) {
    let is_plain = |word: &&OsString| word.to_str() == Some(lvk::readable_name(word).as_str());
    if error.use_stderr() && !words.iter().all(|word| is_plain(&word)) {
        let mut text = error.render().to_string();
        for word in words.iter().filter(|word| !is_plain(word)).filter_map(|word| word.to_str()) {
            text = text.replace(word, &lvk::readable_name(word));
        }
        text.lines().for_each(|line| eprintln!("{}", lvk::readable_line(line)));
    } else {
        // A closed pipe is no reason for another status.
        let _ = error.print();
    }
}

/// Does what the command line says. Prints to standard output, errors in one line to standard error. The status is 0 when
/// the images were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run<S: SampleInfo>(args: &CommandLine<S::Args>) -> ExitCode {
    run_with::<S>(args, &mut event_loop())
}

fn run_with<S: SampleInfo>(args: &CommandLine<S::Args>, event_loop: &mut EventLoopBuilder) -> ExitCode {
    if let Some(listing) = S::listing(&args.sample) {
        print_line(&listing);
        return ExitCode::SUCCESS;
    }
    library_warnings::print();
    file_size_limit::report_as_error();
    let interrupt = Interrupt::listen();
    match attempt(event_loop, S::NAME, &args.run, &interrupt, |setup| S::open(&args.sample, setup)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            print_message("error", &error);
            ExitCode::from(error.status())
        }
    }
}

/// The means to create a sample: device, progress and the common arguments.
pub struct SampleSetup<'a> {
    /// Shows which slow stage is under way.
    pub progress: Progress,
    /// Arguments of every sample.
    pub args: &'a RunArgs,
    /// The window that the device must be able to present to.
    pub(super) window: Option<Arc<dyn WindowHandles>>,
    name: &'a str,
    sink: &'a ValidationSink,
}

/// A sample that is ready to render.
pub struct ReadySample<S> {
    /// The sample.
    pub sample: S,
    /// First lines of the log; empty where the sample prints them itself.
    pub summary: String,
}

impl<S: Sample> ReadySample<S> {
    /// A sample that only rasterises; `scene` says what it shows.
    #[must_use]
    pub fn raster(sample: S, scene: &str) -> Self {
        Self { summary: raster_summary(sample.context().capabilities(), scene), sample }
    }

    /// A sample that traces rays by `path`, in `stages` where by queries; `scene` says what it shows.
    #[must_use]
    pub fn ray_traced(sample: S, path: RayPath, stages: &str, scene: &str) -> Self {
        Self { summary: ray_summary(sample.context().capabilities(), path, stages, scene), sample }
    }
}

impl<'a> SampleSetup<'a> {
    pub(super) fn new(name: &'a str, args: &'a RunArgs, sink: &'a ValidationSink) -> Self {
        Self { progress: Progress::visible(), args, window: None, name, sink }
    }

    /// Width and height of the images in pixels.
    #[must_use]
    pub fn extent(&self) -> [u32; 2] {
        self.args.extent()
    }

    /// Opens the device that the command line names, or the best.
    ///
    /// # Errors
    /// [`RunError::Device`] and [`RunError::Driver`].
    pub fn device(&mut self, needs: &DeviceNeeds) -> Result<Context, RunError> {
        self.progress.pause();
        let driver =
            prepare(&DriverRequest { validation: self.args.validate.is_some(), ..DriverRequest::default() })?;
        self.progress.stage("setup the device", 0);
        device::open(self.name, self.args, &driver, self.sink, needs, self.window.clone())
    }

    /// Prints the warnings of `scene`, opens a device with descriptor slots for its textures, and fits these to its limits.
    ///
    /// # Errors
    /// Those of [`SampleSetup::device`], and textures that the device has no room for.
    pub(crate) fn device_for_scene(
        &mut self,
        mut scene: Scene,
        needs: &DeviceNeeds,
    ) -> Result<(Context, Scene), RunError> {
        self.warn(&scene.warnings);
        let context = self.device(&DeviceNeeds { textures: textures_needed(&scene), ..*needs })?;
        self.warn(&fit_textures(&mut scene, &context.capabilities().limits)?);
        Ok((context, scene))
    }

    /// Opens a device that traces rays, and chooses path and size.
    ///
    /// # Errors
    /// Those of [`SampleSetup::device`], and rays that the device cannot trace as asked.
    pub fn ray_device(&mut self, wish: RayTracing) -> Result<(Context, RtxConfig), RunError> {
        let context = self.device(&DeviceNeeds::tracing(wish))?;
        let config = RtxConfig::from_args(wish, self.extent(), context.capabilities())?;
        Ok((context, config))
    }

    /// True if the sample is for a window, where it may be [loading](super::loading::Loading) while others are shown.
    #[must_use]
    pub fn is_for_window(&self) -> bool {
        self.window.is_some()
    }

    /// The folder of built acceleration structures, for samples that keep them, unless the user wants nothing kept. It need
    /// not exist.
    #[must_use]
    pub fn structure_cache(&self) -> Option<PathBuf> {
        let caches = Caches::open(self.name, self.args);
        caches.map(|caches| caches.structures().to_owned())
    }

    /// Prints warnings to standard error, after pausing the progress bar.
    pub fn warn(&mut self, warnings: &[String]) {
        if !warnings.is_empty() {
            self.progress.pause();
        }
        warn(warnings);
    }
}

/// Prints warnings to standard error.
pub fn warn(warnings: &[String]) {
    for warning in warnings {
        print_message("warning", warning);
    }
}

fn attempt<S: Sample>(
    event_loop: &mut EventLoopBuilder,
    name: &str,
    args: &RunArgs,
    interrupt: &Interrupt,
    make: impl FnOnce(&mut SampleSetup<'_>) -> Result<ReadySample<S>, RunError>,
) -> Result<(), RunError> {
    if args.list_devices {
        return device::list(args.profile.as_ref());
    }
    if args.window {
        return show(event_loop, name, args, make);
    }
    let out = args.out_or(name);
    let mut request = RenderRequest {
        frames: args.frames.clone().unwrap_or(Frames::Still(GPU_FRAMES)),
        warm_up: WARM_UP_FRAMES,
        frames_per_round: args.round,
        size: [args.width, args.height],
        out: FrameName::new(&out),
        resume: args.resume,
    };
    request.check()?;
    let sink = ValidationSink::default();
    let mut setup = SampleSetup::new(name, args, &sink);
    let ReadySample { mut sample, summary } = make(&mut setup)?;
    let context = sample.context().clone();
    drop(setup);
    print_line(&summary);
    if context.capabilities().is_cpu || sample.steps_per_frame() > MOST_TIMED_STEPS {
        request.warm_up = 0;
        request.frames = args.frames.clone().unwrap_or(Frames::Still(1));
    }
    interrupt.defer();
    let played =
        render_frames(&mut Headless::new(&mut sample), &request, &mut Progress::visible(), interrupt);
    let remark = sample.remark();
    drop(sample);
    if args.check_indices {
        device::report_index_faults(&context)?;
    }
    context.wait_idle()?;
    drop(context);
    if args.validate.is_some() {
        device::report_validation(&sink)?;
    }
    print_line(&closing_lines(&request, &played?, remark?));
    Ok(())
}

fn show<S: Sample>(
    event_loop: &mut EventLoopBuilder,
    name: &str,
    args: &RunArgs,
    make: impl FnOnce(&mut SampleSetup<'_>) -> Result<ReadySample<S>, RunError>,
) -> Result<(), RunError> {
    if matches!(args.frames, Some(Frames::Sequence(_))) {
        return Err(RunError::SequenceInWindow);
    }
    if let Some(out) = &args.out {
        png::check_writable(out)?;
    }
    if let Some(folder) = &args.hot_reload {
        shader_folder::set_folder(folder).map_err(|folder| RunError::NoShaders { folder })?;
    }
    let sink = ValidationSink::default();
    window::run(event_loop, name, args, &sink, make)?;
    args.validate.map_or(Ok(()), |_| device::report_validation(&sink))
}

fn closing_lines(request: &RenderRequest, played: &RenderReport, remark: Option<String>) -> String {
    let RenderReport { timings, written, skipped } = played;
    let remark = remark.map_or_else(String::new, |remark| format!("\n{remark}"));
    let out = lvk::readable_name(request.out.path());
    match (&request.frames, skipped) {
        (Frames::Still(_), _) => format!("{timings}{remark}\nwrote {out}"),
        (Frames::Sequence(_), 0) => format!("{timings}{remark}\nwrote {written} frames to {out}"),
        _ => format!("{timings}{remark}\nwrote {written} frames to {out}; {skipped} were there"),
    }
}

/// Reads the arguments of a sample from one line.
#[cfg(test)]
pub(crate) fn parse_line<S: SampleInfo>(line: &str) -> Result<CommandLine<S::Args>, clap::Error> {
    parse::<S>(std::iter::once(S::NAME).chain(line.split_whitespace()))
}

/// Asserts that the sample refuses each line with exit status 2.
#[cfg(test)]
pub(crate) fn assert_refuses<S: SampleInfo>(lines: &[&str]) {
    for line in lines {
        let status = parse_line::<S>(line).map(|_| ()).map_err(|error| error.exit_code());
        assert_eq!(status, Err(2), "{line}");
    }
}
