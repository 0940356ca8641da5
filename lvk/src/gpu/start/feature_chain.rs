//! Adds the features of the library to the description of a device that another engine creates.

use std::ffi::{CStr, c_char};
use std::ptr;

use ash::vk::{self, StructureType, TaggedStructure};

use crate::error::{Error, Result};
use crate::gpu::caps::extension_features::ExtensionFeatures;
use crate::gpu::caps::features::{FeatureField, Features};
use crate::gpu::caps::invocation_reorder::{INVOCATION_REORDER_EXT, InvocationReorderFeatures};

/// The feature structures and extension names that a device needs for a context, as owned memory behind a
/// `VkDeviceCreateInfo`. [`DeviceRequirements::feature_chain`](crate::DeviceRequirements::feature_chain) creates it.
pub struct FeatureChain {
    wanted: Features,
    extensions: Vec<&'static CStr>,
    /// Extensions of the device that stand for features without a structure of their own.
    substitutes: Vec<&'static CStr>,
    core: vk::PhysicalDeviceFeatures,
    v11: vk::PhysicalDeviceVulkan11Features<'static>,
    v12: vk::PhysicalDeviceVulkan12Features<'static>,
    v13: vk::PhysicalDeviceVulkan13Features<'static>,
    ext: ExtensionFeatures,
    promoted: Promoted,
    names: Vec<*const c_char>,
}

impl FeatureChain {
    /// `available` returns true for the extensions of the device.
    pub(crate) fn new(
        wanted: Features,
        extensions: Vec<&'static CStr>,
        available: impl Fn(&CStr) -> bool,
    ) -> Self {
        let substitutes = SUBSTITUTES.iter().map(|(_, name)| *name).filter(|name| available(name)).collect();
        Self {
            wanted,
            extensions,
            substitutes,
            core: Default::default(),
            v11: Default::default(),
            v12: Default::default(),
            v13: Default::default(),
            ext: ExtensionFeatures::default(),
            promoted: Promoted::default(),
            names: Vec::new(),
        }
    }

    /// Returns `info` with the extensions and features of the library added. What `info` enables stays enabled.
    ///
    /// A feature is switched on in the structure of `info` that has it: `VkPhysicalDeviceFeatures2`,
    /// `VkPhysicalDeviceVulkan11Features` to `..13Features`, a structure of an extension, or the structure of a
    /// promoted extension, such as `VkPhysicalDeviceTimelineSemaphoreFeatures`. Structures that are missing are
    /// prepended to the chain. Those of Vulkan 1.1 to 1.3 are not prepended beside structures of promoted
    /// extensions, as Vulkan forbids both together; the missing structures of promoted extensions are. Structures
    /// that the library does not know are left alone.
    ///
    /// Core features may also be given in `pEnabledFeatures`. Without `VkPhysicalDeviceFeatures2` in the chain, the
    /// result points to a copy of these features in `self`, with those of the library added; the caller's structure is
    /// not written. Vulkan forbids both together.
    ///
    /// # Safety
    /// The pointers of `info` are valid for `'a`, those of its chain also for writing. Nothing else accesses the
    /// structures of the chain during the call.
    ///
    /// # Errors
    /// [`Unsupported`](Error::Unsupported) for a feature of Vulkan 1.2 that has no structure of a promoted
    /// extension, on a device without the extension that stands for it, where the chain of `info` rules out
    /// `VkPhysicalDeviceVulkan12Features`.
    pub unsafe fn merge_into<'a>(
        &'a mut self,
        mut info: vk::DeviceCreateInfo<'a>,
    ) -> Result<vk::DeviceCreateInfo<'a>> {
        // SAFETY: by the caller's promise.
        let (links, given) = unsafe { (chain_links(info.p_next), extension_names(&info)) };
        let mut names: Vec<&CStr> = given.iter().chain(&self.extensions).copied().collect();
        // SAFETY: as above.
        let mut merged = unsafe { read_chain(&links, info.p_enabled_features) };
        merged.enable_all(&self.wanted);
        // SAFETY: as above.
        unsafe { write_chain(&links, &merged) };
        let present: Vec<StructureType> = links.iter().map(|link| link.s_type).collect();
        if !present.contains(&<vk::PhysicalDeviceFeatures2<'_>>::STRUCTURE_TYPE) {
            self.core = merged.core;
            info.p_enabled_features = &raw const self.core;
        }
        let mut new_links = missing_extension_structures(&mut self.ext, &merged, &present, &names);
        let mut promoted = Vec::new();
        for version in [Version::V11, Version::V12, Version::V13] {
            if present.contains(&version.structure_type()) {
                continue;
            }
            if !present.iter().any(|found| promoted_version(*found) == Some(version)) {
                merged.enable_substituted(&names);
                new_links.push(match version {
                    Version::V11 => store(&mut self.v11, merged.v11),
                    Version::V12 => store(&mut self.v12, merged.v12),
                    Version::V13 => store(&mut self.v13, merged.v13),
                });
                continue;
            }
            promoted.push((version, merged));
            if version == Version::V12 {
                names.extend(substitutes(&self.wanted, &self.substitutes)?);
            }
        }
        // At once: a further reference to all places would end what was pointed to before.
        new_links.extend(self.promoted.missing(&promoted, &present));
        for link in new_links {
            // SAFETY: the structure lies in `self`, and no reference to it is in use.
            unsafe { (*link).p_next = info.p_next.cast_mut().cast() };
            info.p_next = link.cast_const().cast();
        }
        names.sort_unstable();
        names.dedup();
        self.names = names.into_iter().map(CStr::as_ptr).collect();
        Ok(info.enabled_extension_names(&self.names))
    }
}

