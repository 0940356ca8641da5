//! Modes for resolving multisampled depth and stencil.

use ash::vk;
use bitflags::bitflags;

/// Mode for resolving the depth or stencil samples of a pixel (`VkResolveModeFlagBits`). Colours are
/// averaged; integers take the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ResolveMode {
    /// The first sample. Every device supports it.
    SampleZero,
    /// The mean of the samples. Not available for stencil.
    Average,
    /// The minimum of the samples.
    Min,
    /// The maximum of the samples.
    Max,
}

bitflags! {
    /// A set of [`ResolveMode`]s. The bits are Vulkan's.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct ResolveModes: u32 {
        /// [`ResolveMode::SampleZero`].
        const SAMPLE_ZERO = 1 << 0;
        /// [`ResolveMode::Average`].
        const AVERAGE = 1 << 1;
        /// [`ResolveMode::Min`].
        const MIN = 1 << 2;
        /// [`ResolveMode::Max`].
        const MAX = 1 << 3;
    }
}

impl ResolveMode {
    pub(crate) fn bit(self) -> ResolveModes {
        match self {
            Self::SampleZero => ResolveModes::SAMPLE_ZERO,
            Self::Average => ResolveModes::AVERAGE,
            Self::Min => ResolveModes::MIN,
            Self::Max => ResolveModes::MAX,
        }
    }
}

/// Support for resolving multisampled depth and stencil at the end of a pass
/// (`VkPhysicalDeviceDepthStencilResolveProperties`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DepthResolveLimits {
    /// Supported modes for depth.
    pub depth: ResolveModes,
    /// Supported modes for stencil.
    pub stencil: ResolveModes,
    /// True if depth or stencil may be resolved without the other.
    pub one_alone: bool,
    /// True if depth and stencil may be resolved with different modes.
    pub different: bool,
}

impl DepthResolveLimits {
    /// Converts the limits reported by the device.
    pub(crate) fn from_properties(v12: &vk::PhysicalDeviceVulkan12Properties<'_>) -> Self {
        Self {
            depth: ResolveModes::from_bits_truncate(v12.supported_depth_resolve_modes.as_raw()),
            stencil: ResolveModes::from_bits_truncate(v12.supported_stencil_resolve_modes.as_raw()),
            one_alone: v12.independent_resolve_none == vk::TRUE,
            different: v12.independent_resolve == vk::TRUE,
        }
    }

    /// True if the device can resolve a depth-stencil target with these modes.
    pub(crate) fn supports(&self, depth: Option<ResolveMode>, stencil: Option<ResolveMode>) -> bool {
        let known = |mode: Option<ResolveMode>, modes: ResolveModes| {
            mode.is_none_or(|mode| modes.contains(mode.bit()))
        };
        let together =
            depth == stencil || self.different || (self.one_alone && (depth.is_none() || stencil.is_none()));
        known(depth, self.depth) && known(stencil, self.stencil) && together
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_those_of_vulkan() {
        for (mode, raw) in [
            (ResolveMode::SampleZero, vk::ResolveModeFlags::SAMPLE_ZERO),
            (ResolveMode::Average, vk::ResolveModeFlags::AVERAGE),
            (ResolveMode::Min, vk::ResolveModeFlags::MIN),
            (ResolveMode::Max, vk::ResolveModeFlags::MAX),
        ] {
            assert_eq!(mode.bit().bits(), raw.as_raw());
        }
    }

    #[test]
    fn both_parts_go_together_unless_the_device_says_otherwise() {
        use ResolveMode::{Min, SampleZero};
        let plain = DepthResolveLimits {
            depth: ResolveModes::all(),
            stencil: ResolveModes::SAMPLE_ZERO,
            ..Default::default()
        };
        let alone = DepthResolveLimits { one_alone: true, ..plain };
        let different = DepthResolveLimits { different: true, ..plain };
        let zero = Some(SampleZero);
        for (depth, stencil, expected) in [
            (zero, zero, [true, true, true]),
            (None, None, [true, true, true]),
            (zero, None, [false, true, true]),
            (Some(Min), zero, [false, false, true]),
            (zero, Some(Min), [false, false, false]),
        ] {
            let found = [plain, alone, different].map(|limits| limits.supports(depth, stencil));
            assert_eq!(found, expected, "{depth:?} {stencil:?}");
        }
    }
}
