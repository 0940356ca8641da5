//! How colours are combined with what is in a target, and which channels are written.

use ash::vk;
use bitflags::bitflags;

/// What a colour is multiplied by before both are combined (`VkBlendFactor`). The source is what the fragment shader
/// puts out, the target what is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BlendFactor {
    /// 0.
    Zero,
    /// 1.
    One,
    /// The source's own channels.
    Source,
    /// 1 minus the source's own channels.
    OneMinusSource,
    /// The target's own channels.
    Target,
    /// 1 minus the target's own channels.
    OneMinusTarget,
    /// The source's alpha.
    SourceAlpha,
    /// 1 minus the source's alpha.
    OneMinusSourceAlpha,
    /// The target's alpha.
    TargetAlpha,
    /// 1 minus the target's alpha.
    OneMinusTargetAlpha,
    /// The channels of [`RenderPass::blend_constants`](crate::RenderPass::blend_constants).
    Constant,
    /// 1 minus those.
    OneMinusConstant,
    /// The alpha of [`RenderPass::blend_constants`](crate::RenderPass::blend_constants).
    ConstantAlpha,
    /// 1 minus that.
    OneMinusConstantAlpha,
    /// The lesser of the source's alpha and 1 minus the target's; 1 for alpha.
    SourceAlphaSaturate,
    /// The channels of the shader's second output, `layout(location = 0, index = 1)`
    /// ([`OptionalFeature::DualSourceBlend`](crate::OptionalFeature::DualSourceBlend)).
    Second,
    /// 1 minus those.
    OneMinusSecond,
    /// The alpha of that output.
    SecondAlpha,
    /// 1 minus that.
    OneMinusSecondAlpha,
}

impl BlendFactor {
    fn raw(self) -> vk::BlendFactor {
        match self {
            Self::Zero => vk::BlendFactor::ZERO,
            Self::One => vk::BlendFactor::ONE,
            Self::Source => vk::BlendFactor::SRC_COLOR,
            Self::OneMinusSource => vk::BlendFactor::ONE_MINUS_SRC_COLOR,
            Self::Target => vk::BlendFactor::DST_COLOR,
            Self::OneMinusTarget => vk::BlendFactor::ONE_MINUS_DST_COLOR,
            Self::SourceAlpha => vk::BlendFactor::SRC_ALPHA,
            Self::OneMinusSourceAlpha => vk::BlendFactor::ONE_MINUS_SRC_ALPHA,
            Self::TargetAlpha => vk::BlendFactor::DST_ALPHA,
            Self::OneMinusTargetAlpha => vk::BlendFactor::ONE_MINUS_DST_ALPHA,
            Self::Constant => vk::BlendFactor::CONSTANT_COLOR,
            Self::OneMinusConstant => vk::BlendFactor::ONE_MINUS_CONSTANT_COLOR,
            Self::ConstantAlpha => vk::BlendFactor::CONSTANT_ALPHA,
            Self::OneMinusConstantAlpha => vk::BlendFactor::ONE_MINUS_CONSTANT_ALPHA,
            Self::SourceAlphaSaturate => vk::BlendFactor::SRC_ALPHA_SATURATE,
            Self::Second => vk::BlendFactor::SRC1_COLOR,
            Self::OneMinusSecond => vk::BlendFactor::ONE_MINUS_SRC1_COLOR,
            Self::SecondAlpha => vk::BlendFactor::SRC1_ALPHA,
            Self::OneMinusSecondAlpha => vk::BlendFactor::ONE_MINUS_SRC1_ALPHA,
        }
    }

    fn is_second(self) -> bool {
        matches!(self, Self::Second | Self::OneMinusSecond | Self::SecondAlpha | Self::OneMinusSecondAlpha)
    }

    fn is_constant(self) -> bool {
        use BlendFactor::{Constant, ConstantAlpha, OneMinusConstant, OneMinusConstantAlpha};
        matches!(self, Constant | OneMinusConstant | ConstantAlpha | OneMinusConstantAlpha)
    }
}

/// How source and target are combined once they are multiplied (`VkBlendOp`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum BlendOp {
    /// Source + target.
    #[default]
    Add,
    /// Source - target.
    Subtract,
    /// Target - source.
    ReverseSubtract,
    /// The lesser; factors do not count.
    Min,
    /// The greater; factors do not count.
    Max,
}

