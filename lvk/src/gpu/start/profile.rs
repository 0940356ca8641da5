//! Clamps the reported capabilities and limits of a device to emulate a phone or another weaker device.

use std::borrow::Cow;

use crate::error::{Error, Result};
use crate::gpu::caps::capabilities::Capabilities;
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
    /// Name of the profile, for messages and [`Capabilities::profile`].
    pub name: Cow<'static, str>,
    /// True if ray tracing pipelines may be used.
    pub ray_tracing_pipeline: bool,
    /// True if ray queries may be used.
    pub ray_query: bool,
    /// True if vertex positions of hit triangles may be fetched.
    pub position_fetch: bool,
    /// True if task and mesh shaders may be used.
    pub mesh_shader: bool,
    /// Optional features that are hidden.
    pub hidden: FeatureSet,
    /// Minimum alignment of scratch addresses in bytes, rounded up to a power of two.
    pub min_scratch_alignment: u32,
    /// Maximum size of a storage buffer descriptor in bytes.
    ///
    /// Shaders access the caller's buffers by address, where no device applies this limit. Some devices build
    /// acceleration structures through such descriptors. Their acceleration structures and build scratch are
    /// bound by it, so it tightens the next two limits too.
    pub max_storage_buffer_range: u64,
    /// Maximum size of one acceleration structure in bytes. Meshes that need more are split into several BLAS; a
    /// larger TLAS is refused.
    pub max_accel_structure_bytes: u64,
    /// Maximum scratch size of one build in bytes. Meshes beyond it are split, and a TLAS beyond it is
    /// refused.
    pub max_accel_scratch_bytes: u64,
    /// Maximum shared memory of a compute, task or mesh workgroup in bytes.
    pub max_shared_bytes: u32,
    /// Maximum number of primitives in one BLAS.
    pub max_blas_primitives: u64,
    /// Minimum BLAS size in bytes per primitive. It replaces a smaller driver value; 0 keeps the driver's
    /// value.
    pub structure_bytes_per_primitive: u64,
    /// Minimum BLAS build scratch in bytes per primitive. It replaces a smaller driver value; 0 keeps the
    /// driver's value.
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
            max_blas_primitives: u64::MAX,
            structure_bytes_per_primitive: 0,
            scratch_bytes_per_primitive: 0,
        }
    }
}

/// Shared memory of a workgroup on phones, in bytes.
const PHONE_SHARED_BYTES: u32 = 32 << 10;

type BuiltIn = (&'static str, fn() -> DeviceProfile);

/// The built-in profiles by name.
const BUILT_IN: [BuiltIn; 6] = [
    ("mali-g715", DeviceProfile::mali_g715),
    ("xclipse-940", DeviceProfile::xclipse_940),
    ("no-rt-pipeline", DeviceProfile::no_rt_pipeline),
    ("no-ray-query", DeviceProfile::no_ray_query),
    ("no-ray-tracing", DeviceProfile::no_ray_tracing),
    ("core-only", DeviceProfile::core_only),
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
    /// [`OptionalFeature`](crate::OptionalFeature) beside those of [`FeatureSet::PORTABILITY`], which Vulkan promises.
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
        let range = self.max_storage_buffer_range;
        for (limit, most) in [
            (&mut limits.max_storage_buffer_range, range),
            (&mut limits.max_accel_structure_bytes, self.max_accel_structure_bytes.min(range)),
            (&mut limits.max_accel_scratch_bytes, self.max_accel_scratch_bytes.min(range)),
            (&mut limits.max_blas_primitives, self.max_blas_primitives),
        ] {
            *limit = most.min(*limit);
        }
        let mesh = &mut limits.mesh;
        for limit in
            [&mut limits.max_shared_bytes, &mut mesh.max_task_shared_bytes, &mut mesh.max_mesh_shared_bytes]
        {
            *limit = self.max_shared_bytes.min(*limit);
        }
        if !capabilities.mesh_shader {
            capabilities.limits.mesh = MeshLimits::default();
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
    use crate::gpu::caps::limits::Limits;
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
    fn what_hangs_on_a_hidden_feature_is_hidden_with_it() {
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

    fn amounts(limits: &Limits) -> [u64; 5] {
        [
            limits.max_shared_bytes.into(),
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
        }
    }
}
