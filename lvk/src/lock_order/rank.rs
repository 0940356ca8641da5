//! The order of all locks of the library.

/// Rank of a lock. The ranks down to [`PipelineCacheFile`](Self::PipelineCacheFile) are ordered: while a lock of one of
/// them is held, locks of later ranks may be taken. The ranks from [`Frames`](Self::Frames) to
/// [`DeviceLifetime`](Self::DeviceLifetime) are leaves. While a leaf is held, no lock
/// may be taken except [`LoaderLists`](Self::LoaderLists), for which a call to Vulkan is enough, and
/// [`ValidationMessages`](Self::ValidationMessages), which any Vulkan call may take.
///
/// No lock may be taken again by its holder, nor together with another lock of the same rank, not even for
/// reading twice. A waiting writer would block the second read, while the first read blocks the writer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Rank {
    /// A swapchain. It is taken first, because presenting submits.
    #[cfg_attr(not(feature = "window"), allow(dead_code, reason = "only windows have swapchains"))]
    Swapchain,
    /// Compactions in progress. They record copies that run before the next submission.
    Compactions,
    /// Work that runs before the next submission.
    Pending,
    /// BLAS references of a TLAS. The referenced BLAS determine if these are outdated.
    TlasContents,
    /// The scratch buffer of builds, which may be recreated.
    Scratch,
    /// Resource states, command buffers and deferred objects of submissions.
    Submitter,
    /// The bindless set, which is written right before a submission.
    Bindless,
    /// Memory shared by acceleration structures, which are created and destroyed under any lock above.
    AccelBlocks,
    /// The file of a pipeline cache, which is written under the lock.
    PipelineCacheFile,
    /// Frames in flight. The first leaf.
    Frames,
    /// Mapped buffers that are not in use.
    SpareBuffers,
    /// Allocated ranges of staging memory.
    Staging,
    /// The objects of one kind, by handle.
    Store,
    /// State of a BLAS that builds and compaction change.
    BlasState,
    /// Number of builds that the queried compaction sizes belong to.
    SizeQuery,
    /// Inputs gathered for a part of a mesh.
    GatheredInputs,
    /// Descriptor slots of destroyed TLAS.
    FreedTlas,
    /// The views of a texture.
    Views,
    /// Written queries of a query pool.
    QueryResetState,
    /// The bytes of a mapped buffer.
    BufferBytes,
    /// A pipeline of the library, which is created under the lock.
    Kernels,
    /// The folder of compiled shaders.
    ShaderCacheFolder,
    /// Temporary files that are being written.
    TemporaryFiles,
    /// Times of the files that shaders were read from.
    #[cfg_attr(not(feature = "glsl"), allow(dead_code, reason = "only GLSL is read from files"))]
    ShaderFiles,
    /// Measurements of the profiler.
    Profiler,
    /// Unused recording states of command buffers.
    RecordingStates,
    /// Cached image limits of the device.
    ImageLimitCache,
    /// Owners of the bindless slots, where indices are checked.
    SlotOwners,
    /// Work shared between threads.
    SharedWork,
    /// Jobs that wait for a thread of the background.
    BackgroundJobs,
    /// The result of a pipeline that is compiled in the background.
    PendingPipeline,
    /// Parts that graphics pipelines are linked from.
    GraphicsParts,
    /// A queue of the device.
    Queue,
    /// Device memory.
    Memory,
    /// Creation and destruction of devices and ray tracing pipelines, on a driver that deadlocks if they are
    /// concurrent.
    DeviceLifetime,
    /// The loader's lists of instances and devices, which are searched where an object gets its name, under any other
    /// lock.
    LoaderLists,
    /// Messages of the validation layer, which arrive during Vulkan calls, under any other lock.
    ValidationMessages,
}

#[cfg(debug_assertions)]
impl Rank {
    /// All ranks, in their order.
    pub(super) const ALL: [Self; 37] = [
        Self::Swapchain,
        Self::Compactions,
        Self::Pending,
        Self::TlasContents,
        Self::Scratch,
        Self::Submitter,
        Self::Bindless,
        Self::AccelBlocks,
        Self::PipelineCacheFile,
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
        Self::ShaderCacheFolder,
        Self::TemporaryFiles,
        Self::ShaderFiles,
        Self::Profiler,
        Self::RecordingStates,
        Self::ImageLimitCache,
        Self::SlotOwners,
        Self::SharedWork,
        Self::BackgroundJobs,
        Self::PendingPipeline,
        Self::GraphicsParts,
        Self::Queue,
        Self::Memory,
        Self::DeviceLifetime,
        Self::LoaderLists,
        Self::ValidationMessages,
    ];

    const FIRST_LEAF: u8 = Self::Frames as u8;
    const LAST_LEAF: u8 = Self::DeviceLifetime as u8;
    const LAST: u8 = Self::ValidationMessages as u8;

    /// Returns the lowest rank whose lock must not be held when this one is taken. For leaves this is the
    /// first leaf.
    pub(super) const fn first_in_the_way(self) -> u8 {
        let own = self as u8;
        if own < Self::FIRST_LEAF || own > Self::LAST_LEAF { own } else { Self::FIRST_LEAF }
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
