//! Resources that copies used and that are not visible to shaders yet.

use std::sync::Arc;

use crate::resource::{Buffer, Texture};

/// A resource that a copy wrote, or read in a transfer layout. It must be made readable by all stages before shaders
/// run.
pub(super) enum PendingVisibility {
    Buffer(Arc<Buffer>),
    Texture(Arc<Texture>),
}
