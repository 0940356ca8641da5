//! The error type of the library.

pub(crate) mod causes;
pub(crate) mod device_candidate;
pub(crate) mod device_fault;
pub(crate) mod device_loss;
mod driver_remedies;
pub(crate) mod driver_report;
mod driver_report_text;
pub(crate) mod layout_difference;
pub(crate) mod limit_origin;
mod platform_remedies;
pub(crate) mod readable;

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use ash::vk;

use crate::queue::Queue;
use device_candidate::DeviceCandidate;
use device_loss::DeviceLossReport;
use driver_report::DriverReport;
use driver_report_text::no_device_text;
use layout_difference::{LayoutDifference, differences_text};
use limit_origin::LimitOrigin;
use readable::{readable_line, readable_name, readable_text};

/// Result of every fallible call of the library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Errors of the library, in three groups by remedy:
/// * mistakes of the caller: [`StaleHandle`](Error::StaleHandle), [`ForeignHandle`](Error::ForeignHandle),
///   [`InvalidUsage`](Error::InvalidUsage),
///   [`WrongQueue`](Error::WrongQueue), [`Shader`](Error::Shader), [`PushConstants`](Error::PushConstants),
///   [`LayoutMismatch`](Error::LayoutMismatch), [`ShaderRecord`](Error::ShaderRecord),
///   [`Serialized`](Error::Serialized), [`OverBudget`](Error::OverBudget),
///   [`UploadTooLarge`](Error::UploadTooLarge);
/// * missing support by the device or its driver: [`NoVulkan`](Error::NoVulkan),
///   [`NoDevice`](Error::NoDevice), [`Unsupported`](Error::Unsupported),
///   [`Lowering`](Error::Lowering), [`LimitExceeded`](Error::LimitExceeded);
/// * failures at run time: [`OutOfDeviceMemory`](Error::OutOfDeviceMemory),
///   [`OutOfHostMemory`](Error::OutOfHostMemory), [`File`](Error::File), [`DeviceLost`](Error::DeviceLost),
///   [`Vulkan`](Error::Vulkan). Those of a Vulkan call name the call and its object.
///
/// [`Creation`](Error::Creation) adds to a [`StaleHandle`](Error::StaleHandle) the name of what was to be created.
///
/// The texts show names of objects and files without control characters, and long ones shortened; the fields have them
/// as they are. `Debug` has the text of `Display`, as programs whose `main` returns an error print it by `Debug`.
#[derive(Clone, thiserror::Error)]
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
        readable_line(&no_device_text(problem.as_deref(), candidates, drivers.as_deref()))
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
    #[error("not supported: {}: {}", readable_line(what), readable_line(why))]
    Unsupported {
        /// The feature, extension, format or layer.
        what: String,
        /// The reason, and the remedy.
        why: String,
    },
    /// A size or count exceeds a limit.
    #[error("{}: {what} is {requested}, {}", readable_name(object), origin.clause(*limit))]
    LimitExceeded {
        /// Debug name of the object.
        object: String,
        /// Name of the size or count.
        what: &'static str,
        /// The requested value.
        requested: u64,
        /// The limit.
        limit: u64,
        /// The party that sets the limit.
        origin: LimitOrigin,
    },
    /// The object of the handle was destroyed.
    #[error(
        "stale {kind} handle: {} was destroyed; keep its holder while the handle is in use",
        stale_object(kind, name)
    )]
    StaleHandle {
        /// Kind of the object.
        kind: &'static str,
        /// Debug name of the object, at most 64 bytes of it. `None` if it is not kept any more, as 64 other objects of
        /// this kind were destroyed since.
        name: Option<String>,
    },
    /// The object of the handle belongs to another context.
    #[error(
        "foreign {kind} handle: the object belongs to another context; use the handle with the context that made it"
    )]
    ForeignHandle {
        /// Kind of the object.
        kind: &'static str,
    },
    /// A call has invalid arguments, or is invalid in the current state.
    #[error("{}: {}", readable_name(object), readable_line(message))]
    InvalidUsage {
        /// Debug name of the object or name of the call.
        object: String,
        /// The problem and the remedy.
        message: String,
    },
    /// The window of a swapchain is gone: its surface is lost (`VK_ERROR_SURFACE_LOST_KHR`), and another surface too, or the window takes
    /// no other. Another call for an image tries again.
    #[error(
        "swapchain '{}': its window is gone ({source}); suspend the swapchain, and resume it in another window, or destroy it before its window",
        readable_name(swapchain)
    )]
    SurfaceLost {
        /// Debug name of the swapchain.
        swapchain: String,
        /// The error of the call that found the surface lost, or of the creation of another surface. Drivers answer with a shortage of memory
        /// for a window that is gone too (Mesa 25.0 for one that is closed), so this error does not tell a shortage from that.
        source: Box<Error>,
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
        "pipeline '{}' declares {expected} bytes of push constants, but {offset} + {size} bytes were pushed; make the Rust \
         struct match the shader's block",
        readable_name(pipeline)
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
    /// A Rust struct and the block of a shader that reads its bytes have different members.
    #[error(
        "pipeline '{}': the struct {struct_name} differs from the {} of shader '{}': {}",
        readable_name(pipeline),
        readable_name(block),
        readable_name(shader),
        readable_line(&differences_text(differences))
    )]
    LayoutMismatch {
        /// Debug name of the pipeline or library.
        pipeline: String,
        /// Debug name of the shader module.
        shader: String,
        /// Kind and name of the block.
        block: String,
        /// Name of the Rust struct.
        struct_name: &'static str,
        /// The differences, at least one.
        differences: Vec<LayoutDifference>,
    },
    /// A shader reads more bytes of its record than the record has.
    #[error(
        "pipeline '{}': the record of {} has {size} bytes, but shader '{}' reads {expected} bytes; make the Rust \
         struct match the shader's block",
        readable_name(pipeline),
        readable_name(group),
        readable_name(shader)
    )]
    ShaderRecord {
        /// Debug name of the pipeline or library.
        pipeline: String,
        /// The shader or hit group that has the record: its kind, and its number in the list of the description.
        group: String,
        /// Debug name of the shader module.
        shader: String,
        /// Number of bytes that the shader declares.
        expected: u64,
        /// Number of bytes of the record.
        size: u64,
    },
    /// A shader did not compile, or its SPIR-V cannot be used.
    #[error("shader '{}': {}", readable_name(name), readable_text(log))]
    Shader {
        /// Debug name of the module.
        name: String,
        /// Output of the compiler, with the line numbers of the caller's source.
        log: String,
    },
    /// A shader of a ray tracing pipeline cannot be lowered to a compute shader.
    #[error(
        "pipeline '{}': shader '{}' cannot be lowered to a compute shader: {}; change the shader, or use a device with \
         ray tracing pipelines of its own",
        readable_name(pipeline),
        readable_name(shader),
        readable_line(why)
    )]
    Lowering {
        /// Debug name of the pipeline.
        pipeline: String,
        /// Debug name of the shader module.
        shader: String,
        /// The instruction, and the reason why it cannot be lowered.
        why: String,
    },
    /// A file could not be read or written.
    #[error("file '{}': {}", readable_name(path), readable_line(message))]
    File {
        /// The file.
        path: PathBuf,
        /// The failed operation and the reason.
        message: String,
    },
    /// Serialised bytes of an acceleration structure cannot be used.
    #[error("{}: {}; build it anew and serialise that", readable_name(object), readable_line(reason))]
    Serialized {
        /// Debug name of the acceleration structure to be created.
        object: String,
        /// The problem: damaged bytes, bytes of another mesh, or of another device or driver.
        reason: String,
    },
    /// An acceleration structure exceeds the budget of the context.
    #[error(
        "'{}' needs {bytes} bytes, but acceleration structures have {used} of their budget of {budget} in use; destroy or \
         compact some, or raise ContextDesc::accel_budget_bytes",
        readable_name(object)
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
    #[error("out of device memory in {call} for '{}'{}", readable_name(object), memory_request(*bytes))]
    OutOfDeviceMemory {
        /// The Vulkan command that failed.
        call: &'static str,
        /// Debug name of the object of the call.
        object: String,
        /// Requested bytes, if the command allocates memory.
        bytes: Option<u64>,
    },
    /// Host memory is exhausted.
    #[error("out of host memory in {call} for '{}'", readable_name(object))]
    OutOfHostMemory {
        /// The Vulkan command that failed, or the call of the library that lacks memory for its result.
        call: &'static str,
        /// Debug name of the object of the call.
        object: String,
    },
    /// The device is lost, and the context cannot be used any more.
    #[error("{report}; create a new context")]
    DeviceLost {
        /// The command that reported the loss, the fault, and what the queues were doing. Every later error of the
        /// context's submissions and waits has the report of the first.
        report: Arc<DeviceLossReport>,
    },
    /// The creation of an object failed because of a stale handle, whose error names another object.
    #[error("{}: {source}", readable_name(object))]
    Creation {
        /// Debug name of the object.
        object: String,
        /// The error.
        source: Box<Self>,
    },
    /// Any other error of the driver.
    #[error("{call} failed for '{}': {result}", readable_name(object))]
    Vulkan {
        /// The Vulkan command that failed.
        call: &'static str,
        /// Debug name of the object of the call.
        object: String,
        /// The returned error.
        #[source]
        result: vk::Result,
    },
}

