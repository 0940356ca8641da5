//! The textures that a command declares and writes, for the index checks.

use std::collections::BTreeMap;

use super::CommandBuffer;
use crate::barrier::{Access, Layout, Use};
use crate::bindless::index_checks::SlotAccess;
use crate::store::Store;

/// Returns true if later commands need a declaration after this use, and false if the use makes the texture readable
/// everywhere. `None` if the use changes neither.
fn leaves_written(next: Use) -> Option<bool> {
    match next {
        // The next command with shaders makes the results of copies visible by itself.
        next if next.access.contains(Access::TRANSFER_WRITE) => Some(false),
        next if next.is_write() => Some(true),
        next if next.layout == Layout::ShaderRead => Some(false),
        _ => None,
    }
}

impl CommandBuffer {
    /// Records which textures the next command declares and writes, if indices are checked. A use of an image holds for
    /// the slots of all of its textures.
    pub(super) fn record_declarations(&mut self) {
        let Some(checks) = &self.shared.bindless.checks else { return };
        let mut slots = BTreeMap::new();
        for (texture, part, next) in self.state.accesses.textures(&self.state.texture_cache) {
            let Some(is_written) = leaves_written(next).filter(|_| !texture.is_yuv()) else { continue };
            let mut add = |slot| _ = slots.insert(slot, SlotAccess { slot, is_declared: false, is_written });
            add(texture.slot);
            if texture.image.has_views() {
                let Store { textures, .. } = &self.shared.store;
                let of_image = textures.all_objects().into_iter().filter(|other| {
                    other.image.id == texture.image.id && other.range.intersection(part).is_some()
                });
                of_image.for_each(|other| add(other.slot));
            }
        }
        for (slot, is_written) in self.state.declared.drain(..) {
            slots.insert(slot, SlotAccess { slot, is_declared: true, is_written });
        }
        let accesses: Vec<_> = slots.into_values().collect();
        checks.record_accesses(&self.shared.gpu, self.recording.commands, &accesses);
    }
}
