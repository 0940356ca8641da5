//! The labels of a command buffer in recording order, kept until its queue is done with it.

use crate::error::device_loss::{LabelProgress, ReportedLabel};

/// Name and labels of a command buffer. Its memory is reused, so that labels do not allocate on the heap.
#[derive(Debug, Default)]
pub(crate) struct LabelTrail {
    /// The name, then the names of all labels.
    text: String,
    /// End of the name of the command buffer in `text`.
    name_end: usize,
    events: Vec<LabelEvent>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LabelEvent {
    /// A label begins. Its name ends at this place in the text, and begins where the name before it ends.
    Begin(usize),
    /// A label without commands of its own, with the end of its name.
    Insert(usize),
    End,
}

/// The last events of a command buffer that the GPU has reached, counted from 1; 0 for none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ReachedEvents {
    /// The last event that the GPU has begun to run the commands of.
    pub(crate) begun: usize,
    /// The last event before which all commands are done.
    pub(crate) done: usize,
}

impl LabelTrail {
    /// Most bytes of text and most events of a command buffer whose memory is kept.
    const MAX_KEPT: usize = 1 << 16;

    pub(crate) fn clear(&mut self) {
        if self.text.capacity() > Self::MAX_KEPT || self.events.capacity() > Self::MAX_KEPT {
            *self = Self::default();
        }
        self.text.clear();
        self.events.clear();
        self.name_end = 0;
    }

    /// Sets the name of the command buffer.
    pub(crate) fn set_name(&mut self, name: &str) {
        let moved = |end: usize| end - self.name_end + name.len();
        for event in &mut self.events {
            if let LabelEvent::Begin(end) | LabelEvent::Insert(end) = event {
                *end = moved(*end);
            }
        }
        self.text.replace_range(..self.name_end, name);
        self.name_end = name.len();
    }

    /// Returns the name of the command buffer.
    pub(crate) fn name(&self) -> &str {
        &self.text[..self.name_end]
    }

    /// Begins a label. Returns the number of its event.
    pub(crate) fn begin(&mut self, name: &str) -> usize {
        self.text.push_str(name);
        self.push(LabelEvent::Begin(self.text.len()))
    }

    /// Adds a label between two commands. Returns the number of its event.
    pub(crate) fn insert(&mut self, name: &str) -> usize {
        self.text.push_str(name);
        self.push(LabelEvent::Insert(self.text.len()))
    }

    /// Ends the innermost label. Returns the number of its event.
    pub(crate) fn end(&mut self) -> usize {
        self.push(LabelEvent::End)
    }

    fn push(&mut self, event: LabelEvent) -> usize {
        self.events.push(event);
        self.events.len()
    }

    /// Returns the labels with their progress; `None` if the device reports no checkpoints.
    pub(crate) fn report(&self, reached: Option<ReachedEvents>) -> Vec<ReportedLabel> {
        let mut labels: Vec<ReportedLabel> = Vec::new();
        let (mut open, mut start) = (Vec::new(), self.name_end);
        for (event, number) in self.events.iter().zip(1..) {
            let progress = event_progress(number, reached);
            match *event {
                LabelEvent::Begin(end) | LabelEvent::Insert(end) => {
                    let is_begin = matches!(event, LabelEvent::Begin(_));
                    // The end of a label says if all of it is done.
                    let progress = match progress {
                        LabelProgress::Ended if is_begin => LabelProgress::Begun,
                        other => other,
                    };
                    let name = self.text[start..end].to_owned();
                    let depth = u32::try_from(open.len()).unwrap_or(u32::MAX);
                    open.extend(is_begin.then_some(labels.len()));
                    labels.push(ReportedLabel { name, depth, progress });
                    start = end;
                }
                LabelEvent::End => {
                    if let Some(label) = open.pop()
                        && progress == LabelProgress::Ended
                    {
                        labels[label].progress = progress;
                    }
                }
            }
        }
        labels
    }
}

fn event_progress(number: usize, reached: Option<ReachedEvents>) -> LabelProgress {
    match reached {
        None => LabelProgress::Unknown,
        Some(reached) if number <= reached.done => LabelProgress::Ended,
        Some(reached) if number <= reached.begun => LabelProgress::Begun,
        Some(_) => LabelProgress::NotBegun,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use LabelProgress::{Begun, Ended, NotBegun, Unknown};

    /// Records `(` with a letter, `)` and `.` with a letter.
    fn trail(text: &str) -> LabelTrail {
        let mut trail = LabelTrail::default();
        for word in text.split_whitespace() {
            match word.split_at(1) {
                (")", _) => trail.end(),
                (".", name) => trail.insert(name),
                (_, name) => trail.begin(name),
            };
        }
        trail
    }

    fn progress(trail: &LabelTrail, begun: usize, done: usize) -> Vec<(String, u32, LabelProgress)> {
        let labels = trail.report(Some(ReachedEvents { begun, done }));
        labels.into_iter().map(|label| (label.name, label.depth, label.progress)).collect()
    }

    #[test]
    fn labels_nest_and_end_with_their_own_end() {
        let trail = trail("(a (b ) .c ) (d )");
        let names = |states: [LabelProgress; 4]| {
            let all = [("a", 0), ("b", 1), ("c", 1), ("d", 0)];
            all.into_iter()
                .zip(states)
                .map(|((name, depth), state)| (name.to_owned(), depth, state))
                .collect()
        };
        let expect = |begun, done, states| {
            let expected: Vec<_> = names(states);
            assert_eq!(progress(&trail, begun, done), expected, "{begun} {done}");
        };
        expect(0, 0, [NotBegun; 4]);
        expect(1, 0, [Begun, NotBegun, NotBegun, NotBegun]);
        expect(2, 2, [Begun, Begun, NotBegun, NotBegun]);
        expect(4, 3, [Begun, Ended, Begun, NotBegun]);
        expect(6, 5, [Ended, Ended, Ended, Begun]);
        expect(7, 7, [Ended; 4]);
        assert!(trail.report(None).iter().all(|label| label.progress == Unknown));
    }

    #[test]
    fn a_name_may_be_given_before_and_after_labels() {
        let mut trail = trail("(a");
        for name in ["frame", "a longer name", "", "x"] {
            trail.set_name(name);
            assert_eq!((trail.name(), trail.report(None)[0].name.as_str()), (name, "a"));
        }
        trail.begin("b");
        assert_eq!(trail.report(None)[1].name, "b");
        trail.clear();
        assert_eq!((trail.name(), trail.report(None)), ("", Vec::new()));
    }

    proptest! {
        /// A label is never behind what is inside it, and never before what follows it.
        #[test]
        fn progress_falls_along_the_labels(
            words in prop::collection::vec(prop_oneof![Just("(x"), Just(")"), Just(".y")], 0..40),
            begun in 0..40_usize,
            done in 0..40_usize,
        ) {
            let labels = trail(&words.join(" ")).report(Some(ReachedEvents { begun: begun.max(done), done }));
            let reached = |progress| match progress { Ended => 2, Begun => 1, _ => 0 };
            for pair in labels.windows(2) {
                let follows = pair[1].depth <= pair[0].depth;
                prop_assert!(!follows || reached(pair[1].progress) <= reached(pair[0].progress));
                prop_assert!(reached(pair[1].progress) == 0 || reached(pair[0].progress) > 0);
            }
        }
    }
}