impl Error {
    /// Converts the result of `call` to an error that names `object`: the object that the call creates, records, waits for
    /// or asks.
    pub(crate) fn vulkan(call: &'static str, object: impl fmt::Display) -> impl FnOnce(vk::Result) -> Self {
        move |result| {
            let object = object.to_string();
            match result {
                vk::Result::ERROR_DEVICE_LOST => Self::device_lost(call, object),
                vk::Result::ERROR_OUT_OF_HOST_MEMORY => Self::OutOfHostMemory { call, object },
                vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
                    Self::OutOfDeviceMemory { call, object, bytes: None }
                }
                result => Self::Vulkan { call, object, result },
            }
        }
    }

    /// Converts the result of `vkAllocateMemory` for `object` to an error.
    pub(crate) fn allocating(object: &str, bytes: u64) -> impl FnOnce(vk::Result) -> Self {
        move |result| match Self::vulkan("vkAllocateMemory", object)(result) {
            Self::OutOfDeviceMemory { call, object, .. } => {
                Self::OutOfDeviceMemory { call, object, bytes: Some(bytes) }
            }
            other => other,
        }
    }

    /// True if the host or the device has no memory left for a call.
    pub(crate) fn lacks_memory(&self) -> bool {
        matches!(self, Self::OutOfHostMemory { .. } | Self::OutOfDeviceMemory { .. })
    }

    /// Returns the error for the loss of the device in `call` about `object`, of which no more is known yet.
    pub(crate) fn device_lost(call: &'static str, object: impl Into<String>) -> Self {
        let report = DeviceLossReport { call, object: object.into(), ..DeviceLossReport::default() };
        Self::DeviceLost { report: Arc::new(report) }
    }

    /// Adds the name of the object whose creation failed because of a stale handle. Other errors have a name of their own.
    pub(crate) fn with_object(self, object: &str) -> Self {
        match self {
            Self::StaleHandle { .. } => Self::Creation { object: object.to_owned(), source: Box::new(self) },
            named => named,
        }
    }

    /// Adds the name of the object that `part`, a buffer of the library, serves. Errors about other objects stay as they
    /// are.
    pub(crate) fn with_owner(mut self, part: &str, owner: &str) -> Self {
        if let Self::OutOfDeviceMemory { object, .. }
        | Self::OutOfHostMemory { object, .. }
        | Self::Vulkan { object, .. } = &mut self
            && object == part
        {
            *object = format!("{part} of {owner}");
        }
        self
    }

    /// Returns the error for a mistake of the caller about `object`.
    pub(crate) fn usage(object: impl Into<String>, message: impl Into<String>) -> Self {
        Self::InvalidUsage { object: object.into(), message: message.into() }
    }

    /// Returns the error for a range of `what` that ends before it begins.
    #[cold]
    pub(crate) fn reversed_range<T: fmt::Display>(object: &str, what: &str, range: &Range<T>) -> Self {
        let Range { start, end } = range;
        Self::usage(object, format!("the range {start}..{end} of {what} ends before it begins"))
    }

    /// Returns the error for a feature that the device lacks.
    pub(crate) fn unsupported(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Unsupported { what: what.into(), why: why.into() }
    }
}