impl BlendOp {
    fn raw(self) -> vk::BlendOp {
        match self {
            Self::Add => vk::BlendOp::ADD,
            Self::Subtract => vk::BlendOp::SUBTRACT,
            Self::ReverseSubtract => vk::BlendOp::REVERSE_SUBTRACT,
            Self::Min => vk::BlendOp::MIN,
            Self::Max => vk::BlendOp::MAX,
        }
    }
}

/// How some of the channels are combined: `source * factor op target * factor`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct BlendPart {
    /// Factor of the source.
    pub source: BlendFactor,
    /// Factor of the target.
    pub target: BlendFactor,
    /// What is done with both.
    pub op: BlendOp,
}

impl BlendPart {
    /// The sum of both, multiplied by their factors.
    pub const fn sum(source: BlendFactor, target: BlendFactor) -> Self {
        Self { source, target, op: BlendOp::Add }
    }
}

/// How a colour is combined with what is in the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Blend {
    /// Red, green and blue.
    pub color: BlendPart,
    /// Alpha.
    pub alpha: BlendPart,
}

impl Blend {
    /// `source * alpha + target * (1 - alpha)`.
    pub const ALPHA: Self = Self {
        color: BlendPart::sum(BlendFactor::SourceAlpha, BlendFactor::OneMinusSourceAlpha),
        alpha: BlendPart::sum(BlendFactor::One, BlendFactor::OneMinusSourceAlpha),
    };
    /// `source + target * (1 - alpha)`.
    pub const PREMULTIPLIED_ALPHA: Self =
        Self::both(BlendPart::sum(BlendFactor::One, BlendFactor::OneMinusSourceAlpha));
    /// `source + target`.
    pub const ADDITIVE: Self = Self::both(BlendPart::sum(BlendFactor::One, BlendFactor::One));

    /// Colour and alpha alike.
    pub const fn both(part: BlendPart) -> Self {
        Self { color: part, alpha: part }
    }

    fn factors(self) -> [BlendFactor; 4] {
        [self.color.source, self.color.target, self.alpha.source, self.alpha.target]
    }

    /// Whether the fragment shader's second output counts.
    pub(super) fn takes_second(self) -> bool {
        self.factors().into_iter().any(BlendFactor::is_second)
    }

    /// Whether the pass's constants count.
    pub(super) fn takes_constants(self) -> bool {
        self.factors().into_iter().any(BlendFactor::is_constant)
    }
}

bitflags! {
    /// Channels of a target.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct ColorWrites: u32 {
        /// Red.
        const RED = 1 << 0;
        /// Green.
        const GREEN = 1 << 1;
        /// Blue.
        const BLUE = 1 << 2;
        /// Alpha.
        const ALPHA = 1 << 3;
    }
}

/// What Vulkan takes for one target. Vulkan's bits of channels are those of [`ColorWrites`].
pub(super) fn blend_state(blend: Option<Blend>, write: ColorWrites) -> vk::PipelineColorBlendAttachmentState {
    let state = vk::PipelineColorBlendAttachmentState::default()
        .color_write_mask(vk::ColorComponentFlags::from_raw(write.bits()));
    let Some(Blend { color, alpha }) = blend else { return state };
    state
        .blend_enable(true)
        .src_color_blend_factor(color.source.raw())
        .dst_color_blend_factor(color.target.raw())
        .color_blend_op(color.op.raw())
        .src_alpha_blend_factor(alpha.source.raw())
        .dst_alpha_blend_factor(alpha.target.raw())
        .alpha_blend_op(alpha.op.raw())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_those_of_vulkan() {
        for (own, raw) in [
            (ColorWrites::RED, vk::ColorComponentFlags::R),
            (ColorWrites::GREEN, vk::ColorComponentFlags::G),
            (ColorWrites::BLUE, vk::ColorComponentFlags::B),
            (ColorWrites::ALPHA, vk::ColorComponentFlags::A),
        ] {
            assert_eq!(blend_state(None, own).color_write_mask, raw);
        }
    }

    #[test]
    fn what_a_factor_takes_is_known_wherever_it_stands() {
        let sum = BlendPart::sum;
        let (one, second, constant) = (BlendFactor::One, BlendFactor::SecondAlpha, BlendFactor::Constant);
        assert!(!Blend::ALPHA.takes_second() && !Blend::ADDITIVE.takes_constants());
        let alpha = Blend { alpha: sum(one, second), ..Blend::ALPHA };
        assert!(alpha.takes_second() && !alpha.takes_constants());
        let color = Blend { color: sum(constant, one), ..Blend::ALPHA };
        assert!(color.takes_constants() && !color.takes_second());
    }
}