/// Versions of Vulkan that collect the features of promoted extensions in one structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    V11,
    V12,
    V13,
}

impl Version {
    fn structure_type(self) -> StructureType {
        match self {
            Self::V11 => StructureType::PHYSICAL_DEVICE_VULKAN_1_1_FEATURES,
            Self::V12 => StructureType::PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
            Self::V13 => StructureType::PHYSICAL_DEVICE_VULKAN_1_3_FEATURES,
        }
    }
}

/// One structure of the caller's chain.
struct Link {
    s_type: StructureType,
    raw: *mut vk::BaseOutStructure<'static>,
}

/// Features of Vulkan 1.2 without a structure of a promoted extension, and the extensions that stand for them.
const SUBSTITUTES: [(FeatureField, &CStr); 4] = [
    (|f| &mut f.v12.sampler_mirror_clamp_to_edge, ash::khr::sampler_mirror_clamp_to_edge::NAME),
    (|f| &mut f.v12.draw_indirect_count, ash::khr::draw_indirect_count::NAME),
    (|f| &mut f.v12.sampler_filter_minmax, ash::ext::sampler_filter_minmax::NAME),
    (|f| &mut f.v12.shader_output_layer, ash::ext::shader_viewport_index_layer::NAME),
];

/// Returns the extensions for the enabled features that have no structure of a promoted extension.
fn substitutes(wanted: &Features, available: &[&'static CStr]) -> Result<Vec<&'static CStr>> {
    let mut wanted = *wanted;
    let on: Vec<_> = SUBSTITUTES.iter().filter(|(field, _)| *field(&mut wanted) == vk::TRUE).collect();
    match on.iter().find(|(_, name)| !available.contains(name)) {
        None => Ok(on.into_iter().map(|(_, name)| *name).collect()),
        Some((_, name)) => Err(Error::unsupported(
            "VkPhysicalDeviceVulkan12Features beside the structures of the given chain",
            format!(
                "the device lacks {}, which could stand for it; give the chain VkPhysicalDeviceVulkan12Features, or \
                 leave out the feature by DeviceRequirements::without",
                name.to_string_lossy()
            ),
        )),
    }
}

impl Features {
    /// Enables the features for which the extensions in `names` stand. Vulkan demands both or none.
    fn enable_substituted(&mut self, names: &[&CStr]) {
        for (field, _) in SUBSTITUTES.iter().filter(|(_, name)| names.contains(name)) {
            *field(self) = vk::TRUE;
        }
        let viewports = names.contains(&ash::ext::shader_viewport_index_layer::NAME);
        self.v12.shader_output_viewport_index |= vk::Bool32::from(viewports);
        let indexing = names.contains(&ash::ext::descriptor_indexing::NAME);
        self.v12.descriptor_indexing |= vk::Bool32::from(indexing);
        let draws = names.contains(&ash::khr::shader_draw_parameters::NAME);
        self.v11.shader_draw_parameters |= vk::Bool32::from(draws);
    }
}

/// # Safety
/// The chain is valid.
unsafe fn chain_links(head: *const std::ffi::c_void) -> Vec<Link> {
    let (mut links, mut next) = (Vec::new(), head.cast_mut().cast::<vk::BaseOutStructure<'static>>());
    while !next.is_null() {
        // SAFETY: by the caller's promise.
        let (s_type, following) = unsafe { ((*next).s_type, (*next).p_next) };
        links.push(Link { s_type, raw: next });
        next = following;
    }
    links
}

/// # Safety
/// The names of `info` are valid.
unsafe fn extension_names<'a>(info: &vk::DeviceCreateInfo<'a>) -> Vec<&'a CStr> {
    if info.enabled_extension_count == 0 || info.pp_enabled_extension_names.is_null() {
        return Vec::new();
    }
    let count = info.enabled_extension_count as usize;
    // SAFETY: by the caller's promise.
    let names = unsafe { std::slice::from_raw_parts(info.pp_enabled_extension_names, count) };
    // SAFETY: as above.
    names.iter().map(|name| unsafe { CStr::from_ptr(*name) }).collect()
}

/// Puts a value into a structure, and returns the structure as a link.
fn store<T: TaggedStructure>(place: &mut T, value: T) -> *mut vk::BaseOutStructure<'static> {
    *place = value;
    ptr::from_mut(place).cast()
}

