//! The built-in device profiles, with the sources of their values.

use std::borrow::Cow;

use super::profile::DeviceProfile;
use crate::error::{Error, Result};
use crate::gpu::caps::optional_features::{FeatureSet, OptionalFeature as F};

/// Shared memory of a workgroup on phones, in bytes.
const PHONE_SHARED_BYTES: u32 = 32 << 10;

type BuiltIn = (&'static str, fn() -> DeviceProfile);

/// The built-in profiles by name.
const BUILT_IN: [BuiltIn; 10] = [
    ("mali-g715", DeviceProfile::mali_g715),
    ("mali-g720", DeviceProfile::mali_g720),
    ("xclipse-940", DeviceProfile::xclipse_940),
    ("adreno-840", DeviceProfile::adreno_840),
    ("moltenvk", DeviceProfile::moltenvk),
    ("portability-minimum", DeviceProfile::portability_minimum),
    ("no-rt-pipeline", DeviceProfile::no_rt_pipeline),
    ("no-ray-query", DeviceProfile::no_ray_query),
    ("no-ray-tracing", DeviceProfile::no_ray_tracing),
    ("core-only", DeviceProfile::core_only),
];

/// Features that turnip, Mesa's driver for Adreno, lacks.
const MISSING_IN_TURNIP: [F; 12] = [
    F::StorageImageMultisample,
    F::Float64,
    F::UniformBuffer16Bit,
    F::PushConstant16Bit,
    F::InputOutput16Bit,
    F::UniformBuffer8Bit,
    F::PushConstant8Bit,
    F::MultiviewTessellation,
    F::SharedInt64Atomics,
    F::BufferFloatAtomicAdd,
    F::SharedFloatAtomicAdd,
    F::ImageFloatAtomicAdd,
];

/// Features that panvk, Mesa's driver for Mali, lacks.
const MISSING_IN_PANVK: [F; 19] = [
    F::GeometryShader,
    F::TessellationShader,
    F::FillModeNonSolid,
    F::PipelineStatisticsQuery,
    F::TessellationAndGeometryPointSize,
    F::StorageImageMultisample,
    F::ClipDistance,
    F::CullDistance,
    F::Float64,
    F::MinLod,
    F::MultiviewGeometry,
    F::MultiviewTessellation,
    F::ShaderOutputLayer,
    F::BufferFloatAtomicAdd,
    F::SharedFloatAtomicAdd,
    F::ImageFloatAtomicAdd,
    F::PipelineShadingRate,
    F::PrimitiveShadingRate,
    F::AttachmentShadingRate,
];

/// Features that MoltenVK has on no Apple GPU up to the family of the M2.
const MISSING_IN_MOLTENVK: [F; 25] = [
    F::GeometryShader,
    F::WideLines,
    F::PipelineStatisticsQuery,
    F::StorageImageMultisample,
    F::CullDistance,
    F::Float64,
    F::MultiviewGeometry,
    F::MultiviewTessellation,
    F::MultiviewMesh,
    F::MeshShaderQueries,
    F::FilterMinMax,
    F::BufferInt64Atomics,
    F::SharedInt64Atomics,
    F::ImageFloatAtomics,
    F::ImageFloatAtomicAdd,
    F::PipelineShadingRate,
    F::PrimitiveShadingRate,
    F::AttachmentShadingRate,
    F::MeshPrimitiveShadingRate,
    F::CustomBorderColors,
    F::DeviceFault,
    F::PointPolygons,
    F::SamplerLodBias,
    F::TessellationIsolines,
    F::TessellationPointMode,
];

impl DeviceProfile {
    /// `mali-g715`: Arm Mali-G715-Immortalis MC11 with driver r38p1.
    ///
    /// It has ray queries only. Neither an acceleration structure nor the scratch of a build may exceed the
    /// 256 MiB range of a storage buffer. For a mesh of 2.8 million triangles the driver requires
    /// 7,852,992,128 bytes of scratch and a BLAS of 612,837,208 bytes: 2,805 and 219 bytes per triangle. A
    /// workgroup shares at most 32 KiB.
    pub fn mali_g715() -> Self {
        const RANGE: u64 = 256 << 20;
        Self {
            name: Cow::Borrowed("mali-g715"),
            ray_tracing_pipeline: false,
            position_fetch: false,
            mesh_shader: false,
            min_scratch_alignment: 256,
            max_storage_buffer_range: RANGE,
            max_accel_structure_bytes: RANGE,
            max_accel_scratch_bytes: RANGE,
            structure_bytes_per_primitive: 219,
            scratch_bytes_per_primitive: 2_805,
            max_shared_bytes: PHONE_SHARED_BYTES,
            ..Self::default()
        }
    }

    /// `mali-g720`: the class of Arm's Mali-G720 and Immortalis-G720.
    ///
    /// Sources:
    /// * ray tracing, on Immortalis-G720 only: Arm's page
    ///   <https://learn.arm.com/learning-paths/smartphones-and-mobile/ray_tracing/rt02_setup>;
    /// * 32 KiB of shared memory, with Arm's driver r44p1 on a Mali-G720-Immortalis MC12:
    ///   <https://github.com/ggml-org/llama.cpp/pull/27163>;
    /// * push constants of 256 bytes, targets of 16,384 pixels, the features: panvk, Mesa's driver for this architecture,
    ///   `src/panfrost/vulkan/panvk_vX_physical_device.c` of <https://gitlab.freedesktop.org/mesa/mesa> at
    ///   020a6bc28265. Arm's driver may have more features.
    ///
    /// Not sourced: ray queries without pipelines, the range of 256 MiB, the scratch alignment and the sizes per
    /// triangle are those of [`mali_g715`](Self::mali_g715); workgroups have 1,024 invocations.
    pub fn mali_g720() -> Self {
        Self {
            name: Cow::Borrowed("mali-g720"),
            hidden: MISSING_IN_PANVK.into_iter().collect(),
            max_workgroup_invocations: 1024,
            max_push_constant_bytes: 256,
            max_texture_side: 16_384,
            ..Self::mali_g715()
        }
    }

    /// `xclipse-940`: Samsung Xclipse 940.
    ///
    /// It has ray tracing pipelines and ray queries, and no limit on the storage buffer range. For the same
    /// mesh the driver requires 601,488,316 bytes of scratch and a BLAS of 461,519,536 bytes: 215 and 165
    /// bytes per triangle. Shared memory of a workgroup is clamped to the 32 KiB that is common on phones.
    pub fn xclipse_940() -> Self {
        Self {
            name: Cow::Borrowed("xclipse-940"),
            structure_bytes_per_primitive: 165,
            scratch_bytes_per_primitive: 215,
            max_shared_bytes: PHONE_SHARED_BYTES,
            ..Self::default()
        }
    }

    /// `adreno-840`: Qualcomm Adreno 840 (Snapdragon 8 Elite Gen 5).
    ///
    /// Sources:
    /// * ray queries and ray tracing pipelines, with Qualcomm's driver on the phone SM-S948B:
    ///   `docs/ANDROID_RT_DEVICE_COMPATIBILITY_RECORD.md` of <https://github.com/Samfa12-tech/The-Horde-RT-demo> at
    ///   48e88cba3d76. Turnip, Mesa's driver for this GPU, has ray queries only;
    /// * the storage range of 2 GiB less 1 byte, 32 KiB of shared memory: turnip,
    ///   `src/freedreno/common/freedreno_devices.py` of <https://gitlab.freedesktop.org/mesa/mesa> at 17ca6174dcc6;
    /// * push constants of 256 bytes, textures of 16,384 texels, workgroups of 1,024 invocations, scratch alignment
    ///   128, the features: turnip, `src/freedreno/vulkan/tu_device.cc` at 020a6bc28265.
    ///
    /// Not sourced: limits of Qualcomm's own driver. Missing mesh shaders and position fetch are assumed. Sizes per
    /// triangle are unknown, so those of the device itself count.
    pub fn adreno_840() -> Self {
        Self {
            name: Cow::Borrowed("adreno-840"),
            position_fetch: false,
            mesh_shader: false,
            hidden: MISSING_IN_TURNIP.into_iter().collect(),
            min_scratch_alignment: 128,
            max_storage_buffer_range: (1 << 31) - 1,
            max_shared_bytes: PHONE_SHARED_BYTES,
            max_workgroup_invocations: 1024,
            max_push_constant_bytes: 256,
            max_texture_side: 16_384,
            ..Self::default()
        }
    }

    /// `moltenvk`: an Apple GPU of the families of M1 and M2, through MoltenVK 1.4.
    ///
    /// It has no ray tracing and no mesh shaders. The features and limits are those that
    /// `MoltenVK/MoltenVK/GPUObjects/MVKDevice.mm` of <https://github.com/KhronosGroup/MoltenVK> at 1484e7f8f85a
    /// (1.4.3 in development) reports for the GPU families Apple 7 and 8 with argument buffers of tier 2. These
    /// GPUs lack four features of [`FeatureSet::PORTABILITY`]. Three values come from Metal at run time, and are
    /// assumed as Apple's Metal feature set tables have them: 1,024 samplers, 1,024 invocations and 32 KiB in a
    /// workgroup.
    pub fn moltenvk() -> Self {
        Self {
            name: Cow::Borrowed("moltenvk"),
            position_fetch: false,
            mesh_shader: false,
            hidden: MISSING_IN_MOLTENVK.into_iter().collect(),
            max_storage_buffer_range: u32::MAX.into(),
            max_shared_bytes: 32 << 10,
            max_workgroup_invocations: 1024,
            max_push_constant_bytes: 4096,
            max_texture_side: 16_384,
            // A texture takes two of a million descriptors, and others need some.
            max_textures: 499_000,
            max_samplers: 1024,
            ..Self::no_ray_tracing()
        }
    }

    /// `portability-minimum`: the current device without any feature of [`FeatureSet::PORTABILITY`], and with
    /// vertex strides in multiples of 4 bytes, as the least device of `VK_KHR_portability_subset` has them.
    pub fn portability_minimum() -> Self {
        Self {
            name: Cow::Borrowed("portability-minimum"),
            hidden: FeatureSet::PORTABILITY,
            min_vertex_stride_alignment: 4,
            ..Self::default()
        }
    }

    /// `no-rt-pipeline`: the current device with ray queries only.
    pub fn no_rt_pipeline() -> Self {
        Self { name: Cow::Borrowed("no-rt-pipeline"), ray_tracing_pipeline: false, ..Self::default() }
    }

    /// `no-ray-query`: the current device with ray tracing pipelines only.
    pub fn no_ray_query() -> Self {
        Self { name: Cow::Borrowed("no-ray-query"), ray_query: false, ..Self::default() }
    }

    /// `no-ray-tracing`: the current device without hardware ray tracing.
    pub fn no_ray_tracing() -> Self {
        Self { name: Cow::Borrowed("no-ray-tracing"), ray_tracing_pipeline: false, ..Self::no_ray_query() }
    }

    /// `core-only`: the current device without any optional feature: no ray tracing, no mesh shaders and no
    /// [`OptionalFeature`](crate::OptionalFeature) beside those of [`FeatureSet::PORTABILITY`], which Vulkan
    /// promises.
    pub fn core_only() -> Self {
        Self {
            name: Cow::Borrowed("core-only"),
            position_fetch: false,
            mesh_shader: false,
            hidden: FeatureSet::ALL.without(FeatureSet::PORTABILITY),
            ..Self::no_ray_tracing()
        }
    }

    /// Returns the names of the built-in profiles.
    pub fn names() -> impl ExactSizeIterator<Item = &'static str> {
        BUILT_IN.iter().map(|(name, _)| *name)
    }

    /// Returns the built-in profile with this name.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] with the list of names, if no profile has this name.
    pub fn named(name: &str) -> Result<Self> {
        match BUILT_IN.iter().find(|(known, _)| *known == name) {
            Some((_, profile)) => Ok(profile()),
            None => {
                let names: Vec<_> = Self::names().collect();
                let message = format!("no built-in profile has this name; there are {}", names.join(", "));
                Err(Error::usage(format!("device profile '{name}'"), message))
            }
        }
    }
}
