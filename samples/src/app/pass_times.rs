//! GPU times of the passes of a frame.

use std::sync::Arc;

use lvk::GpuProfile;

/// GPU times of the passes of a frame: a profile for each step that the frame was cut into. Empty where the device
/// has no timestamps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PassTimes {
    /// Profiles in the order of the steps.
    pub steps: Vec<Arc<GpuProfile>>,
}

impl PassTimes {
    /// Names of the passes and milliseconds of each, in the order in which they run; a name comes again for each step that
    /// has the pass.
    pub fn passes(&self) -> impl Iterator<Item = (&str, f64)> {
        self.steps.iter().flat_map(|step| &step.scopes).map(|scope| (scope.name.as_str(), scope.ms))
    }

    /// Milliseconds of the passes with one of these names, of all steps together.
    #[must_use]
    pub fn ms(&self, names: &[&str]) -> f64 {
        self.passes().filter(|(name, _)| names.contains(name)).map(|(_, ms)| ms).sum()
    }

    /// Milliseconds from the begin of the first pass to the end of the last, so with what lies between them; of all steps
    /// together, without what lies between those.
    #[must_use]
    pub fn span_ms(&self) -> f64 {
        let span = |step: &Arc<GpuProfile>| {
            let (first, last) = (step.scopes.first()?, step.scopes.last()?);
            Some(last.start_ms + last.ms - first.start_ms)
        };
        self.steps.iter().filter_map(span).sum()
    }

    /// True if nothing is known.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use lvk::GpuScope;

    use super::*;

    /// Steps of two passes with a gap between them.
    fn times(steps: usize) -> PassTimes {
        let scope = |name: &str, start_ms, ms| GpuScope {
            name: name.to_owned(),
            start_ms,
            ms,
            ..GpuScope::default()
        };
        let scopes = vec![scope("draw", 0.5, 4.0), scope("rays", 5.0, 10.0)];
        let profile = Arc::new(GpuProfile { ms: 16.0, scopes, ..GpuProfile::default() });
        PassTimes { steps: vec![profile; steps] }
    }

    #[test]
    fn steps_add_up() {
        for steps in [1, 3] {
            let (times, count) = (times(steps), steps as f64);
            assert_eq!((times.ms(&["draw"]), times.ms(&["rays"])), (4.0 * count, 10.0 * count));
            assert_eq!((times.ms(&["rays", "draw"]), times.ms(&["other"])), (14.0 * count, 0.0));
            assert_eq!(times.span_ms(), 14.5 * count);
            assert_eq!(times.passes().count(), 2 * steps);
        }
    }

    #[test]
    fn nothing_known_is_no_time() {
        let none = PassTimes::default();
        assert!(none.is_empty() && none.passes().next().is_none());
        assert_eq!((none.span_ms(), none.ms(&["draw"])), (0.0, 0.0));
        let unnamed = PassTimes { steps: vec![Arc::default()] };
        assert_eq!(unnamed.span_ms(), 0.0);
    }
}
