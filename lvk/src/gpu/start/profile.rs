//! Clamps the reported capabilities and limits of a device to emulate a phone or another weaker device.

use std::borrow::Cow;

use crate::gpu::caps::capabilities::Capabilities;
use crate::gpu::caps::limits::Limits;
use crate::gpu::caps::mesh_limits::MeshLimits;
use crate::gpu::caps::optional_features::FeatureSet;

/// Clamps the reported capabilities and limits of a device, so that code paths for weaker devices run on it.
///
/// A profile hides features and tightens limits. It never adds anything: where the device is weaker than the
/// profile, the device's own values stay. The logical device is created without the hidden extensions. Limits
/// of acceleration structures and of builds apply to the device's own structures. They have no effect if only
/// software traces rays. The default profile clamps nothing. Custom profiles start from the default or from a
/// built-in profile:
///
/// ```
/// use lvk::DeviceProfile;
///
/// let small = DeviceProfile {
///     name: "small scratch".into(),
///     max_accel_scratch_bytes: 1 << 20,
///     ..DeviceProfile::mali_g715()
/// };
/// assert!(!small.ray_tracing_pipeline);
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceProfile {
    /// Name of the profile, for messages and [`Capabilities::profile`]. Default: `"custom"`.
    pub name: Cow<'static, str>,
    /// True if ray tracing pipelines of the device may be used. Default: true.
    pub ray_tracing_pipeline: bool,
    /// True if ray queries of the device may be used. Default: true.
    pub ray_query: bool,
    /// True if vertex positions of hit triangles may be fetched. Default: true.
    pub position_fetch: bool,
    /// True if task and mesh shaders may be used. Default: true.
    pub mesh_shader: bool,
    /// Optional features that are hidden. Default: [`FeatureSet::NONE`].
    pub hidden: FeatureSet,
    /// Minimum alignment of scratch addresses in bytes, rounded up to a power of two. Default: 1.
    pub min_scratch_alignment: u32,
    /// Maximum size of a storage buffer descriptor in bytes.
    ///
    /// Shaders access the caller's buffers by address, where no device applies this limit. Some devices build
    /// acceleration structures through such descriptors. Their acceleration structures and build scratch are
    /// bound by it, so it tightens the next two limits too. Default: `u64::MAX`.
    pub max_storage_buffer_range: u64,
    /// Maximum size of one acceleration structure in bytes. Meshes that need more are split into several BLAS; a
    /// larger TLAS is refused. Default: `u64::MAX`.
    pub max_accel_structure_bytes: u64,
    /// Maximum scratch size of one build in bytes. Meshes beyond it are split, and a TLAS beyond it is
    /// refused. Default: `u64::MAX`.
    pub max_accel_scratch_bytes: u64,
    /// Maximum shared memory of a compute, task or mesh workgroup in bytes. Default: `u32::MAX`.
    pub max_shared_bytes: u32,
    /// Maximum number of invocations of a compute workgroup, and along each of its axes. Default: `u32::MAX`.
    pub max_workgroup_invocations: u32,
    /// Maximum size of push constants in bytes. Default: `u32::MAX`.
    pub max_push_constant_bytes: u32,
    /// Maximum width and height of 2D and cube textures and of render targets, in texels. Default: `u32::MAX`.
    pub max_texture_side: u32,
    /// Maximum number of textures of a context. Default: `u32::MAX`.
    pub max_textures: u32,
    /// Maximum number of samplers of a context. Default: `u32::MAX`.
    pub max_samplers: u32,
    /// Minimum alignment of vertex strides in bytes, rounded up to a power of two. Default: 1.
    pub min_vertex_stride_alignment: u32,
    /// Maximum number of primitives in one BLAS. Default: `u64::MAX`.
    pub max_blas_primitives: u64,
    /// Minimum BLAS size in bytes per primitive. It replaces a smaller driver value; 0 keeps the driver's
    /// value. Default: 0.
    pub structure_bytes_per_primitive: u64,
    /// Minimum BLAS build scratch in bytes per primitive. It replaces a smaller driver value; 0 keeps the
    /// driver's value. Default: 0.
    pub scratch_bytes_per_primitive: u64,
}