/// Returns the features that the caller enables.
///
/// # Safety
/// The links and `core` are valid.
unsafe fn read_chain(links: &[Link], core: *const vk::PhysicalDeviceFeatures) -> Features {
    let mut all = Features::default();
    // SAFETY: by the caller's promise.
    if let Some(core) = unsafe { core.as_ref() } {
        all.core = *core;
    }
    for link in links {
        // SAFETY: as above; the type of a structure says what it is.
        unsafe {
            match link.s_type {
                StructureType::PHYSICAL_DEVICE_FEATURES_2 => {
                    all.core = (*link.raw.cast::<vk::PhysicalDeviceFeatures2<'_>>()).features;
                }
                StructureType::PHYSICAL_DEVICE_VULKAN_1_1_FEATURES => all.v11 = *link.raw.cast(),
                StructureType::PHYSICAL_DEVICE_VULKAN_1_2_FEATURES => all.v12 = *link.raw.cast(),
                StructureType::PHYSICAL_DEVICE_VULKAN_1_3_FEATURES => all.v13 = *link.raw.cast(),
                _ => {
                    read_extension(link, &mut all.ext);
                    read_promoted(link, &mut all);
                }
            }
        }
    }
    all
}

/// Writes the features to the structures that have them.
///
/// # Safety
/// The links are valid for writing.
unsafe fn write_chain(links: &[Link], all: &Features) {
    for link in links {
        // SAFETY: by the caller's promise; the type of a structure says what it is, and its successor stays.
        unsafe {
            match link.s_type {
                StructureType::PHYSICAL_DEVICE_FEATURES_2 => {
                    (*link.raw.cast::<vk::PhysicalDeviceFeatures2<'_>>()).features = all.core;
                }
                StructureType::PHYSICAL_DEVICE_VULKAN_1_1_FEATURES => replace(link, all.v11),
                StructureType::PHYSICAL_DEVICE_VULKAN_1_2_FEATURES => replace(link, all.v12),
                StructureType::PHYSICAL_DEVICE_VULKAN_1_3_FEATURES => replace(link, all.v13),
                _ => {
                    write_extension(link, &all.ext);
                    write_promoted(link, all);
                }
            }
        }
    }
}

/// Replaces a structure, and keeps its successor.
///
/// # Safety
/// The link is valid for writing, and a structure of the type.
unsafe fn replace<T: TaggedStructure>(link: &Link, value: T) {
    // SAFETY: by the caller's promise.
    unsafe {
        let next = (*link.raw).p_next;
        link.raw.cast::<T>().write(value);
        (*link.raw).p_next = next;
    }
}

/// The structures of extensions: the member of [`ExtensionFeatures`], its type and the name of the extension.
macro_rules! extension_structures {
    ($($member:ident: $type:ty, $extension:expr;)+) => {
        /// # Safety
        /// The link is valid.
        unsafe fn read_extension(link: &Link, all: &mut ExtensionFeatures) {
            match link.s_type {
                // SAFETY: by the caller's promise; the type of a structure says what it is.
                $(<$type>::STRUCTURE_TYPE => all.$member = unsafe { *link.raw.cast() },)+
                _ => {}
            }
        }

        /// # Safety
        /// The link is valid for writing.
        unsafe fn write_extension(link: &Link, all: &ExtensionFeatures) {
            match link.s_type {
                // SAFETY: as above.
                $(<$type>::STRUCTURE_TYPE => unsafe { replace(link, all.$member) },)+
                _ => {}
            }
        }

        /// Stores the structures of the extensions in `names` that are not present, and returns them as links.
        fn missing_extension_structures(
            place: &mut ExtensionFeatures,
            all: &Features,
            present: &[StructureType],
            names: &[&CStr],
        ) -> Vec<*mut vk::BaseOutStructure<'static>> {
            let mut links = Vec::new();
            $(if names.contains(&$extension)
                && !present.contains(&<$type>::STRUCTURE_TYPE)
            {
                links.push(store(&mut place.$member, all.ext.$member));
            })+
            links
        }
    };
}

extension_structures! {
    structures: vk::PhysicalDeviceAccelerationStructureFeaturesKHR<'_>, ash::khr::acceleration_structure::NAME;
    ray_tracing: vk::PhysicalDeviceRayTracingPipelineFeaturesKHR<'_>, ash::khr::ray_tracing_pipeline::NAME;
    ray_query: vk::PhysicalDeviceRayQueryFeaturesKHR<'_>, ash::khr::ray_query::NAME;
    position_fetch: vk::PhysicalDeviceRayTracingPositionFetchFeaturesKHR<'_>, ash::khr::ray_tracing_position_fetch::NAME;
    mesh: vk::PhysicalDeviceMeshShaderFeaturesEXT<'_>, ash::ext::mesh_shader::NAME;
    float_atomics: vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT<'_>, ash::ext::shader_atomic_float::NAME;
    local_read: vk::PhysicalDeviceDynamicRenderingLocalReadFeaturesKHR<'_>, ash::khr::dynamic_rendering_local_read::NAME;
    shading_rate: vk::PhysicalDeviceFragmentShadingRateFeaturesKHR<'_>, ash::khr::fragment_shading_rate::NAME;
    barycentrics: vk::PhysicalDeviceFragmentShaderBarycentricFeaturesKHR<'_>, ash::khr::fragment_shader_barycentric::NAME;
    index_uint8: vk::PhysicalDeviceIndexTypeUint8FeaturesKHR<'_>, ash::khr::index_type_uint8::NAME;
    border_color: vk::PhysicalDeviceCustomBorderColorFeaturesEXT<'_>, ash::ext::custom_border_color::NAME;
    host_image_copy: vk::PhysicalDeviceHostImageCopyFeaturesEXT<'_>, ash::ext::host_image_copy::NAME;
    maintenance5: vk::PhysicalDeviceMaintenance5FeaturesKHR<'_>, ash::khr::maintenance5::NAME;
    graphics_library: vk::PhysicalDeviceGraphicsPipelineLibraryFeaturesEXT<'_>, ash::ext::graphics_pipeline_library::NAME;
    fault: vk::PhysicalDeviceFaultFeaturesEXT<'_>, ash::ext::device_fault::NAME;
    invocation_reorder: InvocationReorderFeatures, INVOCATION_REORDER_EXT;
    invocation_reorder_nv: vk::PhysicalDeviceRayTracingInvocationReorderFeaturesNV<'_>, ash::nv::ray_tracing_invocation_reorder::NAME;
    ray_tracing_maintenance1: vk::PhysicalDeviceRayTracingMaintenance1FeaturesKHR<'_>, ash::khr::ray_tracing_maintenance1::NAME;
    micromaps: vk::PhysicalDeviceOpacityMicromapFeaturesEXT<'_>, ash::ext::opacity_micromap::NAME;
    swapchain_maintenance1: vk::PhysicalDeviceSwapchainMaintenance1FeaturesEXT<'_>, ash::ext::swapchain_maintenance1::NAME;
    portability: vk::PhysicalDevicePortabilitySubsetFeaturesKHR<'_>, ash::khr::portability_subset::NAME;
}

/// The structures of promoted extensions: the version with their features, and these features.
macro_rules! promoted_structures {
    ($($version:ident $features:ident $member:ident: $type:ident { $($field:ident),+ })+) => {
        /// A place for each structure.
        #[derive(Default)]
        struct Promoted {
            $($member: vk::$type<'static>,)+
        }

        /// Returns the version that has the features of a structure; `None` for other structures.
        fn promoted_version(found: StructureType) -> Option<Version> {
            match found {
                $(<vk::$type<'_>>::STRUCTURE_TYPE => Some(Version::$version),)+
                _ => None,
            }
        }

        /// # Safety
        /// The link is valid.
        unsafe fn read_promoted(link: &Link, all: &mut Features) {
            match link.s_type {
                $(<vk::$type<'_>>::STRUCTURE_TYPE => {
                    // SAFETY: by the caller's promise; the type of a structure says what it is.
                    let found = unsafe { &*link.raw.cast::<vk::$type<'_>>() };
                    $(all.$features.$field |= found.$field;)+
                })+
                _ => {}
            }
        }

        /// # Safety
        /// The link is valid for writing.
        unsafe fn write_promoted(link: &Link, all: &Features) {
            match link.s_type {
                $(<vk::$type<'_>>::STRUCTURE_TYPE => {
                    // SAFETY: as above.
                    let found = unsafe { &mut *link.raw.cast::<vk::$type<'_>>() };
                    $(found.$field |= all.$features.$field;)+
                })+
                _ => {}
            }
        }

        impl Promoted {
            /// Stores the structures of some versions that are not present and have one of the version's features on, and
            /// returns them as links.
            fn missing(
                &mut self,
                versions: &[(Version, Features)],
                present: &[StructureType],
            ) -> Vec<*mut vk::BaseOutStructure<'static>> {
                let mut links = Vec::new();
                $(if let Some((_, all)) = versions.iter().find(|(version, _)| *version == Version::$version)
                    && !present.contains(&<vk::$type<'_>>::STRUCTURE_TYPE)
                    && ($(all.$features.$field)|+) == vk::TRUE
                {
                    let value = vk::$type { $($field: all.$features.$field,)+ ..Default::default() };
                    links.push(store(&mut self.$member, value));
                })+
                links
            }
        }
    };
}

promoted_structures! {
    V11 v11 storage16: PhysicalDevice16BitStorageFeatures {
        storage_buffer16_bit_access, uniform_and_storage_buffer16_bit_access, storage_push_constant16,
        storage_input_output16
    }
    V11 v11 multiview: PhysicalDeviceMultiviewFeatures {
        multiview, multiview_geometry_shader, multiview_tessellation_shader
    }
    V11 v11 variable_pointers: PhysicalDeviceVariablePointersFeatures {
        variable_pointers_storage_buffer, variable_pointers
    }
    V11 v11 protected_memory: PhysicalDeviceProtectedMemoryFeatures { protected_memory }
    V11 v11 ycbcr: PhysicalDeviceSamplerYcbcrConversionFeatures { sampler_ycbcr_conversion }
    V11 v11 draw_parameters: PhysicalDeviceShaderDrawParametersFeatures { shader_draw_parameters }
    V12 v12 storage8: PhysicalDevice8BitStorageFeatures {
        storage_buffer8_bit_access, uniform_and_storage_buffer8_bit_access, storage_push_constant8
    }
    V12 v12 int64_atomics: PhysicalDeviceShaderAtomicInt64Features {
        shader_buffer_int64_atomics, shader_shared_int64_atomics
    }
    V12 v12 small_types: PhysicalDeviceShaderFloat16Int8Features { shader_float16, shader_int8 }
    V12 v12 indexing: PhysicalDeviceDescriptorIndexingFeatures {
        shader_input_attachment_array_dynamic_indexing, shader_uniform_texel_buffer_array_dynamic_indexing,
        shader_storage_texel_buffer_array_dynamic_indexing, shader_uniform_buffer_array_non_uniform_indexing,
        shader_sampled_image_array_non_uniform_indexing, shader_storage_buffer_array_non_uniform_indexing,
        shader_storage_image_array_non_uniform_indexing, shader_input_attachment_array_non_uniform_indexing,
        shader_uniform_texel_buffer_array_non_uniform_indexing,
        shader_storage_texel_buffer_array_non_uniform_indexing,
        descriptor_binding_uniform_buffer_update_after_bind, descriptor_binding_sampled_image_update_after_bind,
        descriptor_binding_storage_image_update_after_bind, descriptor_binding_storage_buffer_update_after_bind,
        descriptor_binding_uniform_texel_buffer_update_after_bind,
        descriptor_binding_storage_texel_buffer_update_after_bind,
        descriptor_binding_update_unused_while_pending, descriptor_binding_partially_bound,
        descriptor_binding_variable_descriptor_count, runtime_descriptor_array
    }
    V12 v12 scalar_layout: PhysicalDeviceScalarBlockLayoutFeatures { scalar_block_layout }
    V12 v12 imageless: PhysicalDeviceImagelessFramebufferFeatures { imageless_framebuffer }
    V12 v12 uniform_layout: PhysicalDeviceUniformBufferStandardLayoutFeatures { uniform_buffer_standard_layout }
    V12 v12 subgroup_types: PhysicalDeviceShaderSubgroupExtendedTypesFeatures { shader_subgroup_extended_types }
    V12 v12 depth_layouts: PhysicalDeviceSeparateDepthStencilLayoutsFeatures { separate_depth_stencil_layouts }
    V12 v12 query_reset: PhysicalDeviceHostQueryResetFeatures { host_query_reset }
    V12 v12 timelines: PhysicalDeviceTimelineSemaphoreFeatures { timeline_semaphore }
    V12 v12 addresses: PhysicalDeviceBufferDeviceAddressFeatures {
        buffer_device_address, buffer_device_address_capture_replay, buffer_device_address_multi_device
    }
    V12 v12 memory_model: PhysicalDeviceVulkanMemoryModelFeatures {
        vulkan_memory_model, vulkan_memory_model_device_scope, vulkan_memory_model_availability_visibility_chains
    }
    V13 v13 image_robustness: PhysicalDeviceImageRobustnessFeatures { robust_image_access }
    V13 v13 inline_blocks: PhysicalDeviceInlineUniformBlockFeatures {
        inline_uniform_block, descriptor_binding_inline_uniform_block_update_after_bind
    }
    V13 v13 cache_control: PhysicalDevicePipelineCreationCacheControlFeatures { pipeline_creation_cache_control }
    V13 v13 private_data: PhysicalDevicePrivateDataFeatures { private_data }
    V13 v13 demote: PhysicalDeviceShaderDemoteToHelperInvocationFeatures { shader_demote_to_helper_invocation }
    V13 v13 terminate: PhysicalDeviceShaderTerminateInvocationFeatures { shader_terminate_invocation }
    V13 v13 subgroup_size: PhysicalDeviceSubgroupSizeControlFeatures {
        subgroup_size_control, compute_full_subgroups
    }
    V13 v13 synchronization: PhysicalDeviceSynchronization2Features { synchronization2 }
    V13 v13 astc_hdr: PhysicalDeviceTextureCompressionASTCHDRFeatures { texture_compression_astc_hdr }
    V13 v13 zero_memory: PhysicalDeviceZeroInitializeWorkgroupMemoryFeatures {
        shader_zero_initialize_workgroup_memory
    }
    V13 v13 dynamic_rendering: PhysicalDeviceDynamicRenderingFeatures { dynamic_rendering }
    V13 v13 dot_product: PhysicalDeviceShaderIntegerDotProductFeatures { shader_integer_dot_product }
    V13 v13 maintenance4: PhysicalDeviceMaintenance4Features { maintenance4 }
}

#[cfg(test)]
mod tests;
