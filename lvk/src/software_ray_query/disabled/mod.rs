//! The names of this folder for a build without the feature `software-ray-query`. No context uses software ray queries
//! then: [`SoftwareBlas`](blas::SoftwareBlas) and [`SoftwareTlas`](tlas::SoftwareTlas) have no values, so that every
//! `Option` of them is `None`.

pub(crate) mod create;
pub(crate) mod record;

/// The files for `#include <lvk/software_*.glsl>`: none.
#[cfg(feature = "glsl")]
pub(crate) const GLSL: &[(&str, &str)] = &[];

pub(crate) mod blas {
    use std::convert::Infallible;

    use crate::accel::flags::{AccelStructSizes, BuildFlags};
    use crate::accel::geometry::BlasGeometry;
    use crate::error::{Error, Result};

    /// The software BVH of a BLAS; no BLAS has one.
    pub(crate) enum SoftwareBlas {}

    impl SoftwareBlas {
        pub(crate) fn moved_storage(&self) -> Option<&Infallible> {
            match *self {}
        }

        pub(crate) fn set_moved_storage(&self) {
            match *self {}
        }

        pub(crate) fn is_built_on_cpu(&self) -> bool {
            match *self {}
        }

        pub(crate) fn memory_bytes(&self) -> u64 {
            match *self {}
        }

        pub(crate) fn initial_scratch_bytes(&self) -> u64 {
            match *self {}
        }

        pub(crate) fn sizes(&self, _: BuildFlags) -> AccelStructSizes {
            match *self {}
        }
    }

    /// Fails, since without acceleration structures of the device there are no BLAS.
    pub(crate) fn max_sizes(name: &str, _: &[BlasGeometry], _: BuildFlags) -> Result<AccelStructSizes> {
        Err(missing(name))
    }

    /// Returns the error for a BLAS that only software could trace.
    pub(crate) fn missing(name: &str) -> Error {
        let why = "the device has no acceleration structures; enable lvk's feature `software-ray-query`";
        Error::unsupported(format!("the BLAS '{name}'"), why)
    }
}

pub(crate) mod tlas {
    use crate::accel::flags::AccelStructSizes;

    /// The software BVH of a TLAS; no TLAS has one.
    pub(crate) enum SoftwareTlas {}

    impl SoftwareTlas {
        pub(crate) fn address(&self) -> u64 {
            match *self {}
        }

        pub(crate) fn memory_bytes(&self) -> u64 {
            match *self {}
        }

        pub(crate) fn sizes(&self) -> AccelStructSizes {
            match *self {}
        }
    }
}
