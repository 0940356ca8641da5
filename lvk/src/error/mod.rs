//! The error type of the library.

pub(crate) mod device_candidate;
pub(crate) mod device_fault;
pub(crate) mod device_loss;
mod driver_remedies;
pub(crate) mod driver_report;
mod driver_report_text;

use std::path::PathBuf;
use std::sync::Arc;

use ash::vk;

use crate::queue::Queue;
use device_candidate::DeviceCandidate;
use device_loss::DeviceLossReport;
use driver_report::DriverReport;
use driver_report_text::no_device_text;

/// Result of every fallible call of the library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Errors of the library, in three groups by remedy:
/// * mistakes of the caller: [`StaleHandle`](Error::StaleHandle), [`InvalidUsage`](Error::InvalidUsage),
///   [`WrongQueue`](Error::WrongQueue), [`Shader`](Error::Shader), [`PushConstants`](Error::PushConstants),
///   [`Serialized`](Error::Serialized), [`OverBudget`](Error::OverBudget),
///   [`UploadTooLarge`](Error::UploadTooLarge);
/// * missing support by the device or its driver: [`NoVulkan`](Error::NoVulkan),
///   [`NoDevice`](Error::NoDevice), [`Unsupported`](Error::Unsupported),
///   [`LimitExceeded`](Error::LimitExceeded);
/// * failures at run time: [`OutOfDeviceMemory`](Error::OutOfDeviceMemory),
///   [`OutOfHostMemory`](Error::OutOfHostMemory), [`File`](Error::File), [`DeviceLost`](Error::DeviceLost),
///   [`Vulkan`](Error::Vulkan).
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The Vulkan loader could not be opened, is older than Vulkan 1.3, or finds no driver or no device. The text ends
    /// with the remedies.
    #[error("no Vulkan device on this machine: {report}")]
    NoVulkan {
        /// The loader, the failed command, and each driver manifest with the error of the dynamic linker.
        report: Arc<DriverReport>,
    },
    /// Devices exist, but none has the features that the caller requires. The text ends with the remedies.
    #[error(
        "no Vulkan device has what was required: {}",
        no_device_text(problem.as_deref(), candidates, drivers.as_deref())
    )]
    NoDevice {
        /// The problem with the device that the caller requested by number or name.
        problem: Option<String>,
        /// Each device with the requirements that it does not meet.
        candidates: Vec<DeviceCandidate>,
        /// Loader and drivers; a driver that cannot be loaded explains the absence of a device. `None` for a device that
        /// the caller created.
        drivers: Option<Arc<DriverReport>>,
    },
    /// The device, its driver or a layer lacks a feature that a call needs.
    #[error("{what} is not supported: {why}")]
    Unsupported {
        /// The feature, extension, format or layer.
        what: String,
        /// The reason, and the remedy.
        why: String,
    },
    /// A size or count exceeds a limit of the device.
    #[error("{object}: {what} is {requested}, the device takes at most {limit}")]
    LimitExceeded {
        /// Debug name of the object.
        object: String,
        /// Name of the size or count.
        what: &'static str,
        /// The requested value.
        requested: u64,
        /// The device's limit.
        limit: u64,
    },
    /// The object of the handle was destroyed, or belongs to another context.
    #[error("stale {kind} handle: the object was destroyed or belongs to another context")]
    StaleHandle {
        /// Kind of the object.
        kind: &'static str,
    },
    /// A call has invalid arguments, or is invalid in the current state.
    #[error("{object}: {message}")]
    InvalidUsage {
        /// Debug name of the object or name of the call.
        object: String,
        /// The problem and the remedy.
        message: String,
    },
    /// The window of a swapchain is gone (`VK_ERROR_SURFACE_LOST_KHR`, also for another surface of the window).
    #[error(
        "{swapchain}: its window is gone; suspend the swapchain, and resume it in another window, or destroy it before its window"
    )]
    SurfaceLost {
        /// Debug name of the swapchain.
        swapchain: String,
    },
    /// The queue of a command buffer does not support a command.
    #[error("{command} cannot be recorded for the {} queue; acquire a command buffer on {remedy}", queue.label())]
    WrongQueue {
        /// The command.
        command: &'static str,
        /// The queue of the command buffer.
        queue: Queue,
        /// Queues that support the command.
        remedy: &'static str,
    },
    /// The pushed bytes do not fit the push-constant block of the bound pipeline.
    #[error(
        "pipeline '{pipeline}' declares {expected} bytes of push constants, but {offset} + {size} bytes were pushed; \
         make the Rust struct match the shader's block"
    )]
    PushConstants {
        /// Debug name of the pipeline.
        pipeline: String,
        /// Number of bytes that the shader declares.
        expected: u32,
        /// Offset of the push, in bytes.
        offset: u32,
        /// Number of bytes pushed.
        size: u32,
    },
    /// A shader did not compile, or its SPIR-V cannot be used.
    #[error("shader '{name}': {log}")]
    Shader {
        /// Debug name of the module.
        name: String,
        /// Output of the compiler, with the line numbers of the caller's source.
        log: String,
    },
    /// A file could not be written.
    #[error("file '{}': {message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The failed operation and the reason.
        message: String,
    },
    /// Serialised bytes of an acceleration structure cannot be used.
    #[error("{object}: {reason}; build it anew and serialise that")]
    Serialized {
        /// Debug name of the acceleration structure to be created.
        object: String,
        /// The problem: damaged bytes, bytes of another mesh, or of another device or driver.
        reason: String,
    },
    /// An acceleration structure exceeds the budget of the context.
    #[error(
        "'{object}' needs {bytes} bytes, but acceleration structures have {used} of their budget of {budget} in use; \
         destroy or compact some, or raise ContextDesc::accel_budget_bytes"
    )]
    OverBudget {
        /// Debug name of the acceleration structure.
        object: String,
        /// Required bytes.
        bytes: u64,
        /// Bytes of all live acceleration structures, including those that wait for the GPU before they are
        /// freed.
        used: u64,
        /// The budget, [`ContextDesc::accel_budget_bytes`](crate::ContextDesc), in bytes.
        budget: u64,
    },
    /// A value is larger than the memory that the context keeps for uploads.
    #[error(
        "an upload of {bytes} bytes is larger than ContextDesc::staging_bytes ({limit} bytes); raise it, or write the \
         data to a buffer"
    )]
    UploadTooLarge {
        /// Bytes of the value or slice.
        bytes: u64,
        /// Most bytes of one upload, [`ContextDesc::staging_bytes`](crate::ContextDesc).
        limit: u64,
    },
    /// Device memory is exhausted.
    #[error("out of device memory while creating '{object}' ({bytes} bytes)")]
    OutOfDeviceMemory {
        /// Debug name of the object.
        object: String,
        /// Requested bytes.
        bytes: u64,
    },
    /// Host memory is exhausted.
    #[error("out of host memory in {call}")]
    OutOfHostMemory {
        /// The Vulkan command that failed.
        call: &'static str,
    },
    /// The device is lost, and the context cannot be used any more.
    #[error("{report}; create a new context")]
    DeviceLost {
        /// The command that reported the loss, the fault, and what the queues were doing. Every later error of the
        /// context's submissions and waits has the report of the first.
        report: Arc<DeviceLossReport>,
    },
    /// Any other error of the driver.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// The Vulkan command that failed.
        call: &'static str,
        /// The returned error.
        #[source]
        result: vk::Result,
    },
}

