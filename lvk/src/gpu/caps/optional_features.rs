//! The optional features of devices. Each entry lists the Vulkan name, the extension and the structure field.

use std::ffi::CStr;
use std::fmt;

use ash::vk;

use super::features::{FeatureField, Features};
use super::invocation_reorder::INVOCATION_REORDER_EXT;

/// A feature that some devices have and the library does not need. It is enabled wherever the device has it,
/// unless a [`DeviceProfile`](crate::DeviceProfile) hides it. [`Capabilities::has`](crate::Capabilities::has)
/// returns true if it is enabled. Ray tracing and mesh shaders have separate flags. The features of
/// [`FeatureSet::PORTABILITY`] are promised by Vulkan: only devices that implement a subset of Vulkan lack some.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum OptionalFeature {
    /// Indices above 2^24 - 1 (`fullDrawIndexUint32`).
    FullDrawIndex,
    /// Arrays of cube textures can be created and sampled (`imageCubeArray`).
    CubeArrays,
    /// The geometry stage, and `gl_PrimitiveID` in fragment shaders (`geometryShader`).
    GeometryShader,
    /// The two tessellation stages (`tessellationShader`).
    TessellationShader,
    /// Fragment shaders that run once per sample (`sampleRateShading`).
    SampleRateShading,
    /// Blend factors from a second output of the fragment shader (`dualSrcBlend`).
    DualSourceBlend,
    /// Several draws from one indirect Vulkan command (`multiDrawIndirect`).
    MultiDrawIndirect,
    /// Indirect draws whose first instance is not 0 (`drawIndirectFirstInstance`).
    DrawIndirectFirstInstance,
    /// Indirect draws with a draw count from a buffer (`drawIndirectCount`).
    DrawIndirectCount,
    /// Depths outside the range are clamped instead of clipped (`depthClamp`).
    DepthClamp,
    /// Depth biases with a clamp value (`depthBiasClamp`).
    DepthBiasClamp,
    /// Polygons drawn as lines or points (`fillModeNonSolid`).
    FillModeNonSolid,
    /// Line widths other than 1 (`wideLines`).
    WideLines,
    /// Point sizes other than 1 (`largePoints`).
    LargePoints,
    /// Anisotropic filtering (`samplerAnisotropy`).
    SamplerAnisotropy,
    /// Formats BC1 to BC7 (`textureCompressionBC`).
    TextureCompressionBc,
    /// ETC2 and EAC formats (`textureCompressionETC2`).
    TextureCompressionEtc2,
    /// ASTC formats of low dynamic range (`textureCompressionASTC_LDR`).
    TextureCompressionAstcLdr,
    /// ASTC formats of high dynamic range (`textureCompressionASTC_HDR`).
    TextureCompressionAstcHdr,
    /// Occlusion queries that count samples exactly (`occlusionQueryPrecise`).
    OcclusionQueryPrecise,
    /// Queries that count the work of pipeline stages (`pipelineStatisticsQuery`).
    PipelineStatisticsQuery,
    /// Stores and atomics in vertex, tessellation and geometry shaders (`vertexPipelineStoresAndAtomics`).
    VertexStoresAndAtomics,
    /// `gl_PointSize` in the tessellation and geometry stages
    /// (`shaderTessellationAndGeometryPointSize`).
    TessellationAndGeometryPointSize,
    /// Gathers with offsets that are not constant (`shaderImageGatherExtended`).
    ImageGatherExtended,
    /// Additional formats in the declarations of storage images (`shaderStorageImageExtendedFormats`).
    StorageImageExtendedFormats,
    /// Multisampled storage images (`shaderStorageImageMultisample`).
    StorageImageMultisample,
    /// Reads of storage images without a format in the shader (`shaderStorageImageReadWithoutFormat`).
    StorageImageReadWithoutFormat,
    /// `gl_ClipDistance` (`shaderClipDistance`).
    ClipDistance,
    /// `gl_CullDistance` (`shaderCullDistance`).
    CullDistance,
    /// 64-bit floats in shaders (`shaderFloat64`).
    Float64,
    /// 64-bit integers in shaders (`shaderInt64`).
    Int64,
    /// 16-bit integers in shaders (`shaderInt16`).
    Int16,
    /// 16-bit floats in shaders (`shaderFloat16`).
    Float16,
    /// 8-bit integers in shaders (`shaderInt8`).
    Int8,
    /// Texture samples with a minimum level of detail (`shaderResourceMinLod`).
    MinLod,
    /// 16-bit values in buffers (`storageBuffer16BitAccess`).
    StorageBuffer16Bit,
    /// 16-bit values in uniform blocks too (`uniformAndStorageBuffer16BitAccess`).
    UniformBuffer16Bit,
    /// 16-bit push constants (`storagePushConstant16`).
    PushConstant16Bit,
    /// 16-bit values between stages (`storageInputOutput16`).
    InputOutput16Bit,
    /// 8-bit values in buffers (`storageBuffer8BitAccess`).
    StorageBuffer8Bit,
    /// 8-bit values in uniform blocks too (`uniformAndStorageBuffer8BitAccess`).
    UniformBuffer8Bit,
    /// 8-bit push constants (`storagePushConstant8`).
    PushConstant8Bit,
    /// Pointers into one buffer as values (`variablePointersStorageBuffer`).
    VariablePointersStorageBuffer,
    /// Pointers into buffers and shared memory as values (`variablePointers`).
    VariablePointers,
    /// `gl_DrawID`, `gl_BaseVertex` and `gl_BaseInstance` (`shaderDrawParameters`).
    DrawParameters,
    /// Render passes that draw several views at once (`multiview`).
    Multiview,
    /// Geometry shaders in multiview passes (`multiviewGeometryShader`).
    MultiviewGeometry,
    /// Tessellation in multiview passes (`multiviewTessellationShader`).
    MultiviewTessellation,
    /// Mesh shaders in multiview passes (`multiviewMeshShader`).
    MultiviewMesh,
    /// Pipeline statistics of task and mesh shaders (`meshShaderQueries`).
    MeshShaderQueries,
    /// Textures in Y'CbCr formats (`samplerYcbcrConversion`).
    YcbcrConversion,
    /// Texture addresses mirrored once (`samplerMirrorClampToEdge`).
    MirrorClampToEdge,
    /// Filters that return the minimum or maximum texel (`samplerFilterMinmax`).
    FilterMinMax,
    /// Atomic operations on 64-bit integers in buffers (`shaderBufferInt64Atomics`).
    BufferInt64Atomics,
    /// Atomic operations on 64-bit integers in shared memory (`shaderSharedInt64Atomics`).
    SharedInt64Atomics,
    /// `gl_Layer` written by vertex and tessellation shaders (`shaderOutputLayer`).
    ShaderOutputLayer,
    /// Atomic loads, stores and exchanges of floats in buffers (`shaderBufferFloat32Atomics`).
    BufferFloatAtomics,
    /// Atomic additions of floats in buffers (`shaderBufferFloat32AtomicAdd`).
    BufferFloatAtomicAdd,
    /// Atomic loads, stores and exchanges of floats in shared memory (`shaderSharedFloat32Atomics`).
    SharedFloatAtomics,
    /// Atomic additions of floats in shared memory (`shaderSharedFloat32AtomicAdd`).
    SharedFloatAtomicAdd,
    /// Atomic loads, stores and exchanges of floats in storage images (`shaderImageFloat32Atomics`).
    ImageFloatAtomics,
    /// Atomic additions of floats in storage images (`shaderImageFloat32AtomicAdd`).
    ImageFloatAtomicAdd,
    /// Fragment shaders that read the attachments of their own pass (`dynamicRenderingLocalRead`).
    LocalRead,
    /// Fragments of several pixels, by pipeline or draw (`pipelineFragmentShadingRate`).
    PipelineShadingRate,
    /// Fragments of several pixels, by primitive (`primitiveFragmentShadingRate`).
    PrimitiveShadingRate,
    /// Fragments of several pixels, by an attachment (`attachmentFragmentShadingRate`).
    AttachmentShadingRate,
    /// Fragments of several pixels, by primitives of mesh shaders (`primitiveFragmentShadingRateMeshShader`).
    MeshPrimitiveShadingRate,
    /// `gl_BaryCoordEXT` in fragment shaders (`fragmentShaderBarycentric`).
    Barycentrics,
    /// 8-bit indices (`indexTypeUint8`).
    IndexTypeUint8,
    /// Arbitrary border colours of samplers (`customBorderColors`).
    CustomBorderColors,
    /// Arbitrary border colours for samplers without a format (`customBorderColorWithoutFormat`).
    CustomBorderColorWithoutFormat,
    /// Texels copied by the host, without a copy on the GPU (`hostImageCopy`).
    HostImageCopy,
    /// Formats A8 and A1B5G5R5, and the other features of `maintenance5`.
    Maintenance5,
    /// Clocks of device and host that can be read together (`VK_KHR_calibrated_timestamps` or
    /// `VK_EXT_calibrated_timestamps`).
    CalibratedTimestamps,
    /// Budget and use of each memory heap (`VK_EXT_memory_budget`).
    MemoryBudget,
    /// Graphics pipelines that are linked from parts (`graphicsPipelineLibrary`).
    GraphicsPipelineLibrary,
    /// Compute pipelines that choose the size of their subgroups (`subgroupSizeControl`).
    SubgroupSizeControl,
    /// Compute pipelines whose subgroups are full (`computeFullSubgroups`).
    ComputeFullSubgroups,
    /// Fault report of a lost device (`deviceFault`).
    DeviceFault,
    /// Presenting to windows (`VK_KHR_swapchain`).
    Swapchain,
    /// Fences and present modes for each present (`swapchainMaintenance1`).
    SwapchainMaintenance1,
    /// HDR metadata for the display of a window (`VK_EXT_hdr_metadata`).
    HdrMetadata,
    /// Invocations of ray tracing shaders that are sorted by their hits, by `GL_EXT_shader_invocation_reorder`
    /// (`rayTracingInvocationReorder` of `VK_EXT_ray_tracing_invocation_reorder`). Only devices with ray tracing
    /// pipelines have it.
    InvocationReorder,
    /// The same by `GL_NV_shader_invocation_reorder` (`VK_NV_ray_tracing_invocation_reorder`).
    InvocationReorderNv,
    /// The cull mask of a ray in shaders of ray tracing pipelines, `gl_CullMaskEXT` of `GL_EXT_ray_cull_mask`
    /// (`rayTracingMaintenance1` of `VK_KHR_ray_tracing_maintenance1`). Lowered pipelines need no feature for it.
    RayTracingMaintenance1,
    /// Opacity micromaps of triangles (`micromap` of `VK_EXT_opacity_micromap`):
    /// [`Context::create_opacity_micromap`](crate::Context::create_opacity_micromap). Only devices that build
    /// acceleration structures have it.
    OpacityMicromaps,
    /// Blend factors of colour that take the alpha of the blend constant (`constantAlphaColorBlendFactors`).
    ConstantAlphaColorBlend,
    /// Vulkan events (`events`). The library itself uses none.
    Events,
    /// Views whose format has other components than the texture, or components of other sizes
    /// (`imageViewFormatReinterpretation`).
    ViewFormatReinterpretation,
    /// Swizzles of views (`imageViewFormatSwizzle`).
    ViewSwizzle,
    /// 2D views of 3D textures, through which passes draw to slices (`imageView2DOn3DImage`).
    View2dOf3d,
    /// Arrays of multisampled textures (`multisampleArrayImage`).
    MultisampledArrays,
    /// Comparison samplers in the bindless set (`mutableComparisonSamplers`).
    ComparisonSamplers,
    /// Polygons drawn as points (`pointPolygons`).
    PointPolygons,
    /// Biases of the level of detail in samplers (`samplerMipLodBias`).
    SamplerLodBias,
    /// Different stencil references of front and back faces (`separateStencilMaskRef`).
    SeparateStencilReference,
    /// `interpolateAtOffset`, `interpolateAtSample` and `interpolateAtCentroid` in fragment shaders
    /// (`shaderSampleRateInterpolationFunctions`).
    SampleInterpolation,
    /// Tessellation of patches into lines (`tessellationIsolines`).
    TessellationIsolines,
    /// Tessellation of patches into points (`tessellationPointMode`).
    TessellationPointMode,
    /// Triangle fans (`triangleFans`).
    TriangleFans,
    /// Vertex attributes that end beyond the stride (`vertexAttributeAccessBeyondStride`). The library refuses
    /// them on every device.
    VertexAccessBeyondStride,
    /// Memory shared by file descriptors (`VK_KHR_external_memory_fd`).
    ExternalMemoryFd,
    /// Memory shared as Linux dma-bufs (`VK_EXT_external_memory_dma_buf`).
    ExternalMemoryDmaBuf,
    /// Semaphores shared by file descriptors (`VK_KHR_external_semaphore_fd`).
    ExternalSemaphoreFd,
    /// Images whose memory layout a DRM format modifier describes (`VK_EXT_image_drm_format_modifier`). Textures in
    /// dma-bufs need them.
    DrmFormatModifier,
}

