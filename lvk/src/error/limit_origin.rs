//! The party that sets a limit.

/// The party that sets the limit of an [`Error::LimitExceeded`](crate::Error::LimitExceeded).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum LimitOrigin {
    /// The device: see [`Limits`](crate::Limits).
    Device,
    /// The library, on every device.
    Library,
    /// The Vulkan specification, on every device.
    Vulkan,
    /// The caller: [`TlasDesc::capacity`](crate::TlasDesc::capacity).
    TlasCapacity,
    /// The descriptor arrays of the context: as many as [`ContextDesc`](crate::ContextDesc) requests and the device allows.
    Descriptors,
}

impl LimitOrigin {
    /// Returns the clause of an error message about the limit `limit`.
    pub(super) fn clause(self, limit: u64) -> String {
        match self {
            Self::Device => format!("the device takes at most {limit}"),
            Self::Library => format!("the library takes at most {limit}"),
            Self::Vulkan => format!("Vulkan takes at most {limit}"),
            Self::TlasCapacity => {
                format!(
                    "the TLAS was created for at most {limit}; create it with a larger TlasDesc::capacity"
                )
            }
            Self::Descriptors => format!("the context has descriptors for at most {limit}; destroy some"),
        }
    }
}
