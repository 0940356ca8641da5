//! The three queues that command buffers run on.

/// Where command buffers run. All three exist on every device and refuse the same commands everywhere, but for what
/// [`QueueInfo`](crate::QueueInfo) says of timestamps and copies; those without hardware of their own share it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Queue {
    /// Takes every command, and shows pictures in windows. Uploads run here.
    #[default]
    Graphics,
    /// Takes dispatches, traces, builds of acceleration structures, clears of colours, and copies: beside what is drawn.
    Compute,
    /// Takes copies, fills and updates of buffers, beside everything else.
    Transfer,
}

impl Queue {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Graphics, Self::Compute, Self::Transfer];

    /// Its place in [`ALL`](Self::ALL).
    pub(crate) fn index(self) -> usize {
        self as usize
    }

    /// As messages say it.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Graphics => "graphics",
            Self::Compute => "compute",
            Self::Transfer => "transfer",
        }
    }
}