use OptionalFeature as F;

impl OptionalFeature {
    /// Returns all optional features.
    pub fn all() -> impl ExactSizeIterator<Item = Self> {
        ROWS.iter().map(|row| row.feature)
    }

    /// Returns the Vulkan name: the member of a feature structure, or the extension if it has no feature
    /// structure.
    pub fn vulkan_name(self) -> &'static str {
        self.table_row().name
    }

    /// Returns the members of all optional features.
    pub(super) fn fields() -> impl Iterator<Item = FeatureField> {
        ROWS.iter().map(|row| row.field)
    }

    fn table_row(self) -> &'static FeatureRow {
        &ROWS[self as usize]
    }

    fn bit(self) -> u128 {
        1 << self as u32
    }
}

/// A set of [`OptionalFeature`]s.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
pub struct FeatureSet(u128);

impl FeatureSet {
    /// The empty set.
    pub const NONE: Self = Self(0);
    /// The set of all features, including those of later versions.
    pub const ALL: Self = Self(u128::MAX);
    /// The features that Vulkan promises, except on devices with `VK_KHR_portability_subset`
    /// ([`Capabilities::portability_subset`](crate::Capabilities::portability_subset)).
    pub const PORTABILITY: Self = Self(
        ((2 << F::VertexAccessBeyondStride as u32) - 1) & !((1 << F::ConstantAlphaColorBlend as u32) - 1),
    );

