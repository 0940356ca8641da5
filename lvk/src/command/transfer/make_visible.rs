//! Makes the results of copies visible to all stages before shaders run.

use crate::barrier::{Layout, Stages, Use};
use crate::command::CommandBuffer;
use crate::command::pending_visibility::PendingVisibility;
use crate::command::queue_support::limited_to_queue;
use crate::command::recording_state::RecordingState;
use crate::resource::texture_desc::TextureUsage;
use crate::submit::Recording;
use crate::submit::emit_barriers::emit;

impl CommandBuffer {
    /// Makes the resources that copies used readable by every shader and every input, with one barrier for all.
    #[inline]
    pub(in crate::command) fn make_visible(&mut self) {
        if !self.state.pending_visibility.is_empty() {
            self.make_all_visible();
        }
    }

    fn make_all_visible(&mut self) {
        let queue_index = self.recording.queue_index;
        let Recording { tracker, images, commands, .. } = &mut **self.recording;
        let RecordingState { pending_visibility, barriers, last_barrier, .. } = &mut **self.state;
        barriers.clear();
        // A resource written twice is listed twice; its second read needs no barrier.
        for written in pending_visibility.drain(..) {
            match written {
                PendingVisibility::Buffer(buffer) => {
                    tracker.use_buffer(
                        buffer.id,
                        limited_to_queue(queue_index, Use::everything_read()),
                        barriers,
                    );
                }
                PendingVisibility::Texture(texture) => {
                    let Some(read) = default_use(texture.image.usage) else { continue };
                    let read = limited_to_queue(queue_index, read);
                    let image = &texture.image;
                    images.insert(image.id, image.barrier_image());
                    tracker.use_texture(image.id, image.shape, texture.range, read, barriers);
                }
            }
        }
        emit(&self.shared.gpu, *commands, barriers, images, last_barrier);
    }
}

/// Returns the use of a texture by shaders without a declaration; `None` if shaders do not read it.
fn default_use(usage: TextureUsage) -> Option<Use> {
    let read = Use::shader_read(Stages::SHADERS);
    if usage.contains(TextureUsage::SAMPLED) {
        return Some(read);
    }
    usage.contains(TextureUsage::STORAGE).then_some(read.with_layout(Layout::General))
}
