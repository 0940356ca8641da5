//! Layouts in which images are exchanged with other engines.

use ash::vk;

use super::emit_barriers::vulkan_layout;
use crate::barrier::Layout;
use crate::format::Format;
use crate::resource::texture_desc::TextureUsage;

/// Layouts that an exchanged image can have.
const EXCHANGED: [Layout; 9] = [
    Layout::Undefined,
    Layout::General,
    Layout::ShaderRead,
    Layout::ExternalShaderRead,
    Layout::ExternalDepthRead,
    Layout::ColorTarget,
    Layout::DepthTarget,
    Layout::TransferSrc,
    Layout::TransferDst,
];

/// Returns the layout for a Vulkan layout of an exchanged image. Fails for layouts that cannot be exchanged, and for
/// those that an image of the format and usage cannot have.
pub(crate) fn exchanged_layout(
    raw: vk::ImageLayout,
    format: Format,
    usage: TextureUsage,
) -> Result<Layout, String> {
    let layout = EXCHANGED.into_iter().find(|known| vulkan_layout(*known) == raw).ok_or_else(|| {
        let names: Vec<_> = EXCHANGED.iter().map(|known| format!("{:?}", vulkan_layout(*known))).collect();
        format!("the layout {raw:?} cannot be exchanged; take one of {}", names.join(", "))
    })?;
    let is_color = format.aspects() == vk::ImageAspectFlags::COLOR;
    let (target, sampled) = (usage.contains(TextureUsage::TARGET), usage.intersects(SAMPLED));
    let needs = match layout {
        Layout::ColorTarget if !(is_color && target) => "a colour format and TextureUsage::TARGET",
        Layout::DepthTarget | Layout::ExternalDepthRead if is_color || !target => {
            "a depth or stencil format and TextureUsage::TARGET"
        }
        Layout::ExternalShaderRead if !sampled => "TextureUsage::SAMPLED",
        Layout::ShaderRead if !sampled && (is_color || !target) => "TextureUsage::SAMPLED",
        _ => return Ok(layout),
    };
    Err(format!("the layout {raw:?} needs {needs}; the texture has the format {format:?} and {usage:?}"))
}

/// Usages whose images shaders sample.
const SAMPLED: TextureUsage = TextureUsage::SAMPLED.union(TextureUsage::INPUT);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_exchanged_layout_has_its_vulkan_layout() {
        let usage = TextureUsage::SAMPLED | TextureUsage::TARGET;
        for layout in EXCHANGED {
            let (raw, of_color) = (vulkan_layout(layout), layout == Layout::ColorTarget);
            let format = if of_color { Format::Rgba8Unorm } else { Format::D32Float };
            assert_eq!(exchanged_layout(raw, format, usage), Ok(layout));
        }
    }

    #[test]
    fn layouts_that_an_image_cannot_have_are_refused() {
        use vk::ImageLayout as Raw;
        let (color, depth) = (Format::Rgba8Unorm, Format::D32Float);
        for (raw, format, usage, words) in [
            (Raw::PRESENT_SRC_KHR, color, TextureUsage::TARGET, "cannot be exchanged"),
            (Raw::COLOR_ATTACHMENT_OPTIMAL, color, TextureUsage::SAMPLED, "a colour format"),
            (Raw::COLOR_ATTACHMENT_OPTIMAL, depth, TextureUsage::TARGET, "a colour format"),
            (Raw::DEPTH_STENCIL_ATTACHMENT_OPTIMAL, color, TextureUsage::TARGET, "a depth or stencil format"),
            (Raw::DEPTH_STENCIL_READ_ONLY_OPTIMAL, color, TextureUsage::SAMPLED, "a depth or stencil format"),
            (Raw::DEPTH_STENCIL_READ_ONLY_OPTIMAL, depth, TextureUsage::SAMPLED, "TextureUsage::TARGET"),
            (Raw::SHADER_READ_ONLY_OPTIMAL, color, TextureUsage::STORAGE, "TextureUsage::SAMPLED"),
            (Raw::READ_ONLY_OPTIMAL, color, TextureUsage::TARGET, "TextureUsage::SAMPLED"),
        ] {
            let message = exchanged_layout(raw, format, usage).unwrap_err();
            assert!(message.contains(words), "{message}");
        }
        assert_eq!(
            exchanged_layout(Raw::READ_ONLY_OPTIMAL, depth, TextureUsage::TARGET),
            Ok(Layout::ShaderRead)
        );
    }
}
