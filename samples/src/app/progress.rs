//! Shows that something long is under way.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// How long work may take before anything is shown.
const PATIENCE: Duration = Duration::from_secs(2);

/// A progress bar on standard error, which appears when the work has taken more than two seconds, is gone when
/// it ends, and is never drawn where standard error is no terminal.
#[derive(Debug)]
pub struct Progress {
    start: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Progress that a person sees, if there is a terminal.
    pub fn visible() -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
            bar.set_style(style(false));
            bar
        });
        Self { start: Instant::now(), bar }
    }

    /// Progress that nobody sees.
    pub fn hidden() -> Self {
        Self { start: Instant::now(), bar: None }
    }

    /// Starts the next stage, called `name`, of `total` steps; 0 steps for a stage that cannot be counted.
    pub fn stage(&mut self, name: &str, total: u64) {
        let Some(bar) = &self.bar else { return };
        bar.set_style(style(total > 0));
        bar.set_length(total);
        bar.set_position(0);
        bar.set_message(name.to_owned());
        self.show_when_late();
    }

    /// Says how many steps of the stage are done.
    pub fn set(&mut self, done: u64) {
        let Some(bar) = &self.bar else { return };
        bar.set_position(done);
        self.show_when_late();
    }

    fn show_when_late(&self) {
        let Some(bar) = self.bar.as_ref().filter(|bar| bar.is_hidden()) else { return };
        if self.start.elapsed() > PATIENCE {
            bar.set_draw_target(ProgressDrawTarget::stderr());
            bar.tick();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn style(is_counted: bool) -> ProgressStyle {
    let template = if is_counted { "{msg} {wide_bar} {percent:>3} %" } else { "{msg} {spinner}" };
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_templates_are_valid() {
        for template in ["{msg} {wide_bar} {percent:>3} %", "{msg} {spinner}"] {
            assert!(ProgressStyle::with_template(template).is_ok());
        }
    }

    #[test]
    fn nothing_is_shown_before_the_patience_is_over() {
        let mut progress = Progress {
            start: Instant::now(),
            bar: Some(ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden())),
        };
        progress.stage("a", 10);
        progress.set(5);
        let bar = progress.bar.clone().unwrap();
        assert!(bar.is_hidden());
        assert_eq!((bar.position(), bar.length()), (5, Some(10)));
    }
}