impl Default for DeviceProfile {
    fn default() -> Self {
        Self {
            name: Cow::Borrowed("custom"),
            ray_tracing_pipeline: true,
            ray_query: true,
            position_fetch: true,
            mesh_shader: true,
            hidden: FeatureSet::NONE,
            min_scratch_alignment: 1,
            max_storage_buffer_range: u64::MAX,
            max_accel_structure_bytes: u64::MAX,
            max_accel_scratch_bytes: u64::MAX,
            max_shared_bytes: u32::MAX,
            max_workgroup_invocations: u32::MAX,
            max_push_constant_bytes: u32::MAX,
            max_texture_side: u32::MAX,
            max_textures: u32::MAX,
            max_samplers: u32::MAX,
            min_vertex_stride_alignment: 1,
            max_blas_primitives: u64::MAX,
            structure_bytes_per_primitive: 0,
            scratch_bytes_per_primitive: 0,
        }
    }
}

impl DeviceProfile {
    /// True if the profile hides any feature.
    pub(crate) fn has_restrictions(&self) -> bool {
        !(self.ray_tracing_pipeline && self.ray_query && self.position_fetch && self.mesh_shader)
    }

    /// Removes the hidden features from `capabilities` and tightens its limits.
    pub fn apply(&self, capabilities: &mut Capabilities) {
        capabilities.profile = Some(self.name.clone().into_owned());
        capabilities.limit_ray_tracing(self.ray_tracing_pipeline, self.ray_query);
        capabilities.position_fetch &= self.position_fetch;
        capabilities.mesh_shader &= self.mesh_shader;
        capabilities.remove_features(self.hidden);
        let limits = &mut capabilities.limits;
        limits.scratch_alignment = stricter_alignment(limits.scratch_alignment, self.min_scratch_alignment);
        limits.vertex_stride_alignment =
            stricter_alignment(limits.vertex_stride_alignment, self.min_vertex_stride_alignment);
        let range = self.max_storage_buffer_range;
        for (limit, most) in [
            (&mut limits.max_storage_buffer_range, range),
            (&mut limits.max_accel_structure_bytes, self.max_accel_structure_bytes.min(range)),
            (&mut limits.max_accel_scratch_bytes, self.max_accel_scratch_bytes.min(range)),
            (&mut limits.max_blas_primitives, self.max_blas_primitives),
        ] {
            *limit = most.min(*limit);
        }
        self.tighten_counts(limits);
        if !capabilities.mesh_shader {
            capabilities.limits.mesh = MeshLimits::default();
        }
    }

    /// Tightens the limits of workgroups, push constants, textures and samplers.
    fn tighten_counts(&self, limits: &mut Limits) {
        let mesh = &mut limits.mesh;
        let [width, height] = &mut limits.max_target_size;
        let [x, y, z] = &mut limits.max_workgroup_size;
        for (limit, most) in [
            (&mut limits.max_shared_bytes, self.max_shared_bytes),
            (&mut mesh.max_task_shared_bytes, self.max_shared_bytes),
            (&mut mesh.max_mesh_shared_bytes, self.max_shared_bytes),
            (&mut limits.max_workgroup_invocations, self.max_workgroup_invocations),
            (x, self.max_workgroup_invocations),
            (y, self.max_workgroup_invocations),
            (z, self.max_workgroup_invocations),
            (&mut limits.max_push_constant_bytes, self.max_push_constant_bytes),
            (&mut limits.max_texture_2d, self.max_texture_side),
            (&mut limits.max_texture_cube, self.max_texture_side),
            (width, self.max_texture_side),
            (height, self.max_texture_side),
            (&mut limits.max_bindless_textures, self.max_textures),
            (&mut limits.max_bindless_samplers, self.max_samplers),
        ] {
            *limit = most.min(*limit);
        }
    }
}

