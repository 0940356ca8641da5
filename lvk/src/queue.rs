//! The three queues that command buffers run on.

/// The queue that a command buffer runs on. All three queues exist on every device. Each refuses the same
/// commands everywhere, except that [`QueueInfo`](crate::QueueInfo) limits timestamps and copies. Queues
/// without hardware of their own share a Vulkan queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Queue {
    /// Supports every command, and presents to windows. Uploads run here.
    #[default]
    Graphics,
    /// Supports dispatches, traces, builds of acceleration structures, clears of colours, and copies,
    /// concurrently with graphics.
    Compute,
    /// Supports copies, fills and updates of buffers, concurrently with the other queues.
    Transfer,
}

impl Queue {
    /// All queues.
    pub const ALL: [Self; 3] = [Self::Graphics, Self::Compute, Self::Transfer];

    /// Returns the index in [`ALL`](Self::ALL).
    pub(crate) fn index(self) -> usize {
        self as usize
    }

    /// Returns the name for messages.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Graphics => "graphics",
            Self::Compute => "compute",
            Self::Transfer => "transfer",
        }
    }
}
