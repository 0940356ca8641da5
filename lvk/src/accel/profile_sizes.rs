//! Size model of BLAS builds under a device profile, which may require more memory than the present driver.

use super::flags::AccelStructSizes;
use crate::gpu::start::profile::DeviceProfile;

impl DeviceProfile {
    /// Returns the larger of the `driver`'s sizes for a BLAS build and the profile's sizes for `primitives`
    /// primitives. The scratch size of refits is the driver's.
    pub fn query_build_sizes(&self, driver: AccelStructSizes, primitives: u64) -> AccelStructSizes {
        let model = |bytes_each: u64| primitives.saturating_mul(bytes_each);
        AccelStructSizes {
            structure_bytes: driver.structure_bytes.max(model(self.structure_bytes_per_primitive)),
            build_scratch_bytes: driver.build_scratch_bytes.max(model(self.scratch_bytes_per_primitive)),
            ..driver
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const MESH: u64 = 2_800_000;

    fn is_near(found: u64, expected: u64) -> bool {
        found.abs_diff(expected) * 500 < expected
    }

    /// Sizes of one mesh as measured on the phones.
    #[test]
    fn built_in_profiles_meet_what_was_measured_within_two_thousandths() {
        for (profile, scratch, structure) in [
            (DeviceProfile::mali_g715(), 7_852_992_128, 612_837_208),
            (DeviceProfile::xclipse_940(), 601_488_316, 461_519_536),
        ] {
            let sizes = profile.query_build_sizes(AccelStructSizes::default(), MESH);
            assert!(is_near(sizes.build_scratch_bytes, scratch), "{}: {sizes:?}", profile.name);
            assert!(is_near(sizes.structure_bytes, structure), "{}: {sizes:?}", profile.name);
        }
    }

    #[test]
    fn the_mali_needs_thirty_parts_for_the_scratch_of_the_mesh() {
        let mali = DeviceProfile::mali_g715();
        let sizes = mali.query_build_sizes(AccelStructSizes::default(), MESH);
        assert_eq!(sizes.build_scratch_bytes.div_ceil(mali.max_accel_scratch_bytes), 30);
    }

    proptest! {
        #[test]
        fn sizes_are_never_below_the_drivers(
            driver in any::<[u64; 3]>(), factors in any::<[u64; 2]>(), primitives in any::<u64>()
        ) {
            let [structure_bytes, build_scratch_bytes, update_scratch_bytes] = driver;
            let driver = AccelStructSizes { structure_bytes, build_scratch_bytes, update_scratch_bytes };
            let profile = DeviceProfile {
                structure_bytes_per_primitive: factors[0],
                scratch_bytes_per_primitive: factors[1],
                ..DeviceProfile::default()
            };
            let sizes = profile.query_build_sizes(driver, primitives);
            prop_assert!(sizes.structure_bytes >= driver.structure_bytes);
            prop_assert!(sizes.build_scratch_bytes >= driver.build_scratch_bytes);
            prop_assert_eq!(sizes.update_scratch_bytes, driver.update_scratch_bytes);
            prop_assert_eq!(DeviceProfile::default().query_build_sizes(driver, primitives), driver);
        }
    }
}
