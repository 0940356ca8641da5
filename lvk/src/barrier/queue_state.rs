//! State of every resource after all submissions to a queue, and the barriers in front of the next command
//! buffer.

use super::access::{Layout, StageAccess, Stages, Use};
use super::batch::Barriers;
use super::resource_id::{IdMap, ResourceId};
use super::resource_state::{BarrierScopes, ResourceState, accumulate, transition};
use super::subresource::{PerSubresource, Subresources, TextureShape};
use super::tracker::{LocalState, Prefix, TrackedUse, Tracker, TransferredState};

/// State of every resource after all submissions to one queue so far.
#[derive(Debug, Default)]
pub(crate) struct QueueState {
    buffers: IdMap<ResourceState>,
    textures: IdMap<PerSubresource<ResourceState>>,
}

impl QueueState {
    /// Appends a recorded command buffer. The returned barriers must be recorded in front of it, after all
    /// earlier submissions.
    pub(crate) fn submit(&mut self, local: &Tracker) -> Barriers {
        let mut out = Barriers::default();
        for (id, local) in local.buffers() {
            if let Some(scopes) = apply_local(self.buffers.entry(*id).or_default(), local) {
                out.push_memory(&scopes);
            }
        }
        for (id, local) in local.textures() {
            let fresh = || PerSubresource::new(local.shape(), ResourceState::default());
            let queue = self.textures.entry(*id).or_insert_with(fresh);
            let whole = local.shape().all_subresources();
            if let (Some(local), Some(state)) = (local.uniform(), queue.uniform_mut(whole)) {
                if let Some(scopes) = apply_local(state, local) {
                    out.push_image(*id, whole, &scopes);
                }
                continue;
            }
            for (range, scopes) in apply_texture(queue, local) {
                out.push_image(*id, range, &scopes);
            }
        }
        out
    }

    /// Records that an image was acquired from the presentation engine. The next submission waits for its
    /// semaphore at `stages`, so the first barrier must start there.
    pub(crate) fn mark_acquired(&mut self, id: ResourceId, shape: TextureShape, stages: Stages) {
        self.textures.insert(id, PerSubresource::new(shape, ResourceState::acquired(stages)));
    }

    /// Records that the caller imported an image in this layout. The next submission may wait for a semaphore
    /// at any stage, so the first barrier starts at all of them.
    pub(crate) fn mark_imported(&mut self, id: ResourceId, shape: TextureShape, layout: Layout) {
        let stages = Stages::all() - Stages::HOST - Stages::SHADING_RATE;
        self.textures.insert(id, PerSubresource::new(shape, ResourceState::imported(layout, stages)));
    }

    /// Returns the layouts of a texture. `None` for buffers and for resources that were never used.
    pub(crate) fn layouts(&self, id: ResourceId) -> Option<PerSubresource<Layout>> {
        self.textures.get(&id).map(|cells| cells.map(ResourceState::layout))
    }

    /// Records that the next submission takes over a resource from another queue, which left it in the
    /// layouts `before`. The submission waits for a semaphore at `stages`.
    pub(crate) fn take_ownership(
        &mut self,
        used: TrackedUse<'_>,
        before: Option<&PerSubresource<Layout>>,
        stages: Stages,
    ) {
        match used.transferred_state(before, stages) {
            TransferredState::Buffer => {
                self.buffers.insert(used.id, ResourceState::default());
            }
            TransferredState::Texture(cells) => {
                self.textures.insert(used.id, cells);
            }
        }
    }

    /// Returns the ids of all resources ever used.
    pub(crate) fn ids(&self) -> impl Iterator<Item = ResourceId> {
        self.buffers.keys().chain(self.textures.keys()).copied()
    }

    /// Records that the host wrote a new image and left it in the layout for sampling. No access is pending.
    pub(crate) fn mark_host_written(&mut self, id: ResourceId, shape: TextureShape) {
        self.textures.insert(id, PerSubresource::new(shape, ResourceState::untouched_in(Layout::ShaderRead)));
    }

    /// Removes the state of a destroyed resource.
    pub(crate) fn forget(&mut self, id: ResourceId) {
        self.buffers.remove(&id);
        self.textures.remove(&id);
    }
}

fn apply_texture(
    queue: &mut PerSubresource<ResourceState>,
    local: &PerSubresource<LocalState>,
) -> Vec<(Subresources, BarrierScopes)> {
    let whole = local.shape().all_subresources();
    match local.uniform() {
        Some(local) => queue.update(whole, |state| apply_local(state, local)),
        None => queue.update_each(whole, |state, mip, layer| apply_local(state, local.at(mip, layer))),
    }
}

/// Advances `queue` by all accesses of a command buffer. Returns the barrier in front of the command buffer.
fn apply_local(queue: &mut ResourceState, local: &LocalState) -> Option<BarrierScopes> {
    let scopes = match &local.prefix {
        Prefix::Unused => return None,
        Prefix::Discarded => None,
        Prefix::Write(write) => transition(queue, *write),
        Prefix::Accumulated(writes) => apply_accumulated(queue, writes, local.past_prefix),
        Prefix::Reads(layout, reads) if *layout != queue.layout() => {
            transition(queue, Use { stages: reads.stages(), access: reads.access(), layout: *layout })
        }
        Prefix::Reads(_, reads) if local.past_prefix => queue.read_for_all(reads),
        Prefix::Reads(_, reads) => queue.read(reads),
    };
    if local.past_prefix {
        *queue = local.state;
    }
    scopes
}

/// Advances `queue` by accumulated writes at the start of a command buffer. Later commands of the command
/// buffer wait for these writes and for the same scope of earlier submissions, and for nothing else. Earlier
/// accumulated writes outside that scope must therefore be chained to these.
fn apply_accumulated(
    queue: &mut ResourceState,
    writes: &StageAccess,
    past_prefix: bool,
) -> Option<BarrierScopes> {
    let all = Use { stages: writes.stages(), access: writes.access(), layout: Layout::Undefined };
    let chained = queue.is_read() || queue.write_is_within(all.stages, all.access);
    if past_prefix && !chained { transition(queue, all) } else { accumulate(queue, writes) }
}
