//! Barriers inside one command buffer, computed without knowledge of earlier submissions.

use super::access::{Layout, StageAccess, Stages, Use};
use super::batch::Barriers;
use super::resource_id::{IdMap, ResourceId};
use super::resource_state::{BarrierScope, BarrierScopes, ResourceState, accumulate, transition};
use super::subresource::{PerSubresource, Subresources, TextureShape};

/// The first uses of a (sub)resource by a command buffer, before a use that must wait for another one in the
/// same command buffer.
///
/// The queue only has to synchronise with the prefix; see
/// [`QueueState::submit`](super::queue_state::QueueState::submit).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Prefix {
    /// Not used at all.
    #[default]
    Unused,
    /// Reads in one layout.
    Reads(Layout, StageAccess),
    /// A write.
    Write(Use),
    /// Accumulated writes, which do not wait for each other.
    Accumulated(StageAccess),
    /// The contents were discarded before the first use, which depends on nothing before the command buffer.
    Discarded,
}

impl Prefix {
    fn stages(&self) -> Stages {
        match self {
            Self::Unused | Self::Discarded => Stages::empty(),
            Self::Reads(_, table) | Self::Accumulated(table) => table.stages(),
            Self::Write(first) => first.stages,
        }
    }

    /// Returns the layout that an image must have before the command buffer. `None` if it is not used.
    fn layout(&self) -> Option<Layout> {
        match self {
            Self::Unused => None,
            Self::Reads(layout, _) => Some(*layout),
            Self::Write(first) => Some(first.layout),
            Self::Accumulated(_) | Self::Discarded => Some(Layout::Undefined),
        }
    }
}

/// State of one (sub)resource inside one command buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct LocalState {
    pub(super) prefix: Prefix,
    /// True if the command buffer has used it beyond the prefix. `state` then depends on nothing before the
    /// command buffer.
    pub(super) past_prefix: bool,
    pub(super) state: ResourceState,
}

impl LocalState {
    /// Returns the barrier in front of a use that repeats the last one and leaves the state unchanged. `None`
    /// for every other use.
    #[inline(always)]
    fn repeated(&self, next: Use) -> Option<BarrierScopes> {
        if self.past_prefix { self.state.repeated(next) } else { None }
    }

    /// Adds a use. Returns the barrier in front of it, if one is needed.
    #[inline(never)]
    fn apply(&mut self, next: Use) -> Option<BarrierScopes> {
        if !self.past_prefix {
            self.apply_to_prefix(next);
        }
        transition(&mut self.state, next)
    }

    /// Adds a use that may belong to the prefix.
    fn apply_to_prefix(&mut self, next: Use) {
        match &mut self.prefix {
            Prefix::Unused => self.end_prefix(next),
            Prefix::Reads(layout, reads) if !next.is_write() && *layout == next.layout => reads.insert(next),
            _ => self.past_prefix = true,
        }
    }

    fn end_prefix(&mut self, next: Use) {
        self.state = ResourceState::untouched_in(next.layout);
        self.past_prefix = next.is_write();
        self.prefix =
            if next.is_write() { Prefix::Write(next) } else { Prefix::Reads(next.layout, next.into()) };
    }

    /// True if the command buffer changes the contents, or the layout `found` before it.
    fn changes(&self, found: Layout) -> bool {
        match self.prefix {
            Prefix::Unused => false,
            Prefix::Write(_) | Prefix::Accumulated(_) | Prefix::Discarded => true,
            Prefix::Reads(layout, _) => self.past_prefix || layout != found,
        }
    }

    /// Discards the contents. A barrier or semaphore has made `stages` wait for all earlier uses.
    fn discarded_before(stages: Stages) -> Self {
        let state = ResourceState::imported(Layout::Undefined, stages);
        Self { prefix: Prefix::Discarded, past_prefix: true, state }
    }

    fn accumulate(&mut self, write: Use) -> Option<BarrierScopes> {
        match &mut self.prefix {
            Prefix::Unused => self.prefix = Prefix::Accumulated(write.into()),
            Prefix::Accumulated(all) if !self.past_prefix => {
                all.insert(write);
            }
            _ => self.past_prefix = true,
        }
        accumulate(&mut self.state, &write.into())
    }
}

/// Number of cached table indices, a power of two.
const INDEX_SIZE: usize = 8;

/// Values in the order of their first use, with lookup by id.
#[derive(Debug, Clone)]
struct IdTable<T> {
    rows: IdMap<usize>,
    values: Vec<(ResourceId, T)>,
    /// Cache of recently used indices, at positions derived from the id. Commands use the same few resources
    /// again and again. A cached index is valid for an id if the entry at the index has that id.
    lately: [usize; INDEX_SIZE],
}

impl<T> IdTable<T> {
    fn get(&self, id: ResourceId) -> Option<&T> {
        self.rows.get(&id).map(|&row| &self.values[row].1)
    }

