//! The second descriptor set: the targets of a pass as its own fragment shaders read them.

use std::fmt;
use std::sync::Arc;

use ash::vk;

use crate::error::{Error, Result};
use crate::gpu::Gpu;

/// A target of a pass that fragment shaders read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Input {
    Depth,
    /// By its place among the colour targets.
    Color(u32),
    Stencil,
}

impl Input {
    /// Colour targets of a pass.
    const COLORS: u32 = 8;
    /// Places of the set on devices that allow so many.
    pub(crate) const COUNT: u32 = Self::COLORS + 2;

    /// What is at a place. Depth and the first colours come first, as some devices have four inputs in all.
    pub(crate) fn at(place: u32) -> Option<Self> {
        match place {
            0 => Some(Self::Depth),
            color if color <= Self::COLORS => Some(Self::Color(color - 1)),
            last if last + 1 == Self::COUNT => Some(Self::Stencil),
            _ => None,
        }
    }

    /// Its place: its binding in the set, and its `input_attachment_index`, which has the same limit.
    pub(crate) fn place(self) -> u32 {
        match self {
            Self::Depth => 0,
            Self::Color(target) => target + 1,
            Self::Stencil => Self::COUNT - 1,
        }
    }
}

impl fmt::Display for Input {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Depth => write!(out, "the depth target"),
            Self::Color(target) => write!(out, "colour target {target}"),
            Self::Stencil => write!(out, "the stencil of the depth target"),
        }
    }
}

/// Some targets of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct InputMask(u16);

impl InputMask {
    pub(crate) fn insert(&mut self, input: Input) {
        self.0 |= 1 << input.place();
    }

    pub(crate) fn contains(self, input: Input) -> bool {
        self.0 & (1 << input.place()) != 0
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

    /// Those that `other` lacks.
    pub(crate) fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Whether depth or stencil is among them.
    pub(crate) fn has_depth(self) -> bool {
        self.contains(Input::Depth) || self.contains(Input::Stencil)
    }

    /// By their places.
    pub(crate) fn iter(self) -> impl Iterator<Item = Input> {
        (0..Input::COUNT).filter_map(Input::at).filter(move |input| self.contains(*input))
    }
}

impl FromIterator<Input> for InputMask {
    fn from_iter<I: IntoIterator<Item = Input>>(inputs: I) -> Self {
        let mut mask = Self::default();
        inputs.into_iter().for_each(|input| mask.insert(input));
        mask
    }
}

/// The layout of the set, destroyed on drop. Its descriptors are never updated after they are bound.
pub(crate) struct InputLayout {
    pub(crate) raw: vk::DescriptorSetLayout,
    /// Bindings it has.
    pub(crate) count: u32,
    gpu: Arc<Gpu>,
}

impl InputLayout {
    /// `None` for devices whose shaders cannot read what their pass draws.
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
            .map_err(Error::vulkan("vkCreateDescriptorSetLayout"))?;
        gpu.name(raw, "layout of input attachments");
        Ok(Some(Self { raw, count, gpu: Arc::clone(gpu) }))
    }
}

impl Drop for InputLayout {
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
        let all: Vec<Input> = (0..Input::COUNT).map(|place| Input::at(place).unwrap()).collect();
        assert!(all.iter().zip(0..).all(|(input, place)| input.place() == place));
        assert_eq!(Input::at(Input::COUNT), None);
        assert_eq!(all.len(), 10);
    }

    #[test]
    fn masks_are_sets() {
        let some: InputMask = [Input::Color(2), Input::Depth].into_iter().collect();
        assert!(some.contains(Input::Depth) && some.has_depth() && !some.contains(Input::Color(1)));
        assert_eq!(some.iter().collect::<Vec<_>>(), [Input::Depth, Input::Color(2)]);
        let depth: InputMask = [Input::Depth].into_iter().collect();
        assert_eq!(some.without(depth).iter().collect::<Vec<_>>(), [Input::Color(2)]);
        assert!(some.intersects(depth) && !some.without(depth).intersects(depth));
        assert_eq!(some.union(depth), some);
        assert!(some.without(some).is_empty());
    }
}
