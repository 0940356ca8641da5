//! Faults: the call that fails, and its error.

use std::fmt;
use std::str::FromStr;

use ash::vk;

/// Errors that a call can be made to answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FaultError {
    /// `VK_ERROR_OUT_OF_HOST_MEMORY`.
    HostMemory,
    /// `VK_ERROR_OUT_OF_DEVICE_MEMORY`.
    DeviceMemory,
    /// `VK_ERROR_DEVICE_LOST`. The device stays lost.
    DeviceLost,
    /// `VK_ERROR_SURFACE_LOST_KHR`.
    SurfaceLost,
    /// `VK_ERROR_OUT_OF_DATE_KHR`.
    OutOfDate,
    /// `VK_ERROR_NATIVE_WINDOW_IN_USE_KHR`.
    WindowInUse,
    /// `VK_SUCCESS` with the address of a failed `mmap`, -1, as lavapipe answers `vkMapMemory` where address space lacks.
    NoAddress,
}

impl FaultError {
    /// Every error.
    pub const ALL: [Self; 7] = [
        Self::HostMemory,
        Self::DeviceMemory,
        Self::DeviceLost,
        Self::SurfaceLost,
        Self::OutOfDate,
        Self::WindowInUse,
        Self::NoAddress,
    ];

    /// Returns the name of the error in logs.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::HostMemory => "host-memory",
            Self::DeviceMemory => "device-memory",
            Self::DeviceLost => "device-lost",
            Self::SurfaceLost => "surface-lost",
            Self::OutOfDate => "out-of-date",
            Self::WindowInUse => "window-in-use",
            Self::NoAddress => "no-address",
        }
    }

    /// Returns the answer of a call that this error makes fail.
    pub const fn result(self) -> vk::Result {
        match self {
            Self::HostMemory => vk::Result::ERROR_OUT_OF_HOST_MEMORY,
            Self::DeviceMemory => vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
            Self::DeviceLost => vk::Result::ERROR_DEVICE_LOST,
            Self::SurfaceLost => vk::Result::ERROR_SURFACE_LOST_KHR,
            Self::OutOfDate => vk::Result::ERROR_OUT_OF_DATE_KHR,
            Self::WindowInUse => vk::Result::ERROR_NATIVE_WINDOW_IN_USE_KHR,
            Self::NoAddress => vk::Result::SUCCESS,
        }
    }

    /// Texts of which an error that comes of this one has one, in lower case: the library's, the name in Vulkan, or the
    /// text of ash.
    #[must_use]
    pub const fn texts(self) -> [&'static str; 3] {
        match self {
            Self::HostMemory | Self::NoAddress => {
                ["out of host memory", "error_out_of_host_memory", "host memory allocation has failed"]
            }
            Self::DeviceMemory => {
                ["out of device memory", "error_out_of_device_memory", "device memory allocation has failed"]
            }
            Self::DeviceLost => ["device was lost", "error_device_lost", "device has been lost"],
            Self::SurfaceLost => ["window is gone", "error_surface_lost", "surface is no longer available"],
            Self::OutOfDate => ["out of date", "error_out_of_date", "surface has changed"],
            Self::WindowInUse => {
                ["error_native_window_in_use", "window is already in use", "window is in use"]
            }
        }
    }

    /// True for the errors of memory.
    #[must_use]
    pub const fn is_shortage(self) -> bool {
        matches!(self, Self::HostMemory | Self::DeviceMemory | Self::NoAddress)
    }

    /// Returns the error of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|error| error.name() == name)
    }
}

/// The calls that fail, from the one that a [`Fault`] names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Span {
    /// The call alone.
    Once,
    /// The call and all later ones of the same command.
    Command,
    /// The call and all later ones of every command, as far as the command may answer the error. A shortage of memory spares
    /// questions about the progress of work and of presents ([`PROGRESS`], [`PRESENTED`]), so that a context can learn that its work has ended.
    Stays,
    /// The same, and questions about the progress of work fail too.
    Unanswered,
}

/// The command that asks how far the work of a queue is.
pub const PROGRESS: &str = "vkGetSemaphoreCounterValue";

/// The command that asks whether a present has ended.
pub const PRESENTED: &str = "vkGetFenceStatus";

impl Span {
    /// Every span.
    pub const ALL: [Self; 4] = [Self::Once, Self::Command, Self::Stays, Self::Unanswered];

    /// Returns the name of the span in texts of faults.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Once => "once",
            Self::Command => "command",
            Self::Stays => "stays",
            Self::Unanswered => "unanswered",
        }
    }

    /// True if a later call fails too: one of `command`, of a fault of `error` in the command `of`.
    #[must_use]
    pub fn goes_on(self, error: FaultError, of: &str, command: &str) -> bool {
        match self {
            Self::Once => false,
            Self::Command => command == of,
            Self::Stays => ![PROGRESS, PRESENTED].contains(&command) || !error.is_shortage(),
            Self::Unanswered => true,
        }
    }

    /// Returns the span of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|span| span.name() == name)
    }
}

/// A call that fails. A command and the number of its call stay the same from run to run, where threads change the
/// order of all calls.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Name of the Vulkan command.
    pub command: String,
    /// Number of the call among those of the command, from 1.
    pub call: u32,
    /// The error.
    pub error: FaultError,
    /// The later calls that fail, too.
    pub span: Span,
}

impl fmt::Display for Fault {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { command, call, error, span } = self;
        write!(out, "{command} {call} {} {}", error.name(), span.name())
    }
}

/// A text that describes no fault.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no fault; write COMMAND CALL ERROR once|command|stays|unanswered")]
pub struct NoFault(String);

impl FromStr for Fault {
    type Err = NoFault;

    fn from_str(text: &str) -> Result<Self, NoFault> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let parsed = match *words {
            [command, call, error, span] => call
                .parse()
                .ok()
                .zip(FaultError::named(error))
                .zip(Span::named(span))
                .map(|((call, error), span)| Self { command: command.to_owned(), call, error, span }),
            _ => None,
        };
        parsed.ok_or_else(|| NoFault(text.to_owned()))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    #[test]
    fn faults_come_back_from_their_text() {
        for error in FaultError::ALL {
            for span in Span::ALL {
                let fault = Fault { command: "vkCreateBuffer".into(), call: 3, error, span };
                assert_eq!(fault.to_string().parse(), Ok(fault));
            }
        }
    }

    #[test]
    fn only_faults_that_are_unanswered_hide_the_progress_of_work() {
        let goes_on = |span: Span, error, command| span.goes_on(error, "vkMapMemory", command);
        for error in FaultError::ALL {
            assert!(!goes_on(Span::Once, error, "vkMapMemory"));
            assert!(goes_on(Span::Command, error, "vkMapMemory") && !goes_on(Span::Command, error, PROGRESS));
            assert!(goes_on(Span::Stays, error, "vkQueueWaitIdle"));
            for question in [PROGRESS, PRESENTED] {
                assert_eq!(goes_on(Span::Stays, error, question), !error.is_shortage());
                assert!(goes_on(Span::Unanswered, error, question));
            }
        }
    }

    #[test]
    fn other_texts_are_refused() {
        for text in [
            "",
            "vkCreateBuffer",
            "vkCreateBuffer x host-memory once",
            "vkCreateBuffer 1 rain once",
            "a 1 device-lost ever",
        ] {
            assert!(text.parse::<Fault>().unwrap_err().to_string().starts_with(&format!("'{text}'")));
        }
    }
}