impl Error {
    /// Converts the result of `call` to an error.
    pub(crate) fn vulkan(call: &'static str) -> impl FnOnce(vk::Result) -> Self {
        move |result| match result {
            vk::Result::ERROR_DEVICE_LOST => Self::device_lost(call),
            vk::Result::ERROR_OUT_OF_HOST_MEMORY => Self::OutOfHostMemory { call },
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
                Self::OutOfDeviceMemory { object: call.to_owned(), bytes: 0 }
            }
            result => Self::Vulkan { call, result },
        }
    }

    /// Returns the error for the loss of the device in `call`, of which no more is known yet.
    pub(crate) fn device_lost(call: &'static str) -> Self {
        Self::DeviceLost { report: Arc::new(DeviceLossReport { call, ..DeviceLossReport::default() }) }
    }

    /// Returns the error for a mistake of the caller about `object`.
    pub(crate) fn usage(object: impl Into<String>, message: impl Into<String>) -> Self {
        Self::InvalidUsage { object: object.into(), message: message.into() }
    }

    /// Returns the error for a feature that the device lacks.
    pub(crate) fn unsupported(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Unsupported { what: what.into(), why: why.into() }
    }
}

/// Returns [`Error::LimitExceeded`] if `requested` exceeds `limit`.
pub(crate) fn check_limit(object: &str, what: &'static str, requested: u64, limit: u64) -> Result<()> {
    if requested <= limit {
        return Ok(());
    }
    Err(Error::LimitExceeded { object: object.to_owned(), what, requested, limit })
}
