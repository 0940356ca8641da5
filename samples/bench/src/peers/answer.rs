//! Lines that a child process writes to its parent.

use std::fmt;

use super::peer::{PeerDevice, Sample};

/// The start of each line. A library may write other lines to standard output.
const MARK: &str = "peer: ";

/// A line from a child process.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Answer {
    /// The device is open; it took these milliseconds.
    Opened { milliseconds: f64, device: PeerDevice },
    /// The row is prepared.
    Ready,
    /// The peer cannot do the row, for this reason.
    Cannot(String),
    /// Times of a sample.
    Times(Sample),
    /// The result of the last sample.
    Result(Option<f64>),
    /// Resident memory of the process in megabytes.
    Memory(Option<f64>),
    /// Milliseconds in which the GPU worked since the last question.
    GpuTime(Option<f64>),
}

impl fmt::Display for Answer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = |number: &Option<f64>| number.map_or_else(|| "none".to_owned(), |x| x.to_string());
        f.write_str(MARK)?;
        match self {
            Self::Opened { milliseconds, device } => {
                let kind = if device.is_cpu { "cpu" } else { "gpu" };
                write!(f, "opened {milliseconds} {kind} {}", one_line(&device.name))
            }
            Self::Ready => f.write_str("ready"),
            Self::Cannot(reason) => write!(f, "cannot {}", one_line(reason)),
            Self::Times(Sample { cpu, done }) => write!(f, "times {cpu} {done}"),
            Self::Result(result) => write!(f, "result {}", number(result)),
            Self::Memory(megabytes) => write!(f, "memory {}", number(megabytes)),
            Self::GpuTime(milliseconds) => write!(f, "gpu-time {}", number(milliseconds)),
        }
    }
}

impl Answer {
    /// Reads a line; `None` for a line that is no answer.
    pub(super) fn from_line(line: &str) -> Option<Self> {
        let text = line.trim_end().strip_prefix(MARK)?;
        let (word, rest) = text.split_once(' ').unwrap_or((text, ""));
        let optional = || rest.parse().map_or_else(|_| (rest == "none").then_some(None), |x| Some(Some(x)));
        match word {
            "opened" => {
                let (milliseconds, rest) = rest.split_once(' ')?;
                let (kind, name) = rest.split_once(' ')?;
                let device = PeerDevice { name: name.to_owned(), is_cpu: kind == "cpu" };
                Some(Self::Opened { milliseconds: milliseconds.parse().ok()?, device })
            }
            "ready" => Some(Self::Ready),
            "cannot" => Some(Self::Cannot(rest.to_owned())),
            "times" => {
                let (cpu, done) = rest.split_once(' ')?;
                Some(Self::Times(Sample { cpu: cpu.parse().ok()?, done: done.parse().ok()? }))
            }
            "result" => Some(Self::Result(optional()?)),
            "memory" => Some(Self::Memory(optional()?)),
            "gpu-time" => Some(Self::GpuTime(optional()?)),
            _ => None,
        }
    }
}

/// Returns the text in one line, with its words a space apart.
pub(super) fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_as_they_were_written() {
        let device = PeerDevice { name: "a device; driver 1.2".to_owned(), is_cpu: true };
        let answers = [
            Answer::Opened { milliseconds: 1.5, device },
            Answer::Ready,
            Answer::Cannot("no such feature".to_owned()),
            Answer::Times(Sample { cpu: 0.25, done: 1e-3 }),
            Answer::Result(Some(-2.0)),
            Answer::Result(None),
            Answer::Memory(Some(88.5)),
            Answer::GpuTime(Some(0.5)),
        ];
        for answer in answers {
            assert_eq!(Answer::from_line(&format!("{answer}\n")), Some(answer));
        }
    }

    #[test]
    fn other_lines_are_no_answers() {
        for line in
            ["", "ready", "peer: times 1", "peer: result lost", "peer: opened x cpu name", "peer: what"]
        {
            assert_eq!(Answer::from_line(line), None, "{line}");
        }
        let reason = Answer::Cannot("two\n  lines".to_owned()).to_string();
        assert_eq!(reason, "peer: cannot two lines");
    }
}