    #[inline]
    fn entry(&mut self, id: ResourceId, fresh: impl FnOnce() -> T) -> &mut T {
        let place = id.0 as usize % INDEX_SIZE;
        let mut row = self.lately[place];
        if self.values.get(row).is_none_or(|(known, _)| *known != id) {
            row = self.position_or_insert(id, fresh);
            self.lately[place] = row;
        }
        &mut self.values[row].1
    }

    #[inline(never)]
    fn position_or_insert(&mut self, id: ResourceId, fresh: impl FnOnce() -> T) -> usize {
        *self.rows.entry(id).or_insert_with(|| {
            self.values.push((id, fresh()));
            self.values.len() - 1
        })
    }

    fn clear(&mut self) {
        self.rows.clear();
        self.values.clear();
    }
}

impl<T> Default for IdTable<T> {
    fn default() -> Self {
        Self { rows: IdMap::default(), values: Vec::new(), lately: [0; INDEX_SIZE] }
    }
}

/// The uses of all resources by one command buffer during recording.
///
/// The barriers returned here only concern earlier commands of the same command buffer. The requirements on
/// the queue are kept for [`QueueState::submit`](super::queue_state::QueueState::submit). Command buffers can
/// therefore be recorded concurrently and submitted in any order.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tracker {
    buffers: IdTable<LocalState>,
    textures: IdTable<PerSubresource<LocalState>>,
}

impl Tracker {
    /// Clears the tracker for the next command buffer, but keeps its memory.
    pub(crate) fn clear(&mut self) {
        self.buffers.clear();
        self.textures.clear();
    }

    /// Records the use of a buffer by a command. Adds the barrier in front of the command to `out`.
    #[inline(always)]
    pub(crate) fn use_buffer(&mut self, id: ResourceId, next: Use, out: &mut Barriers) {
        let next = next.with_layout(Layout::Undefined);
        let local = self.buffers.entry(id, LocalState::default);
        if let Some(scopes) = local.repeated(next).or_else(|| local.apply(next)) {
            out.push_memory(&scopes);
        }
    }

    /// Records a write to a part of a resource that no other such write touches without a use in between. An
    /// example are builds of different acceleration structures, which are tracked as one resource.
    pub(crate) fn accumulate_buffer(&mut self, id: ResourceId, write: Use, out: &mut Barriers) {
        let write = write.with_layout(Layout::Undefined);
        if let Some(scopes) = self.buffers.entry(id, LocalState::default).accumulate(write) {
            out.push_memory(&scopes);
        }
    }

    /// Records the use of a part of a texture by a command. Adds the barriers in front of the command to
    /// `out`.
    ///
    /// `shape` must be the same in every call for one texture. `subresources` outside it are ignored.
    #[inline(always)]
    pub(crate) fn use_texture(
        &mut self,
        id: ResourceId,
        shape: TextureShape,
        subresources: Subresources,
        next: Use,
        out: &mut Barriers,
    ) {
        let next = with_some_layout(next);
        let cells = self.textures.entry(id, || PerSubresource::new(shape, LocalState::default()));
        match cells.uniform_mut(subresources).and_then(|local| local.repeated(next)) {
            Some(scopes) => out.push_memory(&scopes),
            None => use_subresources(id, cells, subresources, next, out),
        }
    }

    /// Discards the contents of a texture, in every subresource. The caller has recorded a barrier that makes `stages`
    /// wait for all earlier uses of the texture's memory.
    pub(crate) fn discard_texture(&mut self, id: ResourceId, shape: TextureShape, stages: Stages) {
        let state = LocalState::discarded_before(stages);
        let cells = self.textures.entry(id, || PerSubresource::new(shape, state));
        *cells = PerSubresource::new(shape, state);
    }

    /// Returns the accesses to a texture that a write to its memory has to wait for.
    pub(crate) fn unfinished_texture(&self, id: ResourceId) -> BarrierScope {
        let Some(cells) = self.textures.get(id) else { return BarrierScope::default() };
        positions(cells.shape())
            .map(|(mip, layer)| cells.at(mip, layer).state.unfinished())
            .fold(BarrierScope::default(), BarrierScope::union)
    }

    /// Makes the next uses of a buffer, or of bytes that are tracked as one, wait for `scope` too. The command buffer
    /// has written it before.
    pub(crate) fn extend_write(&mut self, id: ResourceId, scope: BarrierScope) {
        self.buffers.entry(id, LocalState::default).state.extend_write(scope);
    }

    /// True if [`use_buffer`](Self::use_buffer) would need a barrier, which cannot be recorded inside a
    /// render pass.
    pub(crate) fn needs_barrier_buffer(&self, id: ResourceId, next: Use) -> bool {
        let next = next.with_layout(Layout::Undefined);
        self.buffers.get(id).is_some_and(|local| would_wait(local, next))
    }

    /// True if [`use_texture`](Self::use_texture) would need a barrier, which cannot be recorded inside a
    /// render pass.
    pub(crate) fn needs_barrier_texture(
        &self,
        id: ResourceId,
        subresources: Subresources,
        next: Use,
    ) -> bool {
        let next = with_some_layout(next);
        self.textures.get(id).is_some_and(|cells| cells.any(subresources, |local| would_wait(local, next)))
    }

