//! Shows that something long is under way.

use std::io::IsTerminal;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::loading::{Status, Stopped};

/// Delay before the progress is displayed.
const DELAY: Duration = Duration::from_secs(2);
/// Time between two looks at the clock, and two steps of the spinner.
const TICK: Duration = Duration::from_millis(100);
/// Time between two lines about one stage.
const PAUSE: Duration = Duration::from_secs(5);

/// A progress bar on standard error, which appears when the work has taken more than two seconds, even amid a stage
/// that says nothing, is gone when it ends, and is never drawn where standard error is no terminal. There it may be lines
/// instead, and a window may show it, too.
#[derive(Debug)]
pub struct Progress {
    timing: Timing,
    is_seen: bool,
    target: fn() -> ProgressDrawTarget,
    shown: Option<VisibleBar>,
    lines: Option<Lines>,
    status: Option<Status>,
}

#[derive(Debug, Clone, Copy)]
struct Timing {
    start: Instant,
    delay: Duration,
    tick: Duration,
}

/// A bar, and the thread that keeps it moving.
#[derive(Debug)]
struct VisibleBar {
    bar: ProgressBar,
    stop: Option<Sender<()>>,
    ticker: Option<JoinHandle<()>>,
}

impl Progress {
    /// Progress that a person sees, if there is a terminal.
    pub fn visible() -> Self {
        Self { is_seen: std::io::stderr().is_terminal(), ..Self::hidden() }
    }

    /// As [`visible`](Self::visible), but where standard error is no terminal each stage is a line there, with more lines for
    /// one that takes long.
    pub fn with_log_lines() -> Self {
        let visible = Self::visible();
        Self { lines: (!visible.is_seen).then(Lines::default), ..visible }
    }

    /// Progress without output.
    pub fn hidden() -> Self {
        let timing = Timing { start: Instant::now(), delay: DELAY, tick: TICK };
        let target = ProgressDrawTarget::stderr;
        Self { timing, is_seen: false, target, shown: None, lines: None, status: None }
    }

    /// Reports everything to `status`, too, and ends the work when `status` is asked to stop.
    #[must_use]
    pub fn with_status(self, status: &Status) -> Self {
        Self { status: Some(status.clone()), ..self }
    }

    /// Fails when the work is wanted no longer; to be asked from time to time.
    ///
    /// # Errors
    /// [`Stopped`].
    pub fn go_on(&self) -> Result<(), Stopped> {
        if self.status.as_ref().is_some_and(Status::is_stopped) { Err(Stopped) } else { Ok(()) }
    }

    /// Starts the next stage, called `name`, of `total` steps; 0 steps for a stage that cannot be counted.
    pub fn stage(&mut self, name: &str, total: u64) {
        let name = &lvk::readable_name(name);
        if let Some(status) = &self.status {
            status.begin(name, total);
        }
        if let Some(line) = self.lines.as_mut().map(|lines| lines.begin(name, total)) {
            self.print_line(&line);
        }
        if !self.is_seen {
            return;
        }
        let bar = &self.shown.get_or_insert_with(|| VisibleBar::new(self.timing, self.target)).bar;
        bar.set_style(style(total > 0));
        bar.set_length(total);
        bar.set_position(0);
        bar.reset_eta();
        bar.set_message(name.clone());
    }

    /// Says how many steps of the stage are done.
    pub fn set(&mut self, done: u64) {
        if let Some(status) = &self.status {
            status.set(done);
        }
        if let Some(line) = self.lines.as_mut().and_then(|lines| lines.set(done, Instant::now())) {
            self.print_line(&line);
        }
        if let Some(VisibleBar { bar, .. }) = &self.shown {
            bar.set_position(done);
        }
    }

    /// Takes the bar away until the next stage, so that others can write to standard error. No thread of it is left
    /// meanwhile.
    pub fn pause(&mut self) {
        self.shown = None;
    }

    /// Prints a line, with the seconds since the beginning.
    fn print_line(&self, line: &str) {
        eprintln!("[{:6.1} s] {line}", self.timing.start.elapsed().as_secs_f32());
    }
}

/// Progress as lines.
#[derive(Debug)]
struct Lines {
    name: String,
    total: u64,
    latest: Instant,
}

impl Default for Lines {
    fn default() -> Self {
        Self { name: String::new(), total: 0, latest: Instant::now() }
    }
}

impl Lines {
    /// The line of a stage that begins.
    fn begin(&mut self, name: &str, total: u64) -> String {
        *self = Self { name: name.to_owned(), total, latest: Instant::now() };
        name.to_owned()
    }

    /// A line about a stage that goes on, if the last one is a while ago.
    fn set(&mut self, done: u64, now: Instant) -> Option<String> {
        if self.total == 0 || now.duration_since(self.latest) < PAUSE {
            return None;
        }
        self.latest = now;
        Some(format!("{}: {} %", self.name, 100 * done.min(self.total) / self.total))
    }
}

