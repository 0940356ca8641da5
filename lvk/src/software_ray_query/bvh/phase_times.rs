//! Times of the phases of a build on the CPU.

use std::time::{Duration, Instant};

/// Times of the phases of a build, if they are asked for.
#[derive(Debug, Default)]
pub(crate) struct PhaseTimes(Option<Vec<(&'static str, Duration)>>);

impl PhaseTimes {
    /// Measures nothing.
    pub(crate) fn off() -> Self {
        Self(None)
    }

    /// Measures each phase.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn on() -> Self {
        Self(Some(Vec::new()))
    }

    /// Runs a phase.
    pub(crate) fn run<R>(&mut self, name: &'static str, phase: impl FnOnce() -> R) -> R {
        let Some(times) = &mut self.0 else { return phase() };
        let start = Instant::now();
        let result = phase();
        times.push((name, start.elapsed()));
        result
    }

    /// Returns the phases in order, each with its time.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn into_phases(self) -> Vec<(&'static str, Duration)> {
        self.0.unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_are_measured_only_if_asked_for() {
        let (mut on, mut off) = (PhaseTimes::on(), PhaseTimes::off());
        assert_eq!([on.run("one", || 1), on.run("two", || 2), off.run("one", || 3)], [1, 2, 3]);
        assert_eq!(on.into_phases().iter().map(|(name, _)| *name).collect::<Vec<_>>(), ["one", "two"]);
        assert!(off.into_phases().is_empty());
    }
}
