//! The public facade: a context creates objects, transfers data, and acquires and submits command buffers.

pub(crate) mod accel_info;
mod compact;
pub(crate) mod config;
mod create;
pub(crate) mod create_accel;
mod create_in_background;
mod create_micromap;
mod create_pipelines;
mod create_ray_tracing;
mod create_texture;
mod default_descriptors;
pub(crate) mod destroy;
#[cfg(unix)]
mod external_memory;
#[cfg(unix)]
pub(crate) mod external_semaphore;
mod format_queries;
pub(crate) mod frame;
mod from_raw;
pub(crate) mod holder;
pub(crate) mod import;
mod index_faults;
mod interop;
mod live_objects;
mod new;
pub(crate) mod pending_pipeline;
pub(crate) mod plan_blas;
mod profiling;
mod prologue;
mod query_results;
mod queue_labels;
pub(crate) mod read_bounds;
pub(crate) mod readback;
mod requirements;
pub(crate) mod serialize;
mod submit;
mod transfer;
pub(crate) mod transient_heap;
#[cfg(feature = "window")]
mod window;

use std::sync::Arc;

use crate::accel::compaction::Compactions;
use crate::background::BackgroundJobs;
use crate::command::RecordingStatePool;
use crate::device_state::SharedDeviceState;
use crate::gpu::caps::capabilities::Capabilities;
use crate::gpu::debug::messenger::ValidationSink;
use crate::gpu::memory::budget::MemoryBudget;
use crate::lock_order::Mutex;

use frame::FrameRing;
use prologue::Prologue;

/// A Vulkan device with all objects created on it.
///
/// Cloning is cheap and returns the same context. All methods take `&self` and may be called from any thread. The
/// device is destroyed when the last clone, holder and command buffer are dropped. Objects that are still alive then
/// are reported to the `log` crate by name.
#[derive(Clone)]
pub struct Context {
    inner: Arc<ContextInner>,
}

struct ContextInner {
    /// Pipelines that are compiled in the background. Dropped first, since its jobs use the device.
    background: BackgroundJobs,
    /// Uploads and builds that run before the next submission.
    prologue: Mutex<Prologue>,
    frames: Mutex<FrameRing>,
    recording_states: RecordingStatePool,
    /// Pending compactions.
    compactions: Mutex<Compactions>,
    /// Default window for swapchains without a window of their own.
    #[cfg(feature = "window")]
    window: Option<Arc<dyn crate::gpu::start::window::WindowHandles>>,
    shared: Arc<SharedDeviceState>,
}

impl Context {
    /// Returns the capabilities of the device.
    pub fn capabilities(&self) -> &Capabilities {
        &self.device_state().gpu.caps
    }

    /// Returns the size, the budget and the use of each memory heap (`vkGetPhysicalDeviceMemoryProperties2`, with
    /// `VK_EXT_memory_budget` where the device has it).
    pub fn memory_budget(&self) -> MemoryBudget {
        self.device_state().gpu.memory_budget()
    }

    /// Returns the messages of the validation layer so far. On an engine's device, they arrive only if
    /// [`ContextDesc::validation`](super::ContextDesc::validation) asked for them.
    pub fn validation(&self) -> &ValidationSink {
        self.device_state().gpu.instance.sink()
    }

    pub(crate) fn device_state(&self) -> &Arc<SharedDeviceState> {
        &self.inner.shared
    }
}

impl std::fmt::Debug for Context {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Context").field("device", &self.capabilities().device_name).finish_non_exhaustive()
    }
}