/// Returns the smallest power of two that satisfies both alignments.
fn stricter_alignment(device: u32, profile: u32) -> u32 {
    const LARGEST: u32 = 1 << 31;
    device.max(profile).max(1).checked_next_power_of_two().unwrap_or(LARGEST)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::gpu::caps::optional_features::OptionalFeature;

    fn device() -> Capabilities {
        Capabilities {
            ray_tracing_pipeline: true,
            ray_query: true,
            position_fetch: true,
            mesh_shader: true,
            limits: Limits {
                scratch_alignment: 8,
                max_storage_buffer_range: 1 << 32,
                max_accel_structure_bytes: 1 << 40,
                max_accel_scratch_bytes: 1 << 40,
                max_blas_primitives: 1 << 24,
                max_shared_bytes: 64 << 10,
                max_workgroup_size: [2048; 3],
                max_workgroup_invocations: 2048,
                max_push_constant_bytes: 8192,
                max_texture_2d: 1 << 16,
                max_texture_cube: 1 << 16,
                max_target_size: [1 << 16; 2],
                max_bindless_textures: 1 << 20,
                max_bindless_samplers: 2000,
                vertex_stride_alignment: 1,
                mesh: MeshLimits {
                    max_task_shared_bytes: 64 << 10,
                    max_mesh_shared_bytes: 16 << 10,
                    ..MeshLimits::default()
                },
                ..Limits::default()
            },
            ..Capabilities::default()
        }
    }

    fn under(profile: &DeviceProfile) -> Capabilities {
        let mut capabilities = device();
        profile.apply(&mut capabilities);
        capabilities
    }

    #[test]
    fn the_default_clamps_nothing() {
        let clamped = under(&DeviceProfile::default());
        assert_eq!(clamped.limits, device().limits);
        assert!(clamped.ray_tracing_pipeline && clamped.ray_query);
        assert!(clamped.position_fetch && clamped.mesh_shader);
    }

    #[test]
    fn built_in_profiles_hide_what_their_names_say() {
        for (name, pipeline, query) in [
            ("mali-g715", false, true),
            ("mali-g720", false, true),
            ("adreno-840", true, true),
            ("moltenvk", false, false),
            ("portability-minimum", true, true),
            ("xclipse-940", true, true),
            ("no-rt-pipeline", false, true),
            ("no-ray-query", true, false),
            ("no-ray-tracing", false, false),
            ("core-only", false, false),
        ] {
            let clamped = under(&DeviceProfile::named(name).unwrap());
            assert_eq!((clamped.ray_tracing_pipeline, clamped.ray_query), (pipeline, query), "{name}");
            assert_eq!(clamped.profile.as_deref(), Some(name));
            assert!(!clamped.position_fetch || pipeline || query, "{name}");
        }
    }

    #[test]
    fn mali_has_its_limits() {
        let limits = under(&DeviceProfile::mali_g715()).limits;
        let range = 268_435_456;
        assert_eq!(limits.scratch_alignment, 256);
        assert_eq!(limits.max_storage_buffer_range, range);
        assert_eq!((limits.max_accel_structure_bytes, limits.max_accel_scratch_bytes), (range, range));
        assert_eq!(limits.max_blas_primitives, 1 << 24);
    }

    #[test]
    fn recent_phones_have_their_limits() {
        for (profile, range, alignment) in
            [(DeviceProfile::adreno_840(), (1 << 31) - 1, 128), (DeviceProfile::mali_g720(), 256 << 20, 256)]
        {
            let clamped = under(&profile);
            let limits = clamped.limits;
            assert_eq!((limits.max_storage_buffer_range, limits.scratch_alignment), (range, alignment));
            assert_eq!((limits.max_push_constant_bytes, limits.max_workgroup_size), (256, [1024; 3]));
            assert_eq!(limits.max_shared_bytes, 32 << 10);
            assert!(!clamped.mesh_shader && !clamped.position_fetch, "{}", profile.name);
        }
        assert_eq!(under(&DeviceProfile::adreno_840()).limits.max_target_size, [16_384; 2]);
    }

    #[test]
    fn moltenvk_has_its_limits_and_features() {
        let mut capabilities = Capabilities { optional: FeatureSet::ALL, ..device() };
        DeviceProfile::moltenvk().apply(&mut capabilities);
        let limits = &capabilities.limits;
        assert_eq!((limits.max_push_constant_bytes, limits.max_bindless_samplers), (4096, 1024));
        assert_eq!((limits.max_texture_2d, limits.vertex_stride_alignment), (16_384, 1));
        assert_eq!((limits.max_workgroup_invocations, limits.max_shared_bytes), (1024, 32 << 10));
        for (feature, there) in [
            (OptionalFeature::TriangleFans, true),
            (OptionalFeature::ViewSwizzle, true),
            (OptionalFeature::ComparisonSamplers, true),
            (OptionalFeature::PointPolygons, false),
            (OptionalFeature::TessellationIsolines, false),
            (OptionalFeature::SamplerLodBias, false),
            (OptionalFeature::BufferInt64Atomics, false),
            (OptionalFeature::GeometryShader, false),
            (OptionalFeature::TessellationShader, true),
        ] {
            assert_eq!(capabilities.has(feature), there, "{feature:?}");
        }
    }

    #[test]
    fn the_minimum_of_portability_hides_all_its_features_and_no_others() {
        let mut capabilities = Capabilities { optional: FeatureSet::ALL, ..device() };
        DeviceProfile::portability_minimum().apply(&mut capabilities);
        assert!(FeatureSet::PORTABILITY.iter().all(|feature| !capabilities.has(feature)));
        assert!(capabilities.has(OptionalFeature::GeometryShader));
        assert_eq!(capabilities.limits.vertex_stride_alignment, 4);
        assert!(capabilities.limits.max_lod_bias.abs() < f32::EPSILON);
    }

    #[test]
    fn workgroups_share_less_on_phones() {
        let shared = |profile: &DeviceProfile| {
            let limits = under(profile).limits;
            [limits.max_shared_bytes, limits.mesh.max_task_shared_bytes, limits.mesh.max_mesh_shared_bytes]
        };
        assert_eq!(shared(&DeviceProfile::default()), [64 << 10, 64 << 10, 16 << 10]);
        assert_eq!(shared(&DeviceProfile::xclipse_940()), [32 << 10, 32 << 10, 16 << 10]);
        assert_eq!(shared(&DeviceProfile::mali_g715()), [32 << 10, 0, 0]);
    }

    #[test]
    fn the_storage_range_alone_bounds_structures_and_their_scratch() {
        let range = 1 << 20;
        let profile = DeviceProfile { max_storage_buffer_range: range, ..DeviceProfile::default() };
        let limits = under(&profile).limits;
        assert_eq!((limits.max_accel_structure_bytes, limits.max_accel_scratch_bytes), (range, range));
        let limits = under(&DeviceProfile { max_accel_scratch_bytes: 9, ..profile }).limits;
        assert_eq!((limits.max_accel_structure_bytes, limits.max_accel_scratch_bytes), (range, 9));
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_known_ones() {
        let message = DeviceProfile::named("Mali-G715").unwrap_err().to_string();
        assert!(message.contains("'Mali-G715'"), "{message}");
        for name in DeviceProfile::names() {
            assert!(message.contains(name), "{message}");
        }
    }

    fn bytes() -> impl Strategy<Value = u64> {
        prop_oneof![Just(0), Just(u64::MAX), any::<u64>(), 0..1_u64 << 34]
    }

    #[test]
    fn core_only_leaves_nothing_optional() {
        let mut capabilities = Capabilities { optional: FeatureSet::ALL, ..device() };
        capabilities.remove_features(FeatureSet::NONE);
        assert!(capabilities.cube_arrays && capabilities.has(OptionalFeature::MeshShaderQueries));
        DeviceProfile::core_only().apply(&mut capabilities);
        assert_eq!(capabilities.optional, FeatureSet::PORTABILITY);
        assert!(!(capabilities.cube_arrays || capabilities.shader_int64 || capabilities.mesh_shader));
    }

    #[test]
    fn features_that_need_a_hidden_feature_are_hidden_with_it() {
        let mut capabilities = Capabilities { optional: FeatureSet::ALL, ..device() };
        let hidden = FeatureSet::NONE.with(OptionalFeature::Multiview);
        DeviceProfile { hidden, mesh_shader: false, ..DeviceProfile::default() }.apply(&mut capabilities);
        assert!(!capabilities.has(OptionalFeature::MultiviewGeometry));
        assert!(!capabilities.has(OptionalFeature::MeshShaderQueries));
        assert!(capabilities.has(OptionalFeature::GeometryShader));
    }

    prop_compose! {
        fn profile()(
            on in any::<[bool; 4]>(), min_scratch_alignment in prop_oneof![any::<u32>(), 0..1025_u32],
            limits in [bytes(), bytes(), bytes(), bytes()], factors in any::<[u16; 2]>(),
            counts in any::<[u16; 5]>(), stride in 0..9_u32,
        ) -> DeviceProfile {
            DeviceProfile {
                name: "random".into(),
                ray_tracing_pipeline: on[0],
                ray_query: on[1],
                position_fetch: on[2],
                mesh_shader: on[3],
                hidden: FeatureSet::NONE,
                min_scratch_alignment,
                max_storage_buffer_range: limits[0],
                max_accel_structure_bytes: limits[1],
                max_accel_scratch_bytes: limits[2],
                max_blas_primitives: limits[3],
                max_shared_bytes: limits[0] as u32,
                max_workgroup_invocations: counts[0].into(),
                max_push_constant_bytes: counts[1].into(),
                max_texture_side: counts[2].into(),
                max_textures: counts[3].into(),
                max_samplers: counts[4].into(),
                min_vertex_stride_alignment: stride,
                structure_bytes_per_primitive: factors[0].into(),
                scratch_bytes_per_primitive: factors[1].into(),
            }
        }
    }

    prop_compose! {
        fn found()(
            on in any::<[bool; 4]>(), alignment in 0..10_u32, limits in [bytes(), bytes(), bytes(), bytes()]
        ) -> Capabilities {
            let mut found = device();
            found.ray_tracing_pipeline = on[0];
            found.ray_query = on[1];
            found.position_fetch = on[2] && (on[0] || on[1]);
            found.mesh_shader = on[3];
            found.limits.scratch_alignment = 1 << alignment;
            found.limits.max_storage_buffer_range = limits[0];
            found.limits.max_accel_structure_bytes = limits[1];
            found.limits.max_accel_scratch_bytes = limits[2];
            found.limits.max_blas_primitives = limits[3];
            found
        }
    }

    fn amounts(limits: &Limits) -> [u64; 13] {
        [
            limits.max_shared_bytes.into(),
            limits.max_workgroup_size[2].into(),
            limits.max_workgroup_invocations.into(),
            limits.max_push_constant_bytes.into(),
            limits.max_texture_2d.into(),
            limits.max_texture_cube.into(),
            limits.max_target_size[1].into(),
            limits.max_bindless_textures.into(),
            limits.max_bindless_samplers.into(),
            limits.max_storage_buffer_range,
            limits.max_accel_structure_bytes,
            limits.max_accel_scratch_bytes,
            limits.max_blas_primitives,
        ]
    }

    fn switches(of: &Capabilities) -> [bool; 4] {
        [of.ray_tracing_pipeline, of.ray_query, of.position_fetch, of.mesh_shader]
    }

    proptest! {
        #[test]
        fn nothing_is_ever_loosened(found in found(), profile in profile()) {
            let mut clamped = found.clone();
            profile.apply(&mut clamped);
            for (before, after) in amounts(&found.limits).into_iter().zip(amounts(&clamped.limits)) {
                prop_assert!(after <= before);
            }
            for (before, after) in switches(&found).into_iter().zip(switches(&clamped)) {
                prop_assert!(before || !after);
            }
            prop_assert!(!clamped.position_fetch || clamped.ray_tracing_pipeline || clamped.ray_query);
            let mut again = clamped.clone();
            profile.apply(&mut again);
            prop_assert_eq!(again.limits, clamped.limits);
        }

        #[test]
        fn the_alignment_serves_device_and_profile(found in found(), profile in profile()) {
            let mut clamped = found.clone();
            profile.apply(&mut clamped);
            let alignment = clamped.limits.scratch_alignment;
            prop_assert!(alignment.is_power_of_two());
            prop_assert_eq!(alignment % found.limits.scratch_alignment, 0);
            prop_assert!(alignment >= profile.min_scratch_alignment.min(1 << 31));
            let stride = clamped.limits.vertex_stride_alignment;
            prop_assert!(stride.is_power_of_two() && stride >= profile.min_vertex_stride_alignment);
        }
    }
}
