//! The object that an error names: one that a program has named, or one of the few that have no name of their own.

use std::collections::BTreeSet;

use lvk::Format;

use super::verdict::RunOutcome;
use crate::call_log::NamedObject;

/// Objects that the library or a scenario gives no name in Vulkan, with the starts of the commands whose errors tell them.
pub const UNNAMED_OBJECTS: &[(&str, &[&str])] = &[
    ("Vulkan loader", &["vkEnumerateInstance"]),
    ("instance", &["vkCreateInstance", "vkEnumeratePhysicalDevices"]),
    ("window", &["vkGetPhysicalDeviceSurfaceSupportKHR", "vkCreateX"]),
    ("graphics queue", QUEUE),
    ("compute queue", QUEUE),
    ("transfer queue", QUEUE),
    ("command buffer of the graphics queue", COMMAND_BUFFER),
    ("command buffer of the compute queue", COMMAND_BUFFER),
    ("command buffer of the transfer queue", COMMAND_BUFFER),
    ("uploads and builds", COMMAND_BUFFER),
    ("pipeline layout", &["vkCreatePipelineLayout"]),
    ("input attachments", &["vkCreateDescriptor", "vkAllocateDescriptorSets"]),
    ("default tlas", MEMORY),
    // BLAS that software traverses lie in buffers that they share, so Vulkan has no name of one.
    ("readback of stripes", MEMORY),
    ("fragment sizes", &["vkGetPhysicalDeviceFragmentShadingRatesKHR"]),
    (
        "clocks of device and host",
        &["vkGetPhysicalDeviceCalibrateableTimeDomains", "vkGetCalibratedTimestamps"],
    ),
    ("messages of the validation layer", &["vkCreateDebugUtilsMessengerEXT"]),
    ("instance of the engine", &["vkCreateInstance", "vkEnumeratePhysicalDevices"]),
    ("device of the engine", &["vkCreateDevice", "vkDeviceWaitIdle"]),
    ("semaphore of the engine", &["vkCreateSemaphore", "vkWaitSemaphores"]),
];

const QUEUE: &[&str] = &["vkQueue"];
const COMMAND_BUFFER: &[&str] =
    &["vkCreateCommandPool", "vkAllocateCommandBuffers", "vkResetCommandPool", "vkBegin", "vkEnd"];
const MEMORY: &[&str] = &["vkCreateBuffer", "vkAllocateMemory", "vkBindBufferMemory", "vkMapMemory"];

/// Starts of the commands whose errors name a physical device.
const PHYSICAL_DEVICE: &[&str] = &["vkEnumerateDevice", "vkGetPhysicalDevice", "vkCreateDevice"];

/// Kinds of named objects that errors may name, by starts of commands. The row with the longest start decides.
const KINDS: &[(&[&str], &[&str])] = &[
    (&["vkCreateBuffer", "vkBindBufferMemory"], &["BUFFER", "ACCELERATION_STRUCTURE_KHR", "MICROMAP_EXT"]),
    (&["vkAllocateMemory", "vkMapMemory", "vkGetMemory"], WITH_MEMORY),
    (&["vkCreateImage", "vkBindImageMemory", "vkGetImage", "vkTransitionImage"], &["IMAGE"]),
    (&["vkCopyMemoryToImage", "vkCopyImageTo"], &["IMAGE"]),
    (&["vkCreateImageView"], &["IMAGE", "IMAGE_VIEW", "SWAPCHAIN_KHR"]),
    // Whatever has a format asks for it: textures, pipelines with targets, samplers of YCbCr, swapchains.
    (&["vkGetPhysicalDeviceImageFormatProperties"], &["IMAGE", "PIPELINE", "SAMPLER", "SWAPCHAIN_KHR"]),
    (&["vkCreateSampler"], &["SAMPLER"]),
    (&["vkCreateSamplerYcbcrConversion"], &["SAMPLER", "SAMPLER_YCBCR_CONVERSION"]),
    (&["vkCreateShaderModule"], &["SHADER_MODULE"]),
    (
        &["vkCreateGraphicsPipelines", "vkCreateComputePipelines", "vkCreateRayTracingPipelines"],
        &["PIPELINE"],
    ),
    (
        &["vkCreateDeferredOperation", "vkDeferredOperation", "vkGetRayTracingShaderGroupHandles"],
        &["PIPELINE"],
    ),
    (&["vkCreatePipelineCache", "vkGetPipelineCacheData", "vkMergePipelineCaches"], &["PIPELINE_CACHE"]),
    (&["vkCreateDescriptorSetLayout"], &["DESCRIPTOR_SET_LAYOUT"]),
    (&["vkCreateDescriptorPool", "vkResetDescriptorPool"], &["DESCRIPTOR_POOL"]),
    (&["vkAllocateDescriptorSets", "vkFreeDescriptorSets"], &["DESCRIPTOR_SET"]),
    (&["vkCreateSemaphore", "vkWaitSemaphores", "vkGetSemaphore", "vkSignalSemaphore"], &["SEMAPHORE"]),
    (&["vkImportSemaphore"], &["SEMAPHORE"]),
    (
        &["vkCreateFence", "vkImportFence", "vkWaitForFences", "vkResetFences", "vkGetFence"],
        &["FENCE", "SWAPCHAIN_KHR"],
    ),
    // The size of a compacted structure comes from a pool of its own.
    (&["vkCreateQueryPool", "vkGetQueryPoolResults"], &["QUERY_POOL", "ACCELERATION_STRUCTURE_KHR"]),
    (&["vkCreateSwapchain", "vkGetSwapchain", "vkReleaseSwapchainImages"], &["SWAPCHAIN_KHR"]),
    (&["vkAcquireNextImage", "vkQueuePresent", "vkWaitForPresent"], &["SWAPCHAIN_KHR"]),
    (&["vkGetPhysicalDeviceSurface", "vkCreateX"], &["SWAPCHAIN_KHR"]),
    (&["vkCreateAccelerationStructure", "vkBuildAccelerationStructures"], &["ACCELERATION_STRUCTURE_KHR"]),
    (
        &["vkCopyAccelerationStructure", "vkCopyMemoryToAccelerationStructure"],
        &["ACCELERATION_STRUCTURE_KHR"],
    ),
    (&["vkWriteAccelerationStructures"], &["ACCELERATION_STRUCTURE_KHR"]),
    (
        &["vkCreateMicromap", "vkBuildMicromaps", "vkCopyMicromap", "vkCopyMemoryToMicromap"],
        &["MICROMAP_EXT"],
    ),
];