    /// True if the set contains `feature`.
    pub fn contains(self, feature: OptionalFeature) -> bool {
        self.0 & feature.bit() != 0
    }

    /// Returns the set with `feature` added.
    #[must_use]
    pub fn with(self, feature: OptionalFeature) -> Self {
        Self(self.0 | feature.bit())
    }

    /// Returns the set without the features of `other`.
    #[must_use]
    pub fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Returns the features of the set, in the order of [`OptionalFeature::all`].
    pub fn iter(self) -> impl Iterator<Item = OptionalFeature> {
        OptionalFeature::all().filter(move |feature| self.contains(*feature))
    }

    /// Returns the features enabled in `features` whose requirements are enabled too.
    pub(crate) fn from_features(features: &Features) -> Self {
        let mut features = *features;
        let on = ROWS.iter().filter(|row| *(row.field)(&mut features) == vk::TRUE);
        on.map(|row| row.feature).collect::<Self>().without_unmet_requirements()
    }

    /// Returns the set without features whose requirement is missing; Vulkan forbids enabling those.
    #[must_use]
    pub(crate) fn without_unmet_requirements(self) -> Self {
        let orphans = REQUIREMENTS.into_iter().filter(|(_, needs)| !self.contains(*needs));
        self.without(orphans.map(|(feature, _)| feature).collect())
    }