impl fmt::Debug for Error {
    /// Formats the error like `Display`.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, out)
    }
}

fn memory_request(bytes: Option<u64>) -> String {
    bytes.map(|bytes| format!(" ({bytes} bytes)")).unwrap_or_default()
}

/// Names an object that was destroyed: its name, or its kind where the name is not kept.
pub(crate) fn stale_object(kind: &str, name: &Option<String>) -> String {
    match name {
        Some(name) => format!("'{}'", readable_name(name)),
        None => format!("the {kind}"),
    }
}

/// Returns [`Error::LimitExceeded`] if `requested` exceeds the device's `limit`.
pub(crate) fn check_limit(object: &str, what: &'static str, requested: u64, limit: u64) -> Result<()> {
    check_limit_of(LimitOrigin::Device, object, what, requested, limit)
}

/// As [`check_limit`], for a limit that `origin` sets.
pub(crate) fn check_limit_of(
    origin: LimitOrigin,
    object: &str,
    what: &'static str,
    requested: u64,
    limit: u64,
) -> Result<()> {
    if requested <= limit {
        return Ok(());
    }
    Err(Error::LimitExceeded { object: object.to_owned(), what, requested, limit, origin })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exceeded(origin: LimitOrigin, what: &'static str) -> String {
        check_limit_of(origin, "scene", what, 3, 1).unwrap_err().to_string()
    }

    #[test]
    fn debug_reads_like_display_without_escapes() {
        let log = "line 11: 'x' : undeclared identifier\nline 12: \"y\"".to_owned();
        let error = Error::Shader { name: "light.rgen".to_owned(), log };
        let text = "shader 'light.rgen': line 11: 'x' : undeclared identifier\nline 12: \"y\"";
        assert_eq!(format!("{error:?}"), text);
        assert_eq!(format!("{error:#?}"), text);
        let boxed: Box<dyn std::error::Error> = Box::new(error);
        assert_eq!(format!("Error: {boxed:?}"), format!("Error: {text}"));
    }

    /// An error of each kind that has names, all of which are `name`.
    fn errors_with(name: &str) -> Vec<Error> {
        let text = || name.to_owned();
        let label = device_loss::ReportedLabel {
            name: text(),
            depth: 0,
            progress: device_loss::LabelProgress::Begun,
        };
        let unfinished =
            vec![device_loss::UnfinishedCommands { value: 1, name: text(), labels: vec![label] }];
        let queue =
            device_loss::QueueLossReport { queue: Queue::Graphics, completed: 0, submitted: 1, unfinished };
        let fault = device_fault::DeviceFault { description: text(), ..Default::default() };
        let report = DeviceLossReport {
            call: "vkQueueSubmit2",
            object: text(),
            fault: Some(fault),
            queues: vec![queue],
        };
        let kind = device_candidate::DeviceKind::Cpu;
        let candidates = vec![DeviceCandidate {
            index: 0,
            name: text(),
            kind,
            api_version: (1, 3, 0),
            driver: text(),
            missing: vec![text()],
        }];
        let difference = LayoutDifference::OnlyInStruct { member: text(), offset: 0, bytes: 4 };
        vec![
            Error::NoDevice { problem: Some(text()), candidates, drivers: None },
            Error::unsupported(text(), text()),
            Error::LimitExceeded {
                object: text(),
                what: "size",
                requested: 2,
                limit: 1,
                origin: LimitOrigin::Device,
            },
            Error::StaleHandle { kind: "buffer", name: Some(text()) },
            Error::usage(text(), text()),
            Error::SurfaceLost { swapchain: text(), source: Box::new(Error::usage("window", text())) },
            Error::PushConstants { pipeline: text(), expected: 1, offset: 0, size: 2 },
            Error::LayoutMismatch {
                pipeline: text(),
                shader: text(),
                block: text(),
                struct_name: "Push",
                differences: vec![difference],
            },
            Error::ShaderRecord { pipeline: text(), shader: text(), group: text(), expected: 2, size: 1 },
            Error::File { path: name.into(), message: text() },
            Error::Serialized { object: text(), reason: text() },
            Error::OverBudget { object: text(), bytes: 2, used: 1, budget: 1 },
            Error::OutOfDeviceMemory { call: "vkAllocateMemory", object: text(), bytes: Some(1) },
            Error::OutOfHostMemory { call: "vkAllocateMemory", object: text() },
            Error::Vulkan { call: "vkMapMemory", object: text(), result: vk::Result::ERROR_UNKNOWN },
            Error::DeviceLost { report: Arc::new(report) },
            Error::Creation { object: text(), source: Box::new(Error::usage(text(), text())) },
            Error::Shader { name: text(), log: "line 1".to_owned() },
        ]
    }

    #[test]
    fn names_are_escaped_and_shortened_in_every_error() {
        for error in errors_with("a\u{1b}[2J\u{202e}\r\nb") {
            let text = error.to_string();
            assert!(text.contains("a\\u{1b}[2J"), "{text}");
            assert!(!text.contains(|c: char| c.is_control() || c == '\u{202e}'), "{text}");
        }
        for error in errors_with(&"n".repeat(1 << 20)) {
            let length = error.to_string().len();
            assert!(length < 20_000, "{length}: {:.200}", error.to_string());
        }
    }

    #[test]
    fn logs_of_the_compiler_keep_their_lines_and_show_no_control_characters() {
        let error = Error::Shader { name: "a".to_owned(), log: "line 1: '\u{1b}['\nline 2\t".to_owned() };
        assert_eq!(error.to_string(), "shader 'a': line 1: '\\u{1b}['\nline 2\t");
    }

    #[test]
    fn limits_name_the_party_that_sets_them() {
        let start = "scene: instance count is 3, ";
        for (origin, clause) in [
            (LimitOrigin::Device, "the device takes at most 1"),
            (LimitOrigin::Library, "the library takes at most 1"),
            (LimitOrigin::Vulkan, "Vulkan takes at most 1"),
            (
                LimitOrigin::TlasCapacity,
                "the TLAS was created for at most 1; create it with a larger TlasDesc::capacity",
            ),
            (LimitOrigin::Descriptors, "the context has descriptors for at most 1; destroy some"),
        ] {
            assert_eq!(exceeded(origin, "instance count"), format!("{start}{clause}"));
        }
        assert!(check_limit("scene", "instance count", 1, 1).is_ok());
    }

    #[test]
    fn lacking_features_are_told_in_any_number() {
        let text =
            Error::unsupported("ray queries, which shader 's' uses", "the device 'd' has none").to_string();
        assert_eq!(text, "not supported: ray queries, which shader 's' uses: the device 'd' has none");
    }

    #[test]
    fn stale_and_foreign_handles_have_texts_of_their_own() {
        let stale = |name: Option<&str>| {
            Error::StaleHandle { kind: "buffer", name: name.map(str::to_owned) }.to_string()
        };
        let end = "was destroyed; keep its holder while the handle is in use";
        assert_eq!(stale(Some("vertices")), format!("stale buffer handle: 'vertices' {end}"));
        assert_eq!(stale(None), format!("stale buffer handle: the buffer {end}"));
        assert_eq!(
            Error::ForeignHandle { kind: "buffer" }.to_string(),
            "foreign buffer handle: the object belongs to another context; use the handle with the context that made it"
        );
    }

    #[test]
    fn errors_of_vulkan_calls_name_the_object() {
        let text = |result| Error::vulkan("vkEndCommandBuffer", "shadows")(result).to_string();
        let unknown = vk::Result::ERROR_UNKNOWN;
        assert_eq!(text(unknown), format!("vkEndCommandBuffer failed for 'shadows': {unknown}"));
        for (result, start) in [
            (vk::Result::ERROR_OUT_OF_DEVICE_MEMORY, "out of device memory"),
            (vk::Result::ERROR_OUT_OF_HOST_MEMORY, "out of host memory"),
            (vk::Result::ERROR_DEVICE_LOST, "the device was lost"),
        ] {
            let told = text(result);
            assert!(told.starts_with(&format!("{start} in vkEndCommandBuffer for 'shadows'")), "{told}");
        }
        let refusal = Error::vulkan("vkCreateXcbSurfaceKHR", "main")(vk::Result::ERROR_OUT_OF_HOST_MEMORY);
        let told = Error::SurfaceLost { swapchain: "main".to_owned(), source: Box::new(refusal) }.to_string();
        let start = "swapchain 'main': its window is gone (out of host memory in vkCreateXcb";
        assert!(told.starts_with(start), "{told}");
    }

    #[test]
    fn buffers_of_the_library_have_the_name_of_their_owner_too() {
        let owned = |error: Error| error.with_owner("readback", "water").to_string();
        let memory = Error::allocating("readback", 8)(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
        let expected = "out of device memory in vkAllocateMemory for 'readback of water' (8 bytes)";
        assert_eq!(owned(memory), expected);
        let host = Error::vulkan("vkMapMemory", "readback");
        let expected = "out of host memory in vkMapMemory for 'readback of water'";
        assert_eq!(owned(host(vk::Result::ERROR_OUT_OF_HOST_MEMORY)), expected);
        let waits = Error::vulkan("vkWaitSemaphores", "timeline")(vk::Result::ERROR_OUT_OF_HOST_MEMORY);
        assert_eq!(owned(waits.clone()), waits.to_string(), "of another object");
        assert_eq!(owned(Error::usage("grass", "is green")), "grass: is green");
    }

    #[test]
    fn stale_handles_get_the_name_of_what_was_to_be_created() {
        let stale = Error::StaleHandle { kind: "shader module", name: None }.with_object("water");
        assert!(stale.to_string().starts_with("water: stale shader module handle"), "{stale}");
        assert_eq!(Error::usage("grass", "is green").with_object("water").to_string(), "grass: is green");
    }
}