/// Kinds of objects that have memory.
const WITH_MEMORY: &[&str] = &["BUFFER", "ACCELERATION_STRUCTURE_KHR", "MICROMAP_EXT", "IMAGE"];
/// Kinds of objects that are written and read back.
const FILLED: &[&str] = &["BUFFER", "IMAGE", "IMAGE_VIEW", "ACCELERATION_STRUCTURE_KHR"];
const SWAPCHAIN: &str = "SWAPCHAIN_KHR";

/// Returns the kinds of named objects that an error of a command may name.
fn kinds_of(command: &str) -> &'static [&'static str] {
    let starts =
        |row: &'static (&[&str], &[&str])| row.0.iter().map(move |start| (start.len(), row.1, *start));
    let fitting = KINDS.iter().flat_map(starts).filter(|(_, _, start)| command.starts_with(start));
    fitting.max_by_key(|(length, ..)| *length).map_or(&[], |(_, kinds, _)| kinds)
}

/// Starts of the names that the library makes of the name of another object.
const SERVING: [&str; 2] = ["readback of ", "staging of "];

/// Start of the commands that ask for a format, by its name in the library.
const FORMAT_QUERY: &str = "vkGetPhysicalDeviceImageFormatProperties";

/// The objects that errors of one run may name.
pub(super) struct KnownObjects<'a> {
    named: BTreeSet<&'a NamedObject>,
    devices: BTreeSet<&'a str>,
    files: BTreeSet<&'a str>,
}

impl<'a> KnownObjects<'a> {
    /// Collects the names of objects and physical devices, and the files of caches.
    pub(super) fn of(found: &'a RunOutcome, clean: &'a RunOutcome) -> Self {
        let both = [found, clean];
        let named = both.iter().flat_map(|outcome| &outcome.names);
        let devices = both.iter().flat_map(|outcome| &outcome.devices);
        let files = both.iter().flat_map(|outcome| &outcome.files);
        Self {
            named: named.filter(|object| !object.name.is_empty()).collect(),
            devices: devices.map(String::as_str).collect(),
            files: files.map(String::as_str).filter(|file| file.starts_with("caches/")).collect(),
        }
    }

    /// True if a text behind `command` names an object of it in quotes, as in `vkCreateBuffer for 'rain'` and
    /// `vkCreateBuffer failed for 'rain'`.
    pub(super) fn follow(&self, command: &str, rest: &str) -> bool {
        let rest = rest.strip_prefix(" failed").unwrap_or(rest);
        rest.strip_prefix(" for '").is_some_and(|quoted| self.start(command, quoted))
    }

    /// True if a text ends with a quote and the name of a swapchain.
    pub(super) fn end_with_swapchain(&self, text: &str) -> bool {
        let ends = |name| text.strip_suffix(name).is_some_and(|before| before.ends_with('\''));
        self.of_kinds(&[SWAPCHAIN]).any(ends)
    }

    /// Returns the names of objects of these kinds.
    fn of_kinds(&self, kinds: &[&str]) -> impl Iterator<Item = &str> {
        self.named.iter().filter(|object| kinds.contains(&&*object.kind)).map(|object| &*object.name)
    }

    /// True if a text quotes the name of an object.
    pub(super) fn occur(&self, text: &str) -> bool {
        text.match_indices('\'')
            .any(|(place, _)| self.named.iter().any(|object| starts_with(&text[place + 1..], &object.name)))
    }