    /// Copies the features of the set from `found` to `wanted`.
    pub(crate) fn enable(self, wanted: &mut Features, found: &Features) {
        let mut found = *found;
        for row in self.iter().map(OptionalFeature::table_row) {
            *(row.field)(wanted) = *(row.field)(&mut found);
        }
    }

    /// Returns the extensions of the features. The result may contain duplicates.
    pub(crate) fn extensions(self) -> impl Iterator<Item = &'static CStr> {
        self.iter().filter_map(|feature| feature.table_row().extension)
    }
}

impl FromIterator<OptionalFeature> for FeatureSet {
    fn from_iter<I: IntoIterator<Item = OptionalFeature>>(features: I) -> Self {
        features.into_iter().fold(Self::NONE, Self::with)
    }
}

impl fmt::Debug for FeatureSet {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_set().entries(self.iter()).finish()
    }
}

/// Features of mesh shaders, which have a separate flag.
pub(crate) const OF_MESH_SHADERS: [OptionalFeature; 3] =
    [F::MultiviewMesh, F::MeshShaderQueries, F::MeshPrimitiveShadingRate];

/// Features of ray tracing pipelines, which have a separate flag.
pub(crate) const OF_RAY_TRACING_PIPELINES: [OptionalFeature; 3] =
    [F::InvocationReorder, F::InvocationReorderNv, F::RayTracingMaintenance1];

/// Features of presentation, available only if the instance has surface extensions.
pub(crate) const OF_WINDOWS: [OptionalFeature; 3] = [F::Swapchain, F::SwapchainMaintenance1, F::HdrMetadata];

/// Pairs of a feature and the feature that it requires in Vulkan.
const REQUIREMENTS: [(OptionalFeature, OptionalFeature); 10] = [
    (F::MultiviewGeometry, F::Multiview),
    (F::MultiviewTessellation, F::Multiview),
    (F::MultiviewMesh, F::Multiview),
    (F::MeshShaderQueries, F::PipelineStatisticsQuery),
    (F::MeshPrimitiveShadingRate, F::PrimitiveShadingRate),
    (F::CustomBorderColorWithoutFormat, F::CustomBorderColors),
    (F::SwapchainMaintenance1, F::Swapchain),
    (F::HdrMetadata, F::Swapchain),
    (F::VariablePointers, F::VariablePointersStorageBuffer),
    (F::ExternalMemoryDmaBuf, F::ExternalMemoryFd),
];

struct FeatureRow {
    feature: OptionalFeature,
    name: &'static str,
    extension: Option<&'static CStr>,
    field: FeatureField,
}