    /// Returns the stages of the first uses of a texture whose subresources are all used alike. `None` if it
    /// is not used.
    pub(crate) fn first_stages(&self, id: ResourceId) -> Option<Stages> {
        self.textures.get(id)?.uniform().map(|local| local.prefix.stages())
    }

    /// Returns the buffers in the order of their first use.
    pub(super) fn buffers(&self) -> &[(ResourceId, LocalState)] {
        &self.buffers.values
    }

    /// Returns the textures in the order of their first use.
    pub(super) fn textures(&self) -> &[(ResourceId, PerSubresource<LocalState>)] {
        &self.textures.values
    }
}

/// A resource that a command buffer uses, for synchronisation and ownership transfers between queues.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrackedUse<'a> {
    pub(crate) id: ResourceId,
    parts: TrackedUseKind<'a>,
}

#[derive(Debug, Clone, Copy)]
enum TrackedUseKind<'a> {
    Buffer(&'a LocalState),
    Texture(&'a PerSubresource<LocalState>),
}

impl Tracker {
    /// Returns all resources that the command buffer uses.
    pub(crate) fn tracked_uses(&self) -> impl Iterator<Item = TrackedUse<'_>> {
        let buffers = self
            .buffers
            .values
            .iter()
            .map(|(id, local)| TrackedUse { id: *id, parts: TrackedUseKind::Buffer(local) });
        let textures = self
            .textures
            .values
            .iter()
            .map(|(id, cells)| TrackedUse { id: *id, parts: TrackedUseKind::Texture(cells) });
        buffers.chain(textures)
    }

    /// True if the command buffer uses the resource.
    pub(crate) fn uses_resource(&self, id: ResourceId) -> bool {
        self.buffers.get(id).is_some() || self.textures.get(id).is_some()
    }
}

impl TrackedUse<'_> {
    /// True if the command buffer changes the contents, or the layouts `before` of a texture.
    pub(crate) fn changes(&self, before: Option<&PerSubresource<Layout>>) -> bool {
        match self.parts {
            TrackedUseKind::Buffer(local) => local.changes(Layout::Undefined),
            TrackedUseKind::Texture(cells) => {
                let layout = |mip, layer| before.map_or(Layout::Undefined, |cells| *cells.at(mip, layer));
                let alike =
                    cells.uniform().is_some() && before.is_none_or(|before| before.uniform().is_some());
                let shape = if alike { TextureShape { mips: 1, layers: 1 } } else { cells.shape() };
                positions(shape).any(|(mip, layer)| cells.at(mip, layer).changes(layout(mip, layer)))
            }
        }
    }

    /// Returns the state of the resource on another queue, which waits for a semaphore at `stages`. A texture
    /// is in the layouts `before`. Only resources whose first use changes the layout depend on the semaphore
    /// stages: all other uses start after the semaphore.
    pub(super) fn transferred_state(
        &self,
        before: Option<&PerSubresource<Layout>>,
        stages: Stages,
    ) -> TransferredState {
        let TrackedUseKind::Texture(cells) = self.parts else { return TransferredState::Buffer };
        let state = |mip, layer| {
            let layout = before.map_or(Layout::Undefined, |before| *before.at(mip, layer));
            match cells.at(mip, layer).prefix.layout() {
                Some(first) if first == layout => ResourceState::untouched_in(layout),
                _ => ResourceState::imported(layout, stages),
            }
        };
        TransferredState::Texture(PerSubresource::from_fn(cells.shape(), state))
    }
}

/// State of a resource at the start of its use by another queue.
pub(super) enum TransferredState {
    Buffer,
    Texture(PerSubresource<ResourceState>),
}

fn positions(shape: TextureShape) -> impl Iterator<Item = (u32, u32)> {
    (0..shape.layers).flat_map(move |layer| (0..shape.mips).map(move |mip| (mip, layer)))
}

/// Uses a part of a texture in a way that differs from the last use.
#[inline(never)]
fn use_subresources(
    id: ResourceId,
    cells: &mut PerSubresource<LocalState>,
    part: Subresources,
    next: Use,
    out: &mut Barriers,
) {
    match cells.uniform_mut(part) {
        Some(local) => local.apply(next).iter().for_each(|scopes| out.push_image(id, part, scopes)),
        None => cells
            .update(part, |local| local.apply(next))
            .iter()
            .for_each(|(part, scopes)| out.push_image(id, *part, scopes)),
    }
}

fn would_wait(local: &LocalState, next: Use) -> bool {
    let mut after = *local;
    after.apply(next).is_some()
}

/// Returns the use with a layout, because a texture always needs one. The general layout, which supports
/// every access, replaces none.
fn with_some_layout(next: Use) -> Use {
    if next.layout == Layout::Undefined { next.with_layout(Layout::General) } else { next }
}
