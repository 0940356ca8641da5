//! The one error type of the library.

pub(crate) mod device_fault;

use std::path::PathBuf;
use std::sync::Arc;

use ash::vk;

use crate::queue::Queue;
use device_fault::DeviceFault;

/// Result of every fallible call of the library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What went wrong, separated by who can mend it.
///
/// * the caller: [`StaleHandle`](Error::StaleHandle), [`InvalidUsage`](Error::InvalidUsage),
///   [`WrongQueue`](Error::WrongQueue),
///   [`Shader`](Error::Shader), [`PushConstants`](Error::PushConstants), [`Serialized`](Error::Serialized),
///   [`OverBudget`](Error::OverBudget);
/// * the device or its driver lacks something: [`NoVulkan`](Error::NoVulkan), [`NoDevice`](Error::NoDevice),
///   [`Unsupported`](Error::Unsupported), [`LimitExceeded`](Error::LimitExceeded);
/// * bad luck: [`OutOfDeviceMemory`](Error::OutOfDeviceMemory), [`OutOfHostMemory`](Error::OutOfHostMemory),
///   [`File`](Error::File), [`DeviceLost`](Error::DeviceLost), [`Vulkan`](Error::Vulkan).
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The Vulkan loader could not be opened or has no usable instance.
    #[error("no Vulkan on this machine: {reason}; install a Vulkan driver and its loader (libvulkan.so.1)")]
    NoVulkan {
        /// What the loader answered.
        reason: String,
    },
    /// Devices exist, but none has what the caller requires.
    #[error("no Vulkan device has what was required: {reasons}")]
    NoDevice {
        /// What was wrong with the wish, if anything, then each device with what it lacks, separated by `; `.
        reasons: String,
    },
    /// The device, its driver or a layer lacks what a call needs.
    #[error("{what} is not supported: {why}")]
    Unsupported {
        /// The feature, extension, format or layer.
        what: String,
        /// Why it is missing, and what to do instead.
        why: String,
    },
    /// A size or count is over a limit of the device.
    #[error("{object}: {what} is {requested}, the device takes at most {limit}")]
    LimitExceeded {
        /// Debug name of the object.
        object: String,
        /// Which size or count.
        what: &'static str,
        /// What was asked for.
        requested: u64,
        /// What the device allows.
        limit: u64,
    },
    /// The handle's object was destroyed, or belongs to another context.
    #[error("stale {kind} handle: the object was destroyed or belongs to another context")]
    StaleHandle {
        /// Which kind of object the handle names.
        kind: &'static str,
    },
    /// A call was made with arguments or in a state that cannot work.
    #[error("{object}: {message}")]
    InvalidUsage {
        /// Debug name of the object or name of the call.
        object: String,
        /// What is wrong and what to do.
        message: String,
    },
    /// The queue of a command buffer does not take a command.
    #[error("{command} cannot be recorded for the {} queue; acquire a command buffer on {remedy}", queue.label())]
    WrongQueue {
        /// The command.
        command: &'static str,
        /// The queue of the command buffer.
        queue: Queue,
        /// Which queues take it.
        remedy: &'static str,
    },
    /// The bytes pushed do not fit the push-constant block of the bound pipeline.
    #[error(
        "pipeline '{pipeline}' declares {expected} bytes of push constants, but {offset} + {size} bytes were pushed; \
         make the Rust struct match the shader's block"
    )]
    PushConstants {
        /// Debug name of the pipeline.
        pipeline: String,
        /// Bytes the shader declares.
        expected: u32,
        /// Offset of the push, in bytes.
        offset: u32,
        /// Bytes pushed.
        size: u32,
    },
    /// A shader did not compile, or its SPIR-V cannot be used.
    #[error("shader '{name}': {log}")]
    Shader {
        /// Debug name of the module.
        name: String,
        /// The compiler's text, with the line numbers of the caller's own source.
        log: String,
    },
    /// A file could not be written.
    #[error("file '{}': {message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What failed and why.
        message: String,
    },
    /// Serialised bytes of an acceleration structure cannot be used.
    #[error("{object}: {reason}; build it anew and serialise that")]
    Serialized {
        /// Debug name of the structure that was to be.
        object: String,
        /// Whether they are damaged, of another mesh, or of another device or driver.
        reason: String,
    },
    /// An acceleration structure does not fit the budget of the context.
    #[error(
        "'{object}' needs {bytes} bytes, but acceleration structures have {used} of their budget of {budget} in use; \
         destroy or compact some, or raise ContextDesc::accel_budget_bytes"
    )]
    OverBudget {
        /// Debug name of the structure.
        object: String,
        /// Bytes it needs.
        bytes: u64,
        /// Bytes of all structures alive, those included that wait for the GPU to be done with them.
        used: u64,
        /// [`ContextDesc::accel_budget_bytes`](crate::ContextDesc).
        budget: u64,
    },
    /// Device memory is exhausted.
    #[error("out of device memory while creating '{object}' ({bytes} bytes)")]
    OutOfDeviceMemory {
        /// Debug name of the object.
        object: String,
        /// Bytes asked for.
        bytes: u64,
    },
    /// Host memory is exhausted.
    #[error("out of host memory in {call}")]
    OutOfHostMemory {
        /// The Vulkan command that failed.
        call: &'static str,
    },
    /// The device was lost; the context cannot be used any more.
    #[error("the device was lost in {call}{}; create a new context", fault_suffix(fault))]
    DeviceLost {
        /// The Vulkan command that reported the loss.
        call: &'static str,
        /// What the driver says of the fault, where it can and the loss was noticed by submitting or waiting.
        fault: Option<Arc<DeviceFault>>,
    },
    /// Any other answer of the driver.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// The Vulkan command that failed.
        call: &'static str,
        /// What it returned.
        #[source]
        result: vk::Result,
    },
}

impl Error {
    /// Wraps the driver's answer to `call`.
    pub(crate) fn vulkan(call: &'static str) -> impl FnOnce(vk::Result) -> Self {
        move |result| match result {
            vk::Result::ERROR_DEVICE_LOST => Self::DeviceLost { call, fault: None },
            vk::Result::ERROR_OUT_OF_HOST_MEMORY => Self::OutOfHostMemory { call },
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
                Self::OutOfDeviceMemory { object: call.to_owned(), bytes: 0 }
            }
            result => Self::Vulkan { call, result },
        }
    }

    /// A mistake of the caller about `object`.
    pub(crate) fn usage(object: impl Into<String>, message: impl Into<String>) -> Self {
        Self::InvalidUsage { object: object.into(), message: message.into() }
    }

    /// A feature the device lacks.
    pub(crate) fn unsupported(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Unsupported { what: what.into(), why: why.into() }
    }
}

fn fault_suffix(fault: &Option<Arc<DeviceFault>>) -> String {
    fault.as_ref().map(|fault| format!(" ({fault})")).unwrap_or_default()
}

/// Fails with [`Error::LimitExceeded`] if `requested` is over `limit`.
pub(crate) fn check_limit(object: &str, what: &'static str, requested: u64, limit: u64) -> Result<()> {
    if requested <= limit {
        return Ok(());
    }
    Err(Error::LimitExceeded { object: object.to_owned(), what, requested, limit })
}
