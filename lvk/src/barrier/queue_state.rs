//! What the queue will have done to every resource, and the barriers between it and the next command buffer.

use super::access::{Layout, StageAccess, Stages, Use};
use super::batch::Barriers;
use super::resource_id::{IdMap, ResourceId};
use super::resource_state::{Scopes, State, accumulate, transition};
use super::subresource::{Cells, Subresources, TextureShape};
use super::tracker::{Arrived, Local, Prefix, Tracker, Used};

/// State of every resource after everything submitted to one queue so far.
#[derive(Debug, Default)]
pub(crate) struct States {
    buffers: IdMap<State>,
    textures: IdMap<Cells<State>>,
}

impl States {
    /// Appends a recorded command buffer. The barriers returned must be recorded in front of it, after everything
    /// submitted before.
    pub(crate) fn submit(&mut self, local: &Tracker) -> Barriers {
        let mut out = Barriers::default();
        for (id, local) in local.buffers() {
            if let Some(scopes) = settle(self.buffers.entry(*id).or_default(), local) {
                out.push_memory(&scopes);
            }
        }
        for (id, local) in local.textures() {
            let fresh = || Cells::new(local.shape(), State::default());
            let queue = self.textures.entry(*id).or_insert_with(fresh);
            let whole = local.shape().whole();
            if let (Some(local), Some(state)) = (local.uniform(), queue.whole(whole)) {
                if let Some(scopes) = settle(state, local) {
                    out.push_image(*id, whole, &scopes);
                }
                continue;
            }
            for (range, scopes) in settle_texture(queue, local) {
                out.push_image(*id, range, &scopes);
            }
        }
        out
    }

    /// An image comes from the presentation engine. The next submission waits for its semaphore at `stages`, so that the
    /// first barrier has to start there.
    pub(crate) fn acquired(&mut self, id: ResourceId, shape: TextureShape, stages: Stages) {
        self.textures.insert(id, Cells::new(shape, State::acquired(stages)));
    }

    /// An image comes from somebody else, in this layout. Whatever the next submission waits for, the first barrier starts
    /// there.
    pub(crate) fn imported(&mut self, id: ResourceId, shape: TextureShape, layout: Layout) {
        let stages = Stages::all() - Stages::HOST - Stages::SHADING_RATE;
        self.textures.insert(id, Cells::new(shape, State::imported(layout, stages)));
    }

    /// The layouts that a texture is in; none for buffers, and for what was never used.
    pub(crate) fn layouts(&self, id: ResourceId) -> Option<Cells<Layout>> {
        self.textures.get(&id).map(|cells| cells.map(State::layout))
    }

    /// The next submission takes a resource over from another queue, which left it in these layouts, and waits for a semaphore
    /// at `stages`.
    pub(crate) fn take_over(&mut self, used: Used<'_>, before: Option<&Cells<Layout>>, stages: Stages) {
        match used.arrived(before, stages) {
            Arrived::Buffer => {
                self.buffers.insert(used.id, State::default());
            }
            Arrived::Texture(cells) => {
                self.textures.insert(used.id, cells);
            }
        }
    }

    /// Everything that was ever used.
    pub(crate) fn ids(&self) -> impl Iterator<Item = ResourceId> {
        self.buffers.keys().chain(self.textures.keys()).copied()
    }

    /// The host has written a new image, and left it in the layout that shaders sample: nothing is pending.
    pub(crate) fn filled(&mut self, id: ResourceId, shape: TextureShape) {
        self.textures.insert(id, Cells::new(shape, State::untouched_in(Layout::ShaderRead)));
    }

    /// Drops what is known about a destroyed resource.
    pub(crate) fn forget(&mut self, id: ResourceId) {
        self.buffers.remove(&id);
        self.textures.remove(&id);
    }
}

fn settle_texture(queue: &mut Cells<State>, local: &Cells<Local>) -> Vec<(Subresources, Scopes)> {
    let whole = local.shape().whole();
    match local.uniform() {
        Some(local) => queue.step(whole, |state| settle(state, local)),
        None => queue.step_each(whole, |state, mip, layer| settle(state, local.at(mip, layer))),
    }
}

/// Advances `queue` by all that a command buffer does, and returns the barrier in front of the command buffer.
fn settle(queue: &mut State, local: &Local) -> Option<Scopes> {
    let scopes = match &local.prefix {
        Prefix::Unused => return None,
        Prefix::Write(write) => transition(queue, *write),
        Prefix::Accumulated(writes) => settle_accumulated(queue, writes, local.past_prefix),
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

/// What follows inside the command buffer waits for these writes only, but with them for the same scope of everything
/// submitted before. An earlier accumulated write outside that scope must be chained to these.
fn settle_accumulated(queue: &mut State, writes: &StageAccess, past_prefix: bool) -> Option<Scopes> {
    let all = Use { stages: writes.stages(), access: writes.access(), layout: Layout::Undefined };
    let chained = queue.is_read() || queue.write_is_within(all.stages, all.access);
    if past_prefix && !chained { transition(queue, all) } else { accumulate(queue, writes) }
}