    /// True if a text starts with the name of an object of `command` and the closing quote.
    fn start(&self, command: &str, quoted: &str) -> bool {
        let concerns = |starts: &[&str]| starts.iter().any(|start| command.starts_with(start));
        let is_named = self.of_kinds(kinds_of(command)).any(|name| starts_with(quoted, name));
        let mut served =
            SERVING.iter().filter_map(|start| quoted.strip_prefix(start)).filter(|_| concerns(MEMORY));
        let serves_named = served.any(|owner| self.of_kinds(FILLED).any(|name| starts_with(owner, name)));
        let is_unnamed = |(name, starts): &(&str, &[&str])| concerns(starts) && starts_with(quoted, name);
        is_named
            || serves_named
            || concerns(PHYSICAL_DEVICE) && self.devices.iter().any(|name| starts_with(quoted, name))
            || UNNAMED_OBJECTS.iter().any(is_unnamed)
            || command.starts_with(FORMAT_QUERY)
                && Format::ALL.iter().any(|format| starts_with(quoted, &format!("{format:?}")))
            || command.contains("PipelineCache") && self.is_file(quoted)
    }

    /// True if a text starts with the path of a file of the caches.
    fn is_file(&self, quoted: &str) -> bool {
        let path = quoted.split('\'').next().unwrap_or_default();
        self.files.iter().any(|file| path.strip_suffix(file).is_some_and(|folder| folder.ends_with('/')))
    }
}

/// True if a text starts with a name and the closing quote.
fn starts_with(text: &str, name: &str) -> bool {
    text.strip_prefix(name).is_some_and(|rest| rest.starts_with('\''))
}

#[cfg(test)]
mod tests {
    use super::super::verdict::tests::{clean, named};
    use super::*;

    #[test]
    fn only_objects_of_the_program_count() {
        let names = named(&[
            ("BUFFER", "rain"),
            ("IMAGE", "the sky's colour"),
            ("SWAPCHAIN_KHR", "main"),
            ("ACCELERATION_STRUCTURE_KHR", "birch"),
            ("IMAGE", ""),
        ]);
        let devices = ["llvmpipe".to_owned()].into();
        let (found, without) = (clean(), RunOutcome { names, devices, ..clean() });
        let objects = KnownObjects::of(&found, &without);
        for (command, rest) in [
            ("vkCreateBuffer", " for 'rain'"),
            ("vkCreateBuffer", " failed for 'rain': ERROR_UNKNOWN"),
            ("vkCreateImage", " for 'the sky's colour'; create it later"),
            ("vkAllocateMemory", " for 'the sky's colour'"),
            ("vkCreateImageView", " for 'the sky's colour'"),
            ("vkCreateImageView", " for 'main'"),
            ("vkMapMemory", " for 'readback of rain'"),
            ("vkCreateBuffer", " for 'staging of rain'"),
            ("vkGetQueryPoolResults", " for 'birch'"),
            ("vkQueueSubmit2", " for 'compute queue'; create a new context"),
            ("vkCreateDevice", " for 'llvmpipe'"),
            ("vkGetPhysicalDeviceImageFormatProperties", " for 'Rgba8Unorm'"),
            ("vkGetPipelineCacheData", " for '/var/run/caches/pipelines'"),
        ] {
            assert!(objects.follow(command, rest), "{command}{rest}");
        }
        for (command, rest) in [
            ("vkCreateBuffer", ""),
            ("vkCreateBuffer", " for rain"),
            ("vkCreateBuffer", " for ''"),
            ("vkCreateBuffer", " for 'snow'"),
            ("vkCreateBuffer", " for 'rain and snow'"),
            ("vkCreateBuffer", " for 'llvmpipe'"),
            ("vkCreateBuffer", " for 'compute queue'"),
            ("vkCreateBuffer", " for 'the sky's colour'"),
            ("vkCreateImage", " for 'rain'"),
            ("vkCreateQueryPool", " for 'rain'"),
            ("vkCreateImage", " for 'main'"),
            ("vkQueueSubmit2", " for 'rain'"),
            ("vkCreateImage", " for 'Rgba8Unorm'"),
            ("vkCreateImage", " for 'readback of rain'"),
            ("vkCreateBuffer", " for 'staging of snow'"),
            ("vkMapMemory", " for 'readback of snow'"),
            ("vkGetPipelineCacheData", " for '/var/run/other'"),
            ("vkCreateBuffer", " for '/var/run/caches/pipelines'"),
        ] {
            assert!(!objects.follow(command, rest), "{command}{rest}");
        }
        for (text, ends) in [("swapchain 'main", true), ("swapchain 'rain", false), ("swapchain '", false)] {
            assert_eq!(objects.end_with_swapchain(text), ends, "{text}");
        }
        assert!(objects.occur("shader 'rain' needs") && !objects.occur("shader 'snow' needs"));
    }
}
