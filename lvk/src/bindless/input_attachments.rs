//! The second descriptor set: the targets of a pass, read by the fragment shaders of the same pass.

use std::fmt;
use std::sync::Arc;

use ash::vk;

use crate::error::{Error, Result};
use crate::gpu::Gpu;

/// A target of a pass that fragment shaders read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum InputAttachment {
    Depth,
    /// A colour target, by its number.
    Color(u32),
    Stencil,
}

impl InputAttachment {
    /// Colour targets of a pass.
    const COLORS: u32 = 8;
    /// Bindings of the set on devices without a lower limit.
    pub(crate) const COUNT: u32 = Self::COLORS + 2;

    /// Returns the input attachment of an index. Depth and the first colours come first, because some devices have only
    /// four input attachments.
    pub(crate) fn from_index(place: u32) -> Option<Self> {
        match place {
            0 => Some(Self::Depth),
            color if color <= Self::COLORS => Some(Self::Color(color - 1)),
            last if last + 1 == Self::COUNT => Some(Self::Stencil),
            _ => None,
        }
    }

    /// Returns the index: the binding in the set, and the `input_attachment_index`, which has the same limit.
    pub(crate) fn index(self) -> u32 {
        match self {
            Self::Depth => 0,
            Self::Color(target) => target + 1,
            Self::Stencil => Self::COUNT - 1,
        }
    }
}

impl fmt::Display for InputAttachment {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Depth => write!(out, "the depth target"),
            Self::Color(target) => write!(out, "colour target {target}"),
            Self::Stencil => write!(out, "the stencil of the depth target"),
        }
    }
}

/// A set of targets of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct InputAttachmentMask(u16);

impl InputAttachmentMask {
    pub(crate) fn insert(&mut self, input: InputAttachment) {
        self.0 |= 1 << input.index();
    }

    pub(crate) fn contains(self, input: InputAttachment) -> bool {
        self.0 & (1 << input.index()) != 0
    }

    pub(crate) fn is_empty(self) -> bool {
        self.0 == 0
    }

    pub(crate) fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    pub(crate) fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Returns the targets that are not in `other`.
    pub(crate) fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// True if the set contains depth or stencil.
    pub(crate) fn has_depth(self) -> bool {
        self.contains(InputAttachment::Depth) || self.contains(InputAttachment::Stencil)
    }

    /// Returns the targets in the order of their indices.
    pub(crate) fn iter(self) -> impl Iterator<Item = InputAttachment> {
        (0..InputAttachment::COUNT)
            .filter_map(InputAttachment::from_index)
            .filter(move |input| self.contains(*input))
    }
}

impl FromIterator<InputAttachment> for InputAttachmentMask {
    fn from_iter<I: IntoIterator<Item = InputAttachment>>(inputs: I) -> Self {
        let mut mask = Self::default();
        inputs.into_iter().for_each(|input| mask.insert(input));
        mask
    }
}

/// The layout of the set, destroyed on drop. Its descriptors are never updated after they are bound.
pub(crate) struct InputAttachmentLayout {
    pub(crate) raw: vk::DescriptorSetLayout,
    /// Number of bindings.
    pub(crate) count: u32,
    gpu: Arc<Gpu>,
}

impl InputAttachmentLayout {
    /// Creates the layout. Returns `None` for devices whose shaders cannot read the targets of their pass.
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Result<Option<Self>> {
        let count = gpu.caps.limits.max_input_attachments;
        if count == 0 {
            return Ok(None);
        }
        let binding = |binding| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding)
                .descriptor_type(vk::DescriptorType::INPUT_ATTACHMENT)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::FRAGMENT)
        };
        let bindings: Vec<_> = (0..count).map(binding).collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the count is within the device's limits.
        let raw = unsafe { gpu.device.create_descriptor_set_layout(&info, None) }
            .map_err(Error::vulkan("vkCreateDescriptorSetLayout", "input attachments"))?;
        gpu.name(raw, "layout of input attachments");
        Ok(Some(Self { raw, count, gpu: Arc::clone(gpu) }))
    }
}

impl Drop for InputAttachmentLayout {
    fn drop(&mut self) {
        // SAFETY: the context has waited for the GPU before its parts are dropped.
        unsafe { self.gpu.device.destroy_descriptor_set_layout(self.raw, None) };
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]
    use super::*;

    #[test]
    fn every_place_is_one_target() {
        let all: Vec<InputAttachment> =
            (0..InputAttachment::COUNT).map(|place| InputAttachment::from_index(place).unwrap()).collect();
        assert!(all.iter().zip(0..).all(|(input, place)| input.index() == place));
        assert_eq!(InputAttachment::from_index(InputAttachment::COUNT), None);
        assert_eq!(all.len(), 10);
    }

    #[test]
    fn masks_are_sets() {
        let some: InputAttachmentMask =
            [InputAttachment::Color(2), InputAttachment::Depth].into_iter().collect();
        assert!(
            some.contains(InputAttachment::Depth)
                && some.has_depth()
                && !some.contains(InputAttachment::Color(1))
        );
        assert_eq!(some.iter().collect::<Vec<_>>(), [InputAttachment::Depth, InputAttachment::Color(2)]);
        let depth: InputAttachmentMask = [InputAttachment::Depth].into_iter().collect();
        assert_eq!(some.without(depth).iter().collect::<Vec<_>>(), [InputAttachment::Color(2)]);
        assert!(some.intersects(depth) && !some.without(depth).intersects(depth));
        assert_eq!(some.union(depth), some);
        assert!(some.without(some).is_empty());
    }
}
