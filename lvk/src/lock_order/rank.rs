//! The order of all locks of the library.

/// Which lock. Those down to [`AccelBlocks`](Self::AccelBlocks) have an order: while one is held, those further down may be
/// taken. All others are leaves: under a leaf nothing is taken but [`ValidationMessages`](Self::ValidationMessages), which
/// any call of Vulkan may take.
///
/// No lock is taken under itself or under another one of its rank, not even to read twice: a thread that waits to write
/// would keep the second reader out, and that one would keep the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Rank {
    /// A swapchain: taken first, as presenting submits.
    Swapchain,
    /// Compactions under way: they record copies that run before the next submission.
    Compactions,
    /// What runs before the next submission.
    Pending,
    /// What a top-level structure shows: whether that is outdated is known by the structures it refers to.
    TlasContents,
    /// The scratch buffer of builds, which may be made anew.
    Scratch,
    /// States, command buffers and garbage of what is submitted.
    Submitter,
    /// The bindless set, written right before a submission.
    Bindless,
    /// Memory that acceleration structures share: structures come and go under any lock above.
    AccelBlocks,
    /// Frames in flight. The first leaf.
    Frames,
    /// Mapped buffers that nobody uses.
    SpareBuffers,
    /// Which bytes of staging memory are taken.
    Staging,
    /// The objects of one kind, by handle.
    Store,
    /// What changes in a bottom-level structure with builds and compaction.
    BlasState,
    /// How many builds the sizes of a compaction are of.
    SizeQuery,
    /// Inputs gathered for a part of a mesh.
    GatheredInputs,
    /// Slots of top-level structures that are gone.
    FreedTlas,
    /// The views of a texture.
    Views,
    /// Which queries of a pool are written.
    QueryResetState,
    /// The bytes of a mapped buffer.
    BufferBytes,
    /// A pipeline of the library's own, which is made under the lock.
    Kernels,
    /// The file of a pipeline cache.
    PipelineCacheFile,
    /// The folder of compiled shaders.
    ShaderCacheFolder,
    /// What was measured.
    Profiler,
    /// Notes that no command buffer has.
    SpareNotes,
    /// What the device allows for images.
    ImageLimitCache,
    /// Who has which bindless slot, where indices are checked.
    SlotOwners,
    /// Work that threads share.
    SharedWork,
    /// A queue of the device.
    Queue,
    /// Device memory.
    Memory,
    /// Devices that come and go, beside ray tracing pipelines that do: of a driver that locks up over them.
    DeviceLifetime,
    /// Messages of the validation layer, which come while Vulkan is called: under any other lock.
    ValidationMessages,
}

#[cfg(debug_assertions)]
impl Rank {
    /// All of them, in their order.
    pub(super) const ALL: [Self; 31] = [
        Self::Swapchain,
        Self::Compactions,
        Self::Pending,
        Self::TlasContents,
        Self::Scratch,
        Self::Submitter,
        Self::Bindless,
        Self::AccelBlocks,
        Self::Frames,
        Self::SpareBuffers,
        Self::Staging,
        Self::Store,
        Self::BlasState,
        Self::SizeQuery,
        Self::GatheredInputs,
        Self::FreedTlas,
        Self::Views,
        Self::QueryResetState,
        Self::BufferBytes,
        Self::Kernels,
        Self::PipelineCacheFile,
        Self::ShaderCacheFolder,
        Self::Profiler,
        Self::SpareNotes,
        Self::ImageLimitCache,
        Self::SlotOwners,
        Self::SharedWork,
        Self::Queue,
        Self::Memory,
        Self::DeviceLifetime,
        Self::ValidationMessages,
    ];

    const FIRST_LEAF: u8 = Self::Frames as u8;
    const LAST: u8 = Self::ValidationMessages as u8;

    /// The first of those that keep this one from being taken: of leaves all.
    pub(super) const fn first_in_the_way(self) -> u8 {
        let own = self as u8;
        if own < Self::FIRST_LEAF || own == Self::LAST { own } else { Self::FIRST_LEAF }
    }
}

#[cfg(debug_assertions)]
const _: () = {
    let mut place = 0;
    while place < Rank::ALL.len() {
        assert!(Rank::ALL[place] as usize == place, "each rank is listed once, in its order");
        place += 1;
    }
    assert!(place == Rank::LAST as usize + 1, "none is missing");
};