impl VisibleBar {
    fn new(timing: Timing, target: fn() -> ProgressDrawTarget) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        let (stop, stopped) = mpsc::channel::<()>();
        let ticked = bar.clone();
        let tick = move || {
            while stopped.recv_timeout(timing.tick) == Err(RecvTimeoutError::Timeout) {
                if ticked.is_hidden() && timing.start.elapsed() > timing.delay {
                    ticked.set_draw_target(target());
                }
                ticked.tick();
            }
        };
        // Without a thread there is no bar, which is no reason to stop the work.
        let ticker = thread::Builder::new().name("progress".to_owned()).spawn(tick).ok();
        Self { bar, stop: Some(stop), ticker }
    }
}

impl Drop for VisibleBar {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(ticker) = self.ticker.take() {
            let _ = ticker.join();
        }
        self.bar.finish_and_clear();
    }
}

fn style(is_counted: bool) -> ProgressStyle {
    let template = if is_counted { "{msg} {wide_bar} {percent:>3} %, {eta} left" } else { "{msg} {spinner}" };
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io;

    /// A terminal that takes everything.
    #[derive(Debug)]
    struct Terminal;

    impl indicatif::TermLike for Terminal {
        fn width(&self) -> u16 {
            80
        }
        fn move_cursor_up(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_down(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_right(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_left(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn write_line(&self, _: &str) -> io::Result<()> {
            Ok(())
        }
        fn write_str(&self, _: &str) -> io::Result<()> {
            Ok(())
        }
        fn clear_line(&self) -> io::Result<()> {
            Ok(())
        }
        fn flush(&self) -> io::Result<()> {
            Ok(())
        }
    }

    fn progress(delay: Duration) -> Progress {
        let timing = Timing { start: Instant::now(), delay, tick: Duration::from_millis(1) };
        let target = || ProgressDrawTarget::term_like(Box::new(Terminal));
        Progress { timing, is_seen: true, target, ..Progress::hidden() }
    }

    fn bar(progress: &Progress) -> ProgressBar {
        progress.shown.as_ref().unwrap().bar.clone()
    }

    #[test]
    fn both_templates_are_valid() {
        for template in ["{msg} {wide_bar} {percent:>3} %, {eta} left", "{msg} {spinner}"] {
            assert!(ProgressStyle::with_template(template).is_ok());
        }
    }

    #[test]
    fn nothing_is_printed_before_the_delay_is_over() {
        let mut progress = progress(Duration::from_secs(3600));
        progress.stage("a", 10);
        progress.set(5);
        thread::sleep(Duration::from_millis(20));
        let bar = bar(&progress);
        assert!(bar.is_hidden());
        assert_eq!((bar.position(), bar.length()), (5, Some(10)));
    }

    #[test]
    fn a_long_silent_stage_is_printed_and_again_after_a_pause() {
        let mut progress = progress(Duration::from_millis(10));
        for stage in ["textures", "pipelines"] {
            progress.stage(stage, 0);
            let bar = bar(&progress);
            let deadline = Instant::now() + Duration::from_secs(10);
            while bar.is_hidden() && Instant::now() < deadline {
                thread::sleep(Duration::from_millis(1));
            }
            assert!(!bar.is_hidden(), "{stage}");
            assert_eq!(bar.message(), stage);
            progress.pause();
            assert!(bar.is_finished());
        }
    }

    #[test]
    fn stages_are_lines_and_long_ones_several() {
        let mut lines = Lines::default();
        assert_eq!(lines.begin("reading", 40), "reading");
        let begun = Instant::now();
        let at = |seconds| begun + Duration::from_secs(seconds);
        assert_eq!(lines.set(10, at(1)), None);
        assert_eq!(lines.set(20, at(6)).as_deref(), Some("reading: 50 %"));
        assert_eq!(lines.set(30, at(7)), None, "said a second ago");
        assert_eq!(lines.set(50, at(13)).as_deref(), Some("reading: 100 %"));
        lines.begin("shaders", 0);
        assert_eq!(lines.set(1, at(99)), None, "nothing is counted");
    }

    #[test]
    fn the_callback_can_stop_the_work() {
        let status = Status::default();
        let mut progress = Progress::hidden().with_status(&status);
        progress.stage("a", 10);
        progress.set(5);
        assert_eq!(progress.go_on(), Ok(()));
        status.stop();
        assert_eq!(progress.go_on(), Err(Stopped));
        assert_eq!(Progress::hidden().go_on(), Ok(()), "progress without an interrupt");
    }

    #[test]
    fn hidden_progress_has_no_thread() {
        let mut progress = Progress::hidden();
        progress.stage("a", 10);
        progress.set(5);
        assert!(progress.shown.is_none());
    }
}
