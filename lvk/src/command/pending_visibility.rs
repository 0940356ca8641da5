//! Resources that copies wrote and that shaders do not see yet.

use std::sync::Arc;

use crate::resource::{Buffer, Texture};

/// A resource a copy wrote, or read in a layout of its own, to be made readable everywhere before shaders run.
pub(super) enum PendingVisibility {
    Buffer(Arc<Buffer>),
    Texture(Arc<Texture>),
}
