//! The commands that the layer wraps: those that answer a `VkResult`, and those that end an object.

use ash::vk;

use super::wrappers;

/// The command may lose the device.
pub(super) const LOST: u8 = 1;
/// The command may lose the surface of a window.
pub(super) const SURFACE: u8 = 2;
/// The command may find the swapchain out of date.
pub(super) const DATED: u8 = 4;
/// The command writes the address of mapped memory to its last argument.
pub(super) const MAPS: u8 = 8;
/// The command may find the window in use. Vulkan names this answer for surfaces of Android alone; those of X stand for them.
pub(super) const IN_USE: u8 = 16;

/// Objects that a command creates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Creates {
    /// No object that is counted.
    Nothing,
    /// One object of this type; its handle is written to the last argument.
    One(&'static str),
    /// Objects of this type, as many as the argument of this number says.
    Many(&'static str, usize),
}

/// A command that the layer wraps.
pub(super) struct Command {
    /// Name of the command.
    pub(super) name: &'static str,
    /// Another name of the same command.
    pub(super) alias: Option<&'static str>,
    /// The bits [`LOST`], [`SURFACE`], [`DATED`], [`MAPS`] and [`IN_USE`].
    pub(super) answers: u8,
    /// Objects that it creates.
    pub(super) creates: Creates,
    /// Type of the object that it destroys.
    pub(super) destroys: Option<&'static str>,
    /// Address of the wrapper, a function of the command's type.
    pub(super) wrapper: usize,
}

impl Command {
    /// True for a command that gives a queue work, and so may be lost with its device.
    pub(super) fn gives_work(&self) -> bool {
        self.name.starts_with("vkQueue") && self.name != "vkQueueWaitIdle"
    }
}

macro_rules! creates {
    () => {
        Creates::Nothing
    };
    ($kind:literal) => {
        Creates::One($kind)
    };
    ($kind:literal $count:literal) => {
        Creates::Many($kind, $count)
    };
}

macro_rules! alias {
    () => {
        None
    };
    ($alias:literal) => {
        Some($alias)
    };
}

macro_rules! answers {
    () => {
        0
    };
    ($answers:expr) => {
        $answers
    };
}

/// Declares the list of commands: type of the function, number of arguments, and what else differs from command to command.
macro_rules! commands {
    (
        answers {
            $($pfn:ident $arity:ident $([$answers:expr])? $(makes $kind:literal $(times $count:literal)?)? $(alias $alias:literal)?;)*
        }
        ends {
            $($end:ident $ended:literal $(alias $end_alias:literal)?;)*
        }
    ) => {
        /// Numbers of the commands, which wrappers know by their type.
        #[allow(non_camel_case_types, clippy::enum_variant_names)]
        enum Number { $($pfn,)* $($end,)* }

        /// Returns every command, by number.
        pub(super) fn commands() -> Vec<Command> {
            vec![
                $(Command {
                    name: &stringify!($pfn)[4..],
                    alias: alias!($($alias)?),
                    answers: answers!($($answers)?),
                    creates: creates!($($kind $($count)?)?),
                    destroys: None,
                    wrapper: commands!(@wrapper $arity $pfn),
                },)*
                $(Command {
                    name: &stringify!($end)[4..],
                    alias: alias!($($end_alias)?),
                    answers: 0,
                    creates: Creates::Nothing,
                    destroys: Some($ended),
                    wrapper: wrappers::end::<{ Number::$end as usize }, _, _, _>(None::<vk::$end>),
                },)*
            ]
        }
    };
    (@wrapper one $pfn:ident) => { wrappers::one::<{ Number::$pfn as usize }, _>(None::<vk::$pfn>) };
    (@wrapper two $pfn:ident) => { wrappers::two::<{ Number::$pfn as usize }, _, _>(None::<vk::$pfn>) };
    (@wrapper three $pfn:ident) => { wrappers::three::<{ Number::$pfn as usize }, _, _, _>(None::<vk::$pfn>) };
    (@wrapper four $pfn:ident) => { wrappers::four::<{ Number::$pfn as usize }, _, _, _, _>(None::<vk::$pfn>) };
    (@wrapper five $pfn:ident) => {
        wrappers::five::<{ Number::$pfn as usize }, _, _, _, _, _>(None::<vk::$pfn>)
    };
    (@wrapper six $pfn:ident) => {
        wrappers::six::<{ Number::$pfn as usize }, _, _, _, _, _, _>(None::<vk::$pfn>)
    };
    (@wrapper seven $pfn:ident) => {
        wrappers::seven::<{ Number::$pfn as usize }, _, _, _, _, _, _, _>(None::<vk::$pfn>)
    };
    (@wrapper eight $pfn:ident) => {
        wrappers::eight::<{ Number::$pfn as usize }, _, _, _, _, _, _, _, _>(None::<vk::$pfn>)
    };
}

commands! {
    answers {
        PFN_vkEnumeratePhysicalDevices three;
        PFN_vkGetPhysicalDeviceImageFormatProperties seven;
        PFN_vkEnumerateDeviceExtensionProperties four;
        PFN_vkEnumerateDeviceLayerProperties three;
        PFN_vkQueueSubmit four [LOST];
        PFN_vkQueueWaitIdle one [LOST];
        PFN_vkDeviceWaitIdle one [LOST];
        PFN_vkAllocateMemory four makes "VkDeviceMemory";
        PFN_vkMapMemory six [MAPS];
        PFN_vkFlushMappedMemoryRanges three;
        PFN_vkInvalidateMappedMemoryRanges three;
        PFN_vkBindBufferMemory four;
        PFN_vkBindImageMemory four;
        PFN_vkCreateFence four makes "VkFence";
        PFN_vkResetFences three;
        PFN_vkGetFenceStatus two [LOST];
        PFN_vkWaitForFences five [LOST];
        PFN_vkCreateSemaphore four makes "VkSemaphore";
        PFN_vkCreateQueryPool four makes "VkQueryPool";
        PFN_vkGetQueryPoolResults eight [LOST];
        PFN_vkCreateBuffer four makes "VkBuffer";
        PFN_vkCreateImage four makes "VkImage";
        PFN_vkCreateImageView four makes "VkImageView";
        PFN_vkCreateShaderModule four makes "VkShaderModule";
        PFN_vkCreatePipelineCache four makes "VkPipelineCache";
        PFN_vkGetPipelineCacheData four;
        PFN_vkMergePipelineCaches four;
        PFN_vkCreateGraphicsPipelines six makes "VkPipeline" times 2;
        PFN_vkCreateComputePipelines six makes "VkPipeline" times 2;
        PFN_vkCreatePipelineLayout four makes "VkPipelineLayout";
        PFN_vkCreateSampler four makes "VkSampler";
        PFN_vkCreateDescriptorSetLayout four makes "VkDescriptorSetLayout";
        PFN_vkCreateDescriptorPool four makes "VkDescriptorPool";
        PFN_vkResetDescriptorPool three;
        PFN_vkAllocateDescriptorSets three;
        PFN_vkFreeDescriptorSets four;
        PFN_vkCreateCommandPool four makes "VkCommandPool";
        PFN_vkResetCommandPool three;
        PFN_vkAllocateCommandBuffers three;
        PFN_vkBeginCommandBuffer two;
        PFN_vkEndCommandBuffer one;
        PFN_vkResetCommandBuffer two;
        PFN_vkGetPhysicalDeviceSurfaceSupportKHR four [SURFACE];
        PFN_vkGetPhysicalDeviceSurfaceCapabilitiesKHR three [SURFACE];
        PFN_vkGetPhysicalDeviceSurfaceFormatsKHR four [SURFACE];
        PFN_vkGetPhysicalDeviceSurfacePresentModesKHR four [SURFACE];
        PFN_vkCreateSwapchainKHR four [LOST | SURFACE | IN_USE] makes "VkSwapchainKHR";
        PFN_vkGetSwapchainImagesKHR four;
        PFN_vkAcquireNextImageKHR six [LOST | SURFACE | DATED];
        PFN_vkQueuePresentKHR two [LOST | SURFACE | DATED];
        PFN_vkAcquireNextImage2KHR three [LOST | SURFACE | DATED];
        PFN_vkCreateXlibSurfaceKHR four [IN_USE] makes "VkSurfaceKHR";
        PFN_vkCreateXcbSurfaceKHR four [IN_USE] makes "VkSurfaceKHR";
        PFN_vkGetPhysicalDeviceImageFormatProperties2 three alias "vkGetPhysicalDeviceImageFormatProperties2KHR";
        PFN_vkGetMemoryFdKHR three;
        PFN_vkGetMemoryFdPropertiesKHR four;
        PFN_vkImportSemaphoreFdKHR two;
        PFN_vkGetSemaphoreFdKHR three;
        PFN_vkGetSwapchainStatusKHR two [LOST | SURFACE | DATED];
        PFN_vkImportFenceFdKHR two;
        PFN_vkGetFenceFdKHR three;
        PFN_vkGetPhysicalDeviceSurfaceCapabilities2KHR three [SURFACE];
        PFN_vkGetPhysicalDeviceSurfaceFormats2KHR four [SURFACE];
        PFN_vkCreateDebugUtilsMessengerEXT four makes "VkDebugUtilsMessengerEXT";
        PFN_vkSetDebugUtilsObjectNameEXT two;
        PFN_vkCreateAccelerationStructureKHR four makes "VkAccelerationStructureKHR";
        PFN_vkBuildAccelerationStructuresKHR five;
        PFN_vkCopyAccelerationStructureKHR three;
        PFN_vkCopyAccelerationStructureToMemoryKHR three;
        PFN_vkCopyMemoryToAccelerationStructureKHR three;
        PFN_vkWriteAccelerationStructuresPropertiesKHR seven;
        PFN_vkGetRayTracingShaderGroupHandlesKHR six;
        PFN_vkGetPhysicalDeviceFragmentShadingRatesKHR three;
        PFN_vkGetImageDrmFormatModifierPropertiesEXT three;
        PFN_vkCreateRayTracingPipelinesKHR seven makes "VkPipeline" times 3;
        PFN_vkCreateSamplerYcbcrConversion four makes "VkSamplerYcbcrConversion" alias "vkCreateSamplerYcbcrConversionKHR";
        PFN_vkBindBufferMemory2 three alias "vkBindBufferMemory2KHR";
        PFN_vkBindImageMemory2 three alias "vkBindImageMemory2KHR";
        PFN_vkGetMemoryHostPointerPropertiesEXT four;
        PFN_vkGetPhysicalDeviceCalibrateableTimeDomainsKHR three alias "vkGetPhysicalDeviceCalibrateableTimeDomainsEXT";
        PFN_vkGetCalibratedTimestampsKHR five alias "vkGetCalibratedTimestampsEXT";
        PFN_vkWaitSemaphores three [LOST] alias "vkWaitSemaphoresKHR";
        PFN_vkGetSemaphoreCounterValue three [LOST] alias "vkGetSemaphoreCounterValueKHR";
        PFN_vkSignalSemaphore two alias "vkSignalSemaphoreKHR";
        PFN_vkGetPhysicalDeviceToolProperties three alias "vkGetPhysicalDeviceToolPropertiesEXT";
        PFN_vkWaitForPresentKHR four [LOST | SURFACE | DATED];
        PFN_vkGetPhysicalDeviceSurfacePresentModes2EXT four;
        PFN_vkCreateHeadlessSurfaceEXT four makes "VkSurfaceKHR";
        PFN_vkCreateDeferredOperationKHR three makes "VkDeferredOperationKHR";
        PFN_vkGetDeferredOperationResultKHR two;
        PFN_vkDeferredOperationJoinKHR two;
        PFN_vkCopyMemoryToImageEXT two;
        PFN_vkCopyImageToMemoryEXT two;
        PFN_vkCopyImageToImageEXT two;
        PFN_vkTransitionImageLayoutEXT three;
        PFN_vkMapMemory2KHR three [MAPS];
        PFN_vkUnmapMemory2KHR two;
        PFN_vkReleaseSwapchainImagesEXT two [SURFACE];
        PFN_vkQueueSubmit2 four [LOST] alias "vkQueueSubmit2KHR";
        PFN_vkGetDeviceFaultInfoEXT three;
        PFN_vkCreateMicromapEXT four makes "VkMicromapEXT";
        PFN_vkBuildMicromapsEXT four;
        PFN_vkCopyMicromapEXT three;
        PFN_vkCopyMicromapToMemoryEXT three;
        PFN_vkCopyMemoryToMicromapEXT three;
        PFN_vkWriteMicromapsPropertiesEXT seven;
    }
    ends {
        PFN_vkFreeMemory "VkDeviceMemory";
        PFN_vkDestroyFence "VkFence";
        PFN_vkDestroySemaphore "VkSemaphore";
        PFN_vkDestroyQueryPool "VkQueryPool";
        PFN_vkDestroyBuffer "VkBuffer";
        PFN_vkDestroyImage "VkImage";
        PFN_vkDestroyImageView "VkImageView";
        PFN_vkDestroyShaderModule "VkShaderModule";
        PFN_vkDestroyPipelineCache "VkPipelineCache";
        PFN_vkDestroyPipeline "VkPipeline";
        PFN_vkDestroyPipelineLayout "VkPipelineLayout";
        PFN_vkDestroySampler "VkSampler";
        PFN_vkDestroyDescriptorSetLayout "VkDescriptorSetLayout";
        PFN_vkDestroyDescriptorPool "VkDescriptorPool";
        PFN_vkDestroyCommandPool "VkCommandPool";
        PFN_vkDestroySurfaceKHR "VkSurfaceKHR";
        PFN_vkDestroySwapchainKHR "VkSwapchainKHR";
        PFN_vkDestroyDebugUtilsMessengerEXT "VkDebugUtilsMessengerEXT";
        PFN_vkDestroyAccelerationStructureKHR "VkAccelerationStructureKHR";
        PFN_vkDestroySamplerYcbcrConversion "VkSamplerYcbcrConversion" alias "vkDestroySamplerYcbcrConversionKHR";
        PFN_vkDestroyDeferredOperationKHR "VkDeferredOperationKHR";
        PFN_vkDestroyMicromapEXT "VkMicromapEXT";
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
    use std::collections::BTreeSet;
    use std::path::{Path, PathBuf};

    use super::*;

    #[test]
    fn every_object_that_is_made_is_ended_by_a_command() {
        let commands = commands();
        let ends: Vec<_> = commands.iter().filter_map(|command| command.destroys).collect();
        for command in &commands {
            if let Creates::One(kind) | Creates::Many(kind, _) = command.creates {
                assert!(ends.contains(&kind), "{}", command.name);
            }
        }
    }

    /// Commands that `lvk` names in errors without a wrapper: with functions of their own in this layer, and for windows of other systems.
    const WITHOUT_WRAPPER: [&str; 10] = [
        "vkCreateInstance",
        "vkCreateDevice",
        "vkEnumerateInstanceVersion",
        "vkEnumerateInstanceExtensionProperties",
        "vkEnumerateInstanceLayerProperties",
        "vkCreateAndroidSurfaceKHR",
        "vkCreateMetalSurfaceEXT",
        "vkCreateWaylandSurfaceKHR",
        "vkCreateWin32SurfaceKHR",
        "vkGetInstanceProcAddr",
    ];

    /// Returns each command that a text names at the start of a string literal.
    fn commands_of(text: &str) -> impl Iterator<Item = &str> {
        text.match_indices("\"vk").filter_map(|(start, _)| {
            let name = text[start + 1..].split(|letter: char| !letter.is_ascii_alphanumeric()).next()?;
            name[2..].starts_with(|letter: char| letter.is_ascii_uppercase()).then_some(name)
        })
    }

    fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                rust_files(&path, found);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.push(path);
            }
        }
    }

    #[test]
    fn every_command_that_the_library_names_is_wrapped() {
        let commands = commands();
        let wrapped: BTreeSet<&str> =
            commands.iter().flat_map(|command| [Some(command.name), command.alias]).flatten().collect();
        let mut files = Vec::new();
        rust_files(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../lvk/src")), &mut files);
        // Test doubles name commands that the library calls by functions of `ash`, or that the allocator calls.
        files.retain(|path| !path.components().any(|part| part.as_os_str() == "test_support"));
        let texts: Vec<String> = files.iter().map(|path| std::fs::read_to_string(path).unwrap()).collect();
        let named: BTreeSet<&str> =
            texts.iter().flat_map(|text| commands_of(text)).filter(|name| *name != "vkCmd").collect();
        assert!(named.len() > 60, "{named:?}");
        let missing: Vec<_> =
            named.difference(&wrapped).filter(|name| !WITHOUT_WRAPPER.contains(name)).collect();
        assert_eq!(missing, [] as [&&str; 0]);
        assert!(WITHOUT_WRAPPER.iter().all(|name| named.contains(name)), "an exception is not needed");
    }

    #[test]
    fn names_are_those_of_vulkan_and_occur_once() {
        let commands = commands();
        let mut names: Vec<_> =
            commands.iter().flat_map(|command| [Some(command.name), command.alias]).flatten().collect();
        assert!(names.iter().all(|name| name.starts_with("vk")));
        names.sort_unstable();
        let count = names.len();
        names.dedup();
        assert_eq!((names.len(), count > 80), (count, true));
    }
}
