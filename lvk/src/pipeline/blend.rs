//! Blending of colours into a target, and the mask of the channels that are written.

use ash::vk;
use bitflags::bitflags;

/// A factor that the source or target colour is multiplied by (`VkBlendFactor`). The source is the output of the
/// fragment shader. The target is the value already in the colour target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BlendFactor {
    /// 0.
    Zero,
    /// 1.
    One,
    /// The source's channels.
    SrcColor,
    /// 1 minus the source's channels.
    OneMinusSrcColor,
    /// The target's channels.
    DstColor,
    /// 1 minus the target's channels.
    OneMinusDstColor,
    /// The source's alpha.
    SrcAlpha,
    /// 1 minus the source's alpha.
    OneMinusSrcAlpha,
    /// The target's alpha.
    DstAlpha,
    /// 1 minus the target's alpha.
    OneMinusDstAlpha,
    /// The channels of [`RenderPass::blend_constants`](crate::RenderPass::blend_constants).
    ConstantColor,
    /// 1 minus the channels of [`RenderPass::blend_constants`](crate::RenderPass::blend_constants).
    OneMinusConstantColor,
    /// The alpha of [`RenderPass::blend_constants`](crate::RenderPass::blend_constants).
    ConstantAlpha,
    /// 1 minus the alpha of [`RenderPass::blend_constants`](crate::RenderPass::blend_constants).
    OneMinusConstantAlpha,
    /// The lesser of the source's alpha and 1 minus the target's alpha. For the alpha channel the factor is 1.
    SrcAlphaSaturate,
    /// The channels of the shader's second output, `layout(location = 0, index = 1)`
    /// ([`OptionalFeature::DualSourceBlend`](crate::OptionalFeature::DualSourceBlend)).
    Src1Color,
    /// 1 minus the channels of the shader's second output.
    OneMinusSrc1Color,
    /// The alpha of the shader's second output.
    Src1Alpha,
    /// 1 minus the alpha of the shader's second output.
    OneMinusSrc1Alpha,
}

impl BlendFactor {
    fn raw(self) -> vk::BlendFactor {
        match self {
            Self::Zero => vk::BlendFactor::ZERO,
            Self::One => vk::BlendFactor::ONE,
            Self::SrcColor => vk::BlendFactor::SRC_COLOR,
            Self::OneMinusSrcColor => vk::BlendFactor::ONE_MINUS_SRC_COLOR,
            Self::DstColor => vk::BlendFactor::DST_COLOR,
            Self::OneMinusDstColor => vk::BlendFactor::ONE_MINUS_DST_COLOR,
            Self::SrcAlpha => vk::BlendFactor::SRC_ALPHA,
            Self::OneMinusSrcAlpha => vk::BlendFactor::ONE_MINUS_SRC_ALPHA,
            Self::DstAlpha => vk::BlendFactor::DST_ALPHA,
            Self::OneMinusDstAlpha => vk::BlendFactor::ONE_MINUS_DST_ALPHA,
            Self::ConstantColor => vk::BlendFactor::CONSTANT_COLOR,
            Self::OneMinusConstantColor => vk::BlendFactor::ONE_MINUS_CONSTANT_COLOR,
            Self::ConstantAlpha => vk::BlendFactor::CONSTANT_ALPHA,
            Self::OneMinusConstantAlpha => vk::BlendFactor::ONE_MINUS_CONSTANT_ALPHA,
            Self::SrcAlphaSaturate => vk::BlendFactor::SRC_ALPHA_SATURATE,
            Self::Src1Color => vk::BlendFactor::SRC1_COLOR,
            Self::OneMinusSrc1Color => vk::BlendFactor::ONE_MINUS_SRC1_COLOR,
            Self::Src1Alpha => vk::BlendFactor::SRC1_ALPHA,
            Self::OneMinusSrc1Alpha => vk::BlendFactor::ONE_MINUS_SRC1_ALPHA,
        }
    }

    fn is_src1(self) -> bool {
        matches!(self, Self::Src1Color | Self::OneMinusSrc1Color | Self::Src1Alpha | Self::OneMinusSrc1Alpha)
    }

    fn is_constant_alpha(self) -> bool {
        matches!(self, Self::ConstantAlpha | Self::OneMinusConstantAlpha)
    }

    fn is_constant(self) -> bool {
        use BlendFactor::{ConstantAlpha, ConstantColor, OneMinusConstantAlpha, OneMinusConstantColor};
        matches!(self, ConstantColor | OneMinusConstantColor | ConstantAlpha | OneMinusConstantAlpha)
    }
}

