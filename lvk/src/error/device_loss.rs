//! Report of a lost device: the unfinished submissions of each queue, their labels, and the fault.

use std::fmt;

use super::device_fault::DeviceFault;
use super::readable::readable_name;
use crate::queue::Queue;

/// The report of a lost device: its fault, the unfinished submissions, and the labels under which they ran.
///
/// `{}` writes one line, as in [`Error::DeviceLost`](crate::Error::DeviceLost). `{:#}` writes every unfinished
/// submission and its labels, with a line for each.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DeviceLossReport {
    /// The Vulkan command that reported the loss first.
    pub call: &'static str,
    /// Debug name of the object of that command.
    pub object: String,
    /// Fault report of the driver, where it has `VK_EXT_device_fault`.
    pub fault: Option<DeviceFault>,
    /// The queues with unfinished submissions, in the order of [`Queue::ALL`]. Queues that share a Vulkan queue with
    /// the graphics queue are listed under it. Empty if all submissions were done, and if a call without submissions
    /// reported the loss.
    pub queues: Vec<QueueLossReport>,
}

/// The unfinished submissions of a queue of a lost device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QueueLossReport {
    /// The queue.
    pub queue: Queue,
    /// Value that the timeline of the queue had reached, as [`SubmitHandle::raw_value`](crate::SubmitHandle::raw_value).
    pub completed: u64,
    /// Value of the last submission of the queue.
    pub submitted: u64,
    /// Command buffers that the queue had not finished, in the order of their submission.
    pub unfinished: Vec<UnfinishedCommands>,
}

/// A command buffer that a queue had not finished when the device was lost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnfinishedCommands {
    /// Value of its submission, as [`SubmitHandle::raw_value`](crate::SubmitHandle::raw_value).
    pub value: u64,
    /// Name given by [`CommandBuffer::set_debug_name`](crate::CommandBuffer::set_debug_name); empty without one.
    pub name: String,
    /// Labels of the command buffer in recording order, each before its children.
    pub labels: Vec<ReportedLabel>,
}

/// A label of an unfinished command buffer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportedLabel {
    /// The label.
    pub name: String,
    /// Number of labels around it.
    pub depth: u32,
    /// The progress of the GPU.
    pub progress: LabelProgress,
}

/// The progress of the GPU in the commands of a label.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum LabelProgress {
    /// The device reports no checkpoints: see [`ContextDesc::checkpoints`](crate::ContextDesc::checkpoints).
    Unknown,
    /// No command of the label had begun.
    NotBegun,
    /// The GPU had reached the label, and had not finished all of its commands.
    Begun,
    /// All commands of the label, and all before them, were finished.
    Ended,
}

/// Most command buffers of a queue that the text lists.
const MAX_LISTED_COMMANDS: usize = 16;
/// Most labels of a command buffer that the text lists.
const MAX_LISTED_LABELS: usize = 48;
/// Most labels that one line names.
const MAX_NAMED_LABELS: usize = 4;

impl fmt::Display for DeviceLossReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "the device was lost in {} for '{}'", self.call, readable_name(&self.object))?;
        if out.alternate() {
            self.fault.iter().try_for_each(|fault| write!(out, "\nfault: {fault}"))?;
            return self.queues.iter().try_for_each(|queue| queue.write_lines(out));
        }
        self.fault.iter().try_for_each(|fault| write!(out, " ({fault})"))?;
        self.queues.iter().try_for_each(|queue| queue.write_summary(out))
    }
}

impl QueueLossReport {
    /// Writes the oldest unfinished command buffer, which is the likeliest culprit.
    fn write_summary(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(oldest) = self.unfinished.first() else { return Ok(()) };
        write!(out, "; the {} queue had not finished {oldest}", self.queue.label())?;
        let (word, names) = oldest.likely_labels();
        let named: Vec<_> =
            names.iter().take(MAX_NAMED_LABELS).map(|name| format!("'{}'", readable_name(name))).collect();
        if !named.is_empty() {
            let more = if names.len() > named.len() { ", .." } else { "" };
            write!(out, " {word} {}{more}", named.join(", "))?;
        }
        match self.unfinished.len() - 1 {
            0 => Ok(()),
            others => write!(out, ", nor {others} after it"),
        }
    }

    fn write_lines(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { queue, completed, submitted, unfinished } = self;
        write!(out, "\n{} queue: done up to {completed}, submitted up to {submitted}", queue.label())?;
        for commands in unfinished.iter().take(MAX_LISTED_COMMANDS) {
            write!(out, "\n  {commands}")?;
            commands.write_labels(out)?;
        }
        write_rest(out, 2, unfinished.len().saturating_sub(MAX_LISTED_COMMANDS))
    }
}

impl UnfinishedCommands {
    /// Returns the labels that a reader looks at first: those that were begun and not ended, else the last that was
    /// ended, else the outermost.
    fn likely_labels(&self) -> (&'static str, Vec<&str>) {
        let with = |progress| {
            let labels = self.labels.iter().filter(move |label| label.progress == progress);
            labels.map(|label| label.name.as_str())
        };
        let begun: Vec<_> = with(LabelProgress::Begun).collect();
        if !begun.is_empty() {
            return ("in its labels", begun);
        }
        if let Some(last) = with(LabelProgress::Ended).next_back() {
            return ("after its label", vec![last]);
        }
        let outermost = self.labels.iter().filter(|label| label.depth == 0);
        ("with the labels", outermost.map(|label| label.name.as_str()).collect())
    }