#[rustfmt::skip]
const ROWS: [FeatureRow; 105] = [
    FeatureRow { feature: F::FullDrawIndex, name: "fullDrawIndexUint32", extension: None, field: |f| &mut f.core.full_draw_index_uint32 },
    FeatureRow { feature: F::CubeArrays, name: "imageCubeArray", extension: None, field: |f| &mut f.core.image_cube_array },
    FeatureRow { feature: F::GeometryShader, name: "geometryShader", extension: None, field: |f| &mut f.core.geometry_shader },
    FeatureRow { feature: F::TessellationShader, name: "tessellationShader", extension: None, field: |f| &mut f.core.tessellation_shader },
    FeatureRow { feature: F::SampleRateShading, name: "sampleRateShading", extension: None, field: |f| &mut f.core.sample_rate_shading },
    FeatureRow { feature: F::DualSourceBlend, name: "dualSrcBlend", extension: None, field: |f| &mut f.core.dual_src_blend },
    FeatureRow { feature: F::MultiDrawIndirect, name: "multiDrawIndirect", extension: None, field: |f| &mut f.core.multi_draw_indirect },
    FeatureRow { feature: F::DrawIndirectFirstInstance, name: "drawIndirectFirstInstance", extension: None, field: |f| &mut f.core.draw_indirect_first_instance },
    FeatureRow { feature: F::DrawIndirectCount, name: "drawIndirectCount", extension: None, field: |f| &mut f.v12.draw_indirect_count },
    FeatureRow { feature: F::DepthClamp, name: "depthClamp", extension: None, field: |f| &mut f.core.depth_clamp },
    FeatureRow { feature: F::DepthBiasClamp, name: "depthBiasClamp", extension: None, field: |f| &mut f.core.depth_bias_clamp },
    FeatureRow { feature: F::FillModeNonSolid, name: "fillModeNonSolid", extension: None, field: |f| &mut f.core.fill_mode_non_solid },
    FeatureRow { feature: F::WideLines, name: "wideLines", extension: None, field: |f| &mut f.core.wide_lines },
    FeatureRow { feature: F::LargePoints, name: "largePoints", extension: None, field: |f| &mut f.core.large_points },
    FeatureRow { feature: F::SamplerAnisotropy, name: "samplerAnisotropy", extension: None, field: |f| &mut f.core.sampler_anisotropy },
    FeatureRow { feature: F::TextureCompressionBc, name: "textureCompressionBC", extension: None, field: |f| &mut f.core.texture_compression_bc },
    FeatureRow { feature: F::TextureCompressionEtc2, name: "textureCompressionETC2", extension: None, field: |f| &mut f.core.texture_compression_etc2 },
    FeatureRow { feature: F::TextureCompressionAstcLdr, name: "textureCompressionASTC_LDR", extension: None, field: |f| &mut f.core.texture_compression_astc_ldr },
    FeatureRow { feature: F::TextureCompressionAstcHdr, name: "textureCompressionASTC_HDR", extension: None, field: |f| &mut f.v13.texture_compression_astc_hdr },
    FeatureRow { feature: F::OcclusionQueryPrecise, name: "occlusionQueryPrecise", extension: None, field: |f| &mut f.core.occlusion_query_precise },
    FeatureRow { feature: F::PipelineStatisticsQuery, name: "pipelineStatisticsQuery", extension: None, field: |f| &mut f.core.pipeline_statistics_query },
    FeatureRow { feature: F::VertexStoresAndAtomics, name: "vertexPipelineStoresAndAtomics", extension: None, field: |f| &mut f.core.vertex_pipeline_stores_and_atomics },
    FeatureRow { feature: F::TessellationAndGeometryPointSize, name: "shaderTessellationAndGeometryPointSize", extension: None, field: |f| &mut f.core.shader_tessellation_and_geometry_point_size },
    FeatureRow { feature: F::ImageGatherExtended, name: "shaderImageGatherExtended", extension: None, field: |f| &mut f.core.shader_image_gather_extended },
    FeatureRow { feature: F::StorageImageExtendedFormats, name: "shaderStorageImageExtendedFormats", extension: None, field: |f| &mut f.core.shader_storage_image_extended_formats },
    FeatureRow { feature: F::StorageImageMultisample, name: "shaderStorageImageMultisample", extension: None, field: |f| &mut f.core.shader_storage_image_multisample },
    FeatureRow { feature: F::StorageImageReadWithoutFormat, name: "shaderStorageImageReadWithoutFormat", extension: None, field: |f| &mut f.core.shader_storage_image_read_without_format },
    FeatureRow { feature: F::ClipDistance, name: "shaderClipDistance", extension: None, field: |f| &mut f.core.shader_clip_distance },
    FeatureRow { feature: F::CullDistance, name: "shaderCullDistance", extension: None, field: |f| &mut f.core.shader_cull_distance },
    FeatureRow { feature: F::Float64, name: "shaderFloat64", extension: None, field: |f| &mut f.core.shader_float64 },
    FeatureRow { feature: F::Int64, name: "shaderInt64", extension: None, field: |f| &mut f.core.shader_int64 },
    FeatureRow { feature: F::Int16, name: "shaderInt16", extension: None, field: |f| &mut f.core.shader_int16 },
    FeatureRow { feature: F::Float16, name: "shaderFloat16", extension: None, field: |f| &mut f.v12.shader_float16 },
    FeatureRow { feature: F::Int8, name: "shaderInt8", extension: None, field: |f| &mut f.v12.shader_int8 },
    FeatureRow { feature: F::MinLod, name: "shaderResourceMinLod", extension: None, field: |f| &mut f.core.shader_resource_min_lod },
    FeatureRow { feature: F::StorageBuffer16Bit, name: "storageBuffer16BitAccess", extension: None, field: |f| &mut f.v11.storage_buffer16_bit_access },
    FeatureRow { feature: F::UniformBuffer16Bit, name: "uniformAndStorageBuffer16BitAccess", extension: None, field: |f| &mut f.v11.uniform_and_storage_buffer16_bit_access },
    FeatureRow { feature: F::PushConstant16Bit, name: "storagePushConstant16", extension: None, field: |f| &mut f.v11.storage_push_constant16 },
    FeatureRow { feature: F::InputOutput16Bit, name: "storageInputOutput16", extension: None, field: |f| &mut f.v11.storage_input_output16 },
    FeatureRow { feature: F::StorageBuffer8Bit, name: "storageBuffer8BitAccess", extension: None, field: |f| &mut f.v12.storage_buffer8_bit_access },
    FeatureRow { feature: F::UniformBuffer8Bit, name: "uniformAndStorageBuffer8BitAccess", extension: None, field: |f| &mut f.v12.uniform_and_storage_buffer8_bit_access },
    FeatureRow { feature: F::PushConstant8Bit, name: "storagePushConstant8", extension: None, field: |f| &mut f.v12.storage_push_constant8 },
    FeatureRow { feature: F::VariablePointersStorageBuffer, name: "variablePointersStorageBuffer", extension: None, field: |f| &mut f.v11.variable_pointers_storage_buffer },
    FeatureRow { feature: F::VariablePointers, name: "variablePointers", extension: None, field: |f| &mut f.v11.variable_pointers },
    FeatureRow { feature: F::DrawParameters, name: "shaderDrawParameters", extension: None, field: |f| &mut f.v11.shader_draw_parameters },
    FeatureRow { feature: F::Multiview, name: "multiview", extension: None, field: |f| &mut f.v11.multiview },
    FeatureRow { feature: F::MultiviewGeometry, name: "multiviewGeometryShader", extension: None, field: |f| &mut f.v11.multiview_geometry_shader },
    FeatureRow { feature: F::MultiviewTessellation, name: "multiviewTessellationShader", extension: None, field: |f| &mut f.v11.multiview_tessellation_shader },
    FeatureRow { feature: F::MultiviewMesh, name: "multiviewMeshShader", extension: Some(ash::ext::mesh_shader::NAME), field: |f| &mut f.ext.mesh.multiview_mesh_shader },
    FeatureRow { feature: F::MeshShaderQueries, name: "meshShaderQueries", extension: Some(ash::ext::mesh_shader::NAME), field: |f| &mut f.ext.mesh.mesh_shader_queries },
    FeatureRow { feature: F::YcbcrConversion, name: "samplerYcbcrConversion", extension: None, field: |f| &mut f.v11.sampler_ycbcr_conversion },
    FeatureRow { feature: F::MirrorClampToEdge, name: "samplerMirrorClampToEdge", extension: None, field: |f| &mut f.v12.sampler_mirror_clamp_to_edge },
    FeatureRow { feature: F::FilterMinMax, name: "samplerFilterMinmax", extension: None, field: |f| &mut f.v12.sampler_filter_minmax },
    FeatureRow { feature: F::BufferInt64Atomics, name: "shaderBufferInt64Atomics", extension: None, field: |f| &mut f.v12.shader_buffer_int64_atomics },
    FeatureRow { feature: F::SharedInt64Atomics, name: "shaderSharedInt64Atomics", extension: None, field: |f| &mut f.v12.shader_shared_int64_atomics },
    FeatureRow { feature: F::ShaderOutputLayer, name: "shaderOutputLayer", extension: None, field: |f| &mut f.v12.shader_output_layer },
    FeatureRow { feature: F::BufferFloatAtomics, name: "shaderBufferFloat32Atomics", extension: Some(ash::ext::shader_atomic_float::NAME), field: |f| &mut f.ext.float_atomics.shader_buffer_float32_atomics },
    FeatureRow { feature: F::BufferFloatAtomicAdd, name: "shaderBufferFloat32AtomicAdd", extension: Some(ash::ext::shader_atomic_float::NAME), field: |f| &mut f.ext.float_atomics.shader_buffer_float32_atomic_add },
    FeatureRow { feature: F::SharedFloatAtomics, name: "shaderSharedFloat32Atomics", extension: Some(ash::ext::shader_atomic_float::NAME), field: |f| &mut f.ext.float_atomics.shader_shared_float32_atomics },
    FeatureRow { feature: F::SharedFloatAtomicAdd, name: "shaderSharedFloat32AtomicAdd", extension: Some(ash::ext::shader_atomic_float::NAME), field: |f| &mut f.ext.float_atomics.shader_shared_float32_atomic_add },
    FeatureRow { feature: F::ImageFloatAtomics, name: "shaderImageFloat32Atomics", extension: Some(ash::ext::shader_atomic_float::NAME), field: |f| &mut f.ext.float_atomics.shader_image_float32_atomics },
    FeatureRow { feature: F::ImageFloatAtomicAdd, name: "shaderImageFloat32AtomicAdd", extension: Some(ash::ext::shader_atomic_float::NAME), field: |f| &mut f.ext.float_atomics.shader_image_float32_atomic_add },
    FeatureRow { feature: F::LocalRead, name: "dynamicRenderingLocalRead", extension: Some(ash::khr::dynamic_rendering_local_read::NAME), field: |f| &mut f.ext.local_read.dynamic_rendering_local_read },
    FeatureRow { feature: F::PipelineShadingRate, name: "pipelineFragmentShadingRate", extension: Some(ash::khr::fragment_shading_rate::NAME), field: |f| &mut f.ext.shading_rate.pipeline_fragment_shading_rate },
    FeatureRow { feature: F::PrimitiveShadingRate, name: "primitiveFragmentShadingRate", extension: Some(ash::khr::fragment_shading_rate::NAME), field: |f| &mut f.ext.shading_rate.primitive_fragment_shading_rate },
    FeatureRow { feature: F::AttachmentShadingRate, name: "attachmentFragmentShadingRate", extension: Some(ash::khr::fragment_shading_rate::NAME), field: |f| &mut f.ext.shading_rate.attachment_fragment_shading_rate },
    FeatureRow { feature: F::MeshPrimitiveShadingRate, name: "primitiveFragmentShadingRateMeshShader", extension: Some(ash::ext::mesh_shader::NAME), field: |f| &mut f.ext.mesh.primitive_fragment_shading_rate_mesh_shader },
    FeatureRow { feature: F::Barycentrics, name: "fragmentShaderBarycentric", extension: Some(ash::khr::fragment_shader_barycentric::NAME), field: |f| &mut f.ext.barycentrics.fragment_shader_barycentric },
    FeatureRow { feature: F::IndexTypeUint8, name: "indexTypeUint8", extension: Some(ash::khr::index_type_uint8::NAME), field: |f| &mut f.ext.index_uint8.index_type_uint8 },
    FeatureRow { feature: F::CustomBorderColors, name: "customBorderColors", extension: Some(ash::ext::custom_border_color::NAME), field: |f| &mut f.ext.border_color.custom_border_colors },
    FeatureRow { feature: F::CustomBorderColorWithoutFormat, name: "customBorderColorWithoutFormat", extension: Some(ash::ext::custom_border_color::NAME), field: |f| &mut f.ext.border_color.custom_border_color_without_format },
    FeatureRow { feature: F::HostImageCopy, name: "hostImageCopy", extension: Some(ash::ext::host_image_copy::NAME), field: |f| &mut f.ext.host_image_copy.host_image_copy },
    FeatureRow { feature: F::Maintenance5, name: "maintenance5", extension: Some(ash::khr::maintenance5::NAME), field: |f| &mut f.ext.maintenance5.maintenance5 },
    FeatureRow { feature: F::CalibratedTimestamps, name: "VK_KHR_calibrated_timestamps", extension: None, field: |f| &mut f.ext.calibrated_timestamps },
    FeatureRow { feature: F::MemoryBudget, name: "VK_EXT_memory_budget", extension: Some(ash::ext::memory_budget::NAME), field: |f| &mut f.ext.memory_budget },
    FeatureRow { feature: F::GraphicsPipelineLibrary, name: "graphicsPipelineLibrary", extension: Some(ash::ext::graphics_pipeline_library::NAME), field: |f| &mut f.ext.graphics_library.graphics_pipeline_library },
    FeatureRow { feature: F::SubgroupSizeControl, name: "subgroupSizeControl", extension: None, field: |f| &mut f.v13.subgroup_size_control },
    FeatureRow { feature: F::ComputeFullSubgroups, name: "computeFullSubgroups", extension: None, field: |f| &mut f.v13.compute_full_subgroups },
    FeatureRow { feature: F::DeviceFault, name: "deviceFault", extension: Some(ash::ext::device_fault::NAME), field: |f| &mut f.ext.fault.device_fault },
    FeatureRow { feature: F::Swapchain, name: "VK_KHR_swapchain", extension: Some(ash::khr::swapchain::NAME), field: |f| &mut f.ext.swapchain },
    FeatureRow { feature: F::SwapchainMaintenance1, name: "swapchainMaintenance1", extension: Some(ash::ext::swapchain_maintenance1::NAME), field: |f| &mut f.ext.swapchain_maintenance1.swapchain_maintenance1 },
    FeatureRow { feature: F::HdrMetadata, name: "VK_EXT_hdr_metadata", extension: Some(ash::ext::hdr_metadata::NAME), field: |f| &mut f.ext.hdr_metadata },
    FeatureRow { feature: F::InvocationReorder, name: "rayTracingInvocationReorder", extension: Some(INVOCATION_REORDER_EXT), field: |f| &mut f.ext.invocation_reorder.ray_tracing_invocation_reorder },
    FeatureRow { feature: F::InvocationReorderNv, name: "VK_NV_ray_tracing_invocation_reorder", extension: Some(ash::nv::ray_tracing_invocation_reorder::NAME), field: |f| &mut f.ext.invocation_reorder_nv.ray_tracing_invocation_reorder },
    FeatureRow { feature: F::RayTracingMaintenance1, name: "rayTracingMaintenance1", extension: Some(ash::khr::ray_tracing_maintenance1::NAME), field: |f| &mut f.ext.ray_tracing_maintenance1.ray_tracing_maintenance1 },
    FeatureRow { feature: F::OpacityMicromaps, name: "micromap", extension: Some(ash::ext::opacity_micromap::NAME), field: |f| &mut f.ext.micromaps.micromap },
    FeatureRow { feature: F::ConstantAlphaColorBlend, name: "constantAlphaColorBlendFactors", extension: None, field: |f| &mut f.ext.portability.constant_alpha_color_blend_factors },
    FeatureRow { feature: F::Events, name: "events", extension: None, field: |f| &mut f.ext.portability.events },
    FeatureRow { feature: F::ViewFormatReinterpretation, name: "imageViewFormatReinterpretation", extension: None, field: |f| &mut f.ext.portability.image_view_format_reinterpretation },
    FeatureRow { feature: F::ViewSwizzle, name: "imageViewFormatSwizzle", extension: None, field: |f| &mut f.ext.portability.image_view_format_swizzle },
    FeatureRow { feature: F::View2dOf3d, name: "imageView2DOn3DImage", extension: None, field: |f| &mut f.ext.portability.image_view2_d_on3_d_image },
    FeatureRow { feature: F::MultisampledArrays, name: "multisampleArrayImage", extension: None, field: |f| &mut f.ext.portability.multisample_array_image },
    FeatureRow { feature: F::ComparisonSamplers, name: "mutableComparisonSamplers", extension: None, field: |f| &mut f.ext.portability.mutable_comparison_samplers },
    FeatureRow { feature: F::PointPolygons, name: "pointPolygons", extension: None, field: |f| &mut f.ext.portability.point_polygons },
    FeatureRow { feature: F::SamplerLodBias, name: "samplerMipLodBias", extension: None, field: |f| &mut f.ext.portability.sampler_mip_lod_bias },
    FeatureRow { feature: F::SeparateStencilReference, name: "separateStencilMaskRef", extension: None, field: |f| &mut f.ext.portability.separate_stencil_mask_ref },
    FeatureRow { feature: F::SampleInterpolation, name: "shaderSampleRateInterpolationFunctions", extension: None, field: |f| &mut f.ext.portability.shader_sample_rate_interpolation_functions },
    FeatureRow { feature: F::TessellationIsolines, name: "tessellationIsolines", extension: None, field: |f| &mut f.ext.portability.tessellation_isolines },
    FeatureRow { feature: F::TessellationPointMode, name: "tessellationPointMode", extension: None, field: |f| &mut f.ext.portability.tessellation_point_mode },
    FeatureRow { feature: F::TriangleFans, name: "triangleFans", extension: None, field: |f| &mut f.ext.portability.triangle_fans },
    FeatureRow { feature: F::VertexAccessBeyondStride, name: "vertexAttributeAccessBeyondStride", extension: None, field: |f| &mut f.ext.portability.vertex_attribute_access_beyond_stride },
    FeatureRow { feature: F::ExternalMemoryFd, name: "VK_KHR_external_memory_fd", extension: Some(ash::khr::external_memory_fd::NAME), field: |f| &mut f.ext.external_memory_fd },
    FeatureRow { feature: F::ExternalMemoryDmaBuf, name: "VK_EXT_external_memory_dma_buf", extension: Some(ash::ext::external_memory_dma_buf::NAME), field: |f| &mut f.ext.external_memory_dma_buf },
    FeatureRow { feature: F::ExternalSemaphoreFd, name: "VK_KHR_external_semaphore_fd", extension: Some(ash::khr::external_semaphore_fd::NAME), field: |f| &mut f.ext.external_semaphore_fd },
    FeatureRow { feature: F::DrmFormatModifier, name: "VK_EXT_image_drm_format_modifier", extension: Some(ash::ext::image_drm_format_modifier::NAME), field: |f| &mut f.ext.drm_format_modifier },
];

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn each_feature_is_at_its_own_table_index() {
        for (index, row) in ROWS.iter().enumerate() {
            assert_eq!(row.feature as usize, index, "{}", row.name);
        }
        assert!(ROWS.len() <= u128::BITS as usize);
    }

    #[test]
    fn each_table_entry_has_its_own_field_and_name() {
        for row in &ROWS {
            let mut features = Features::default();
            *(row.field)(&mut features) = vk::TRUE;
            for other in &ROWS {
                let same = row.feature == other.feature;
                assert_eq!(*(other.field)(&mut features) == vk::TRUE, same, "{} {}", row.name, other.name);
                assert_eq!(row.name == other.name, same);
            }
        }
    }

    #[test]
    fn the_features_of_portability_are_those_of_its_structure() {
        for row in &ROWS {
            let mut features = Features::default();
            features.ext.promise_portability();
            let promised = *(row.field)(&mut features) == vk::TRUE;
            assert_eq!(FeatureSet::PORTABILITY.contains(row.feature), promised, "{}", row.name);
        }
        assert_eq!(FeatureSet::PORTABILITY.iter().count(), 15);
    }

    #[test]
    fn a_feature_is_not_on_without_what_it_needs() {
        let queries = FeatureSet::NONE.with(F::MeshShaderQueries);
        assert_eq!(queries.without_unmet_requirements(), FeatureSet::NONE);
        let both = queries.with(F::PipelineStatisticsQuery);
        assert_eq!(both.without_unmet_requirements(), both);
    }

    proptest! {
        #[test]
        fn enabled_features_are_in_the_set(found in any::<u128>(), set in any::<u128>()) {
            let (found, set) = (FeatureSet(found), FeatureSet(set));
            let mut device = Features::default();
            for row in found.iter().map(OptionalFeature::table_row) {
                *(row.field)(&mut device) = vk::TRUE;
            }
            let mut wanted = Features::default();
            set.without_unmet_requirements().enable(&mut wanted, &device);
            for feature in OptionalFeature::all() {
                let on = *(feature.table_row().field)(&mut wanted) == vk::TRUE;
                prop_assert_eq!(on, found.contains(feature) && set.without_unmet_requirements().contains(feature));
            }
        }
    }
}