/// The operation that combines source and target after the multiplication by their factors (`VkBlendOp`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum BlendOp {
    /// Source + target.
    #[default]
    Add,
    /// Source - target.
    Subtract,
    /// Target - source.
    ReverseSubtract,
    /// The lesser of source and target. Factors are ignored.
    Min,
    /// The greater of source and target. Factors are ignored.
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

/// Blend equation of some of the channels: `source * factor op target * factor`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct BlendComponent {
    /// Factor of the source.
    pub source: BlendFactor,
    /// Factor of the target.
    pub target: BlendFactor,
    /// Operation that combines both products.
    pub op: BlendOp,
}

impl BlendComponent {
    /// Returns an equation that adds source and target, multiplied by their factors.
    pub const fn sum(source: BlendFactor, target: BlendFactor) -> Self {
        Self { source, target, op: BlendOp::Add }
    }
}

/// Blend equations of a colour target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Blend {
    /// Red, green and blue.
    pub color: BlendComponent,
    /// Alpha.
    pub alpha: BlendComponent,
}

impl Blend {
    /// `source * alpha + target * (1 - alpha)`.
    pub const ALPHA: Self = Self {
        color: BlendComponent::sum(BlendFactor::SrcAlpha, BlendFactor::OneMinusSrcAlpha),
        alpha: BlendComponent::sum(BlendFactor::One, BlendFactor::OneMinusSrcAlpha),
    };
    /// `source + target * (1 - alpha)`.
    pub const PREMULTIPLIED_ALPHA: Self =
        Self::both(BlendComponent::sum(BlendFactor::One, BlendFactor::OneMinusSrcAlpha));
    /// `source + target`.
    pub const ADDITIVE: Self = Self::both(BlendComponent::sum(BlendFactor::One, BlendFactor::One));

    /// Returns the same equation for colour and alpha.
    pub const fn both(part: BlendComponent) -> Self {
        Self { color: part, alpha: part }
    }

    fn factors(self) -> [BlendFactor; 4] {
        [self.color.source, self.color.target, self.alpha.source, self.alpha.target]
    }

    /// True if a factor uses the fragment shader's second output.
    pub(super) fn is_dual_source(self) -> bool {
        self.factors().into_iter().any(BlendFactor::is_src1)
    }

    /// True if a factor of the colour is the alpha of the blend constants.
    pub(super) fn takes_constant_alpha(self) -> bool {
        [self.color.source, self.color.target].into_iter().any(BlendFactor::is_constant_alpha)
    }

    /// True if a factor uses the blend constants of the pass.
    pub(super) fn uses_constants(self) -> bool {
        self.factors().into_iter().any(BlendFactor::is_constant)
    }
}

bitflags! {
    /// Channels of a target.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct ColorWriteMask: u32 {
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

/// Returns Vulkan's blend state of one target. The bits of [`ColorWriteMask`] are those of `VkColorComponentFlags`.
pub(super) fn blend_state(
    blend: Option<Blend>,
    write: ColorWriteMask,
) -> vk::PipelineColorBlendAttachmentState {
    let state = vk::PipelineColorBlendAttachmentState::default().color_write_mask(
        vk::ColorComponentFlags::from_raw(write.intersection(ColorWriteMask::all()).bits()),
    );
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
            (ColorWriteMask::RED, vk::ColorComponentFlags::R),
            (ColorWriteMask::GREEN, vk::ColorComponentFlags::G),
            (ColorWriteMask::BLUE, vk::ColorComponentFlags::B),
            (ColorWriteMask::ALPHA, vk::ColorComponentFlags::A),
            (ColorWriteMask::from_bits_retain(0xf1), vk::ColorComponentFlags::R),
        ] {
            assert_eq!(blend_state(None, own).color_write_mask, raw);
        }
    }

    #[test]
    fn inputs_of_a_factor_are_known_in_every_position() {
        let sum = BlendComponent::sum;
        let (one, second, constant) = (BlendFactor::One, BlendFactor::Src1Alpha, BlendFactor::ConstantColor);
        assert!(!Blend::ALPHA.is_dual_source() && !Blend::ADDITIVE.uses_constants());
        let alpha = Blend { alpha: sum(one, second), ..Blend::ALPHA };
        assert!(alpha.is_dual_source() && !alpha.uses_constants());
        let color = Blend { color: sum(constant, one), ..Blend::ALPHA };
        assert!(color.uses_constants() && !color.is_dual_source());
    }
}