    /// Writes the labels around the first that is not ended.
    fn write_labels(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let open = self.labels.iter().position(|label| label.progress != LabelProgress::Ended);
        let first = open.unwrap_or(self.labels.len()).saturating_sub(MAX_LISTED_LABELS / 2);
        if first > 0 {
            write!(out, "\n    .. {first} before these")?;
        }
        for label in self.labels.iter().skip(first).take(MAX_LISTED_LABELS) {
            let indent = 2 * label.depth.min(16) as usize;
            write!(out, "\n    {:9}  {:indent$}{}", label.progress.label(), "", readable_name(&label.name))?;
        }
        write_rest(out, 4, self.labels.len().saturating_sub(first + MAX_LISTED_LABELS))
    }
}

impl fmt::Display for UnfinishedCommands {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name.as_str() {
            "" => write!(out, "submission {}", self.value),
            name => write!(out, "submission {} '{}'", self.value, readable_name(name)),
        }
    }
}

impl LabelProgress {
    fn label(self) -> &'static str {
        match self {
            Self::Unknown => "",
            Self::NotBegun => "not begun",
            Self::Begun => "begun",
            Self::Ended => "ended",
        }
    }
}

fn write_rest(out: &mut fmt::Formatter<'_>, indent: usize, count: usize) -> fmt::Result {
    if count == 0 { Ok(()) } else { write!(out, "\n{:indent$}.. {count} more", "") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn label(name: &str, depth: u32, progress: LabelProgress) -> ReportedLabel {
        ReportedLabel { name: name.to_owned(), depth, progress }
    }

    fn commands(value: u64, name: &str, labels: Vec<ReportedLabel>) -> UnfinishedCommands {
        UnfinishedCommands { value, name: name.to_owned(), labels }
    }

    fn report(unfinished: Vec<UnfinishedCommands>) -> DeviceLossReport {
        let queue = QueueLossReport { queue: Queue::Graphics, completed: 6, submitted: 9, unfinished };
        let object = "timeline".to_owned();
        DeviceLossReport { call: "vkWaitSemaphores", object, fault: None, queues: vec![queue] }
    }

    #[test]
    fn a_report_without_submissions_is_the_call() {
        let (call, object) = ("vkQueuePresentKHR", "main window".to_owned());
        let report = DeviceLossReport { call, object, ..Default::default() };
        assert_eq!(report.to_string(), "the device was lost in vkQueuePresentKHR for 'main window'");
        assert_eq!(format!("{report:#}"), report.to_string());
    }

    #[test]
    fn checkpoints_say_which_label_ran() {
        use LabelProgress::{Begun, Ended, NotBegun};
        let labels = vec![
            label("shadow", 0, Ended),
            label("shade", 0, Begun),
            label("lights", 1, Begun),
            label("post", 0, NotBegun),
        ];
        let mut report = report(vec![commands(7, "frame 3", labels), commands(9, "", Vec::new())]);
        report.fault = Some(DeviceFault { description: "page fault".to_owned(), ..Default::default() });
        assert_eq!(
            report.to_string(),
            "the device was lost in vkWaitSemaphores for 'timeline' (page fault); the graphics queue had not finished \
             submission 7 'frame 3' in its labels 'shade', 'lights', nor 1 after it"
        );
        assert_eq!(
            format!("{report:#}"),
            "the device was lost in vkWaitSemaphores for 'timeline'\nfault: page fault\n\
             graphics queue: done up to 6, submitted up to 9\n  \
             submission 7 'frame 3'\n    \
             ended      shadow\n    \
             begun      shade\n    \
             begun        lights\n    \
             not begun  post\n  \
             submission 9"
        );
    }

    #[test]
    fn without_checkpoints_the_outermost_labels_are_named() {
        use LabelProgress::Unknown;
        let names = ["a", "b", "c", "d", "e"];
        let mut labels: Vec<_> = names.map(|name| label(name, 0, Unknown)).to_vec();
        labels.insert(1, label("inner", 1, Unknown));
        let text = report(vec![commands(7, "", labels)]).to_string();
        assert!(text.ends_with("submission 7 with the labels 'a', 'b', 'c', 'd', .."), "{text}");
    }

    #[test]
    fn a_command_buffer_between_two_labels_names_the_last_that_ended() {
        use LabelProgress::{Ended, NotBegun};
        let labels = vec![label("a", 0, Ended), label("b", 0, Ended), label("c", 0, NotBegun)];
        let text = report(vec![commands(7, "", labels)]).to_string();
        assert!(text.ends_with("submission 7 after its label 'b'"), "{text}");
    }

    #[test]
    fn long_lists_keep_the_lines_around_the_label_that_ran() {
        let progress = |place| if place < 100 { LabelProgress::Ended } else { LabelProgress::NotBegun };
        let labels = (0..200).map(|place| label(&format!("l{place}"), 0, progress(place))).collect();
        let mut unfinished = vec![commands(7, "", labels)];
        unfinished.extend((8..40).map(|value| commands(value, "", Vec::new())));
        let text = format!("{:#}", report(unfinished));
        let lines: Vec<_> = text.lines().collect();
        assert!(lines.contains(&"    .. 76 before these") && lines.contains(&"    .. 76 more"), "{text}");
        assert!(lines.contains(&"    ended      l99") && lines.contains(&"    not begun  l100"), "{text}");
        assert_eq!((lines.last(), lines.len()), (Some(&"  .. 17 more"), 2 + 16 + 50 + 1));
    }
}
