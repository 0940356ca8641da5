//! The loop: frames, samples every so many of them, and the report.

use std::collections::BTreeMap;
use std::time::Instant;

use lvk::{BufferDesc, Context, Result, ValidationMode};
use lvk_tests::device_with;
use lvk_tests::queues::long_run_queues;
#[cfg(target_os = "linux")]
use lvk_tests::windows::desktop;

use super::churn::Churn;
use super::flat::{Samples, Series};
use super::frame::Frames;
#[cfg(target_os = "linux")]
use super::presentation::Presentation;
use super::rays::Rays;
use super::sample::sample;
use super::scene::{CYCLE, Scene};

/// Counts of each action.
#[derive(Debug, Default)]
pub struct Tally(BTreeMap<&'static str, u64>);

impl Tally {
    /// Counts an action.
    pub fn count(&mut self, action: &'static str) {
        *self.0.entry(action).or_default() += 1;
    }

    /// Returns how often an action was done.
    pub fn count_of(&self, action: &str) -> u64 {
        self.0.get(action).copied().unwrap_or(0)
    }
}

/// Length and settings of a run.
#[derive(Debug, Clone, Copy)]
pub struct Soak {
    /// Number of frames.
    pub frames: u32,
    /// Frames between two samples, a multiple of the cycle.
    pub sample_every: u32,
    /// True with the validation layer, which keeps memory of its own.
    pub validation: bool,
    /// Frames after which one buffer is leaked on purpose; 64 bytes of the host's memory are leaked in each frame then.
    pub leak_every: Option<u32>,
}

/// Results of a run.
pub struct Report {
    /// Counts of each action.
    pub tally: Tally,
    /// Samples.
    pub samples: Samples,
    /// Samples that belong to the warm-up.
    pub warm_up: usize,
    seconds: f64,
    device: String,
}

/// Frames of an hour at 60 a second.
pub const HOUR: u32 = 216_000;

impl Soak {
    /// Most that resident memory grows from the middle third to the last one, in thousandths. The fragments and the arenas of the C library are
    /// in it: a thread that the driver starts late takes a few megabytes once, which counts for more in a short run.
    fn resident_slope(&self) -> i64 {
        if self.frames >= HOUR { 20 } else { 50 }
    }

    /// Runs the frames. `None` as for [`lvk_tests::device`].
    pub fn run(&self) -> Option<Result<Report>> {
        assert!(self.sample_every.is_multiple_of(CYCLE), "samples are taken at the same place of the cycle");
        #[cfg(target_os = "linux")]
        let window = desktop().map(|desktop| desktop.window([64, 48]));
        let ctx = device_with(|desc| {
            desc.queues = long_run_queues();
            if !self.validation {
                desc.validation = ValidationMode::Off;
            }
            #[cfg(target_os = "linux")]
            if let Some(window) = &window {
                desc.window = Some(window.clone());
            }
        })?;
        #[cfg(target_os = "linux")]
        let mut presentation = match window.map(|window| Presentation::new(&ctx, window)).transpose() {
            Ok(presentation) => presentation,
            Err(error) => return Some(Err(error)),
        };
        #[cfg(target_os = "linux")]
        let present = |phase: u32, tally: &mut Tally| match &mut presentation {
            Some(presentation) => presentation.frame(&ctx, phase, tally),
            None => Ok(()),
        };
        #[cfg(not(target_os = "linux"))]
        let present = |_: u32, _: &mut Tally| Ok(());
        Some(self.frames(&ctx, present))
    }

    fn frames(
        &self,
        ctx: &Context,
        mut present: impl FnMut(u32, &mut Tally) -> Result<()>,
    ) -> Result<Report> {
        let (mut scene, mut churn, mut frames) = (Scene::new(ctx)?, Churn::new(ctx)?, Frames::default());
        let mut rays = Rays::new(ctx)?;
        let (mut tally, mut samples, start) = (Tally::default(), Samples::default(), Instant::now());
        for number in 0..self.frames {
            let sampled = churn.before_frame(ctx, &mut scene, number % CYCLE, &mut tally)?;
            frames.frame(ctx, &mut scene, sampled, number, &mut tally)?;
            if let Some(rays) = &mut rays {
                rays.frame(ctx, &scene, number % CYCLE, &mut tally)?;
            }
            present(number % CYCLE, &mut tally)?;
            if self.leak_every.is_some_and(|every| number.is_multiple_of(every)) {
                ctx.create_buffer(&BufferDesc { size_bytes: 4096, ..Default::default() })?.release();
                tally.count("buffers leaked on purpose");
            }
            if self.leak_every.is_some() {
                // A leak of few bytes, which only a count of all bytes shows.
                std::hint::black_box(Box::leak(Box::new([0_u8; 64])));
            }
            if (number + 1).is_multiple_of(self.sample_every) {
                frames.finish(0, &mut tally)?;
                samples.add(sample(ctx, self.validation, self.resident_slope())?);
                let (count, seconds) = (samples.count(), start.elapsed().as_secs());
                eprintln!("sample {count} after {} frames and {seconds} s", number + 1);
            }
        }
        let (seconds, device) = (start.elapsed().as_secs_f64(), ctx.capabilities().device_name.clone());
        // The driver fills its caches for longer than the library.
        let warm_up = 2.max(samples.count() / 10);
        Ok(Report { tally, samples, warm_up, seconds, device })
    }
}

impl Report {
    /// Prints the counts and the series.
    pub fn print(&self) {
        println!("{}, {:.0} s", self.device, self.seconds);
        self.tally.0.iter().for_each(|(action, count)| println!("{action}: {count}"));
        println!("series after {} samples of warm-up, of {}:", self.warm_up, self.samples.count());
        for (name, series) in self.samples.series() {
            println!("{name}: {}", describe(series, self.warm_up));
        }
    }
}

/// Returns the first value, and the medians of the last two thirds.
fn describe(series: &Series, warm_up: usize) -> String {
    let first = series.values.first().copied().unwrap_or(0);
    match series.medians(warm_up) {
        Some([middle, last]) if middle == last && first == last => format!("{last}"),
        Some([middle, last]) => {
            let percent = 100.0 * (last - middle) as f64 / middle.max(1) as f64;
            format!("{first} at first, then {middle}, then {last} ({percent:+.2} %)")
        }
        None => format!("{:?}", series.values),
    }
}
