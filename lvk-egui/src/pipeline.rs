//! The pipeline of the interface, for the targets of a pass.

use bytemuck::{Pod, Zeroable};
use lvk::{
    Blend, BlockLayout, ColorTarget, CompareOp, Context, CullMode, DepthTest, Format, Holder,
    RenderPipelineDesc, RenderPipelineHandle, ShaderModuleDesc, ShaderSource, ShaderStage,
};

use crate::error::{Error, Result};

const VERTEX: &[u8] = include_bytes!("shaders/ui.vert.spv");
const FRAGMENT: &[u8] = include_bytes!("shaders/ui.frag.spv");

/// The targets of the render passes that an interface is painted in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Target {
    /// Format of the only colour target.
    pub color: Format,
    /// Format of the depth target, if the passes have one. The interface neither tests nor writes it.
    pub depth: Option<Format>,
    /// Samples of a pixel.
    pub samples: u32,
}

impl From<Format> for Target {
    fn from(color: Format) -> Self {
        Self { color, depth: None, samples: 1 }
    }
}

lvk::shader_struct! {
    /// `Push` in `shaders/push.glsl`.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Push {
        pub(crate) vertices: u64,
        pub(crate) clip_per_point: [f32; 2],
        pub(crate) tex: u32,
        pub(crate) smp: u32,
        /// [`LINEAR_TARGET`] and [`LINEAR_TEXELS`].
        pub(crate) flags: u32,
        pub(crate) _padding: u32,
    }
}

/// The target holds linear light.
pub(crate) const LINEAR_TARGET: u32 = 1;
/// The texels of the texture are linear light.
pub(crate) const LINEAR_TEXELS: u32 = 2;

/// The encoding of colours in a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TargetEncoding {
    /// As numbers from 0 to 1, which are taken as encoded sRGB.
    Encoded,
    /// As linear light.
    Linear,
}

/// Returns how a format holds colours; `None` for formats that do not hold colours.
pub(crate) fn encoding(format: Format) -> Option<TargetEncoding> {
    match format {
        Format::Rgba8Unorm | Format::Bgra8Unorm | Format::Rgba16Unorm => Some(TargetEncoding::Encoded),
        Format::Rgb10A2Unorm | Format::Bgr10A2Unorm => Some(TargetEncoding::Encoded),
        Format::Rgba8Srgb
        | Format::Bgra8Srgb
        | Format::Rgba16Float
        | Format::Rgba32Float
        | Format::Rg11B10Float => Some(TargetEncoding::Linear),
        _ => None,
    }
}

/// Creates the pipeline for targets.
pub(crate) fn create_pipeline(ctx: &Context, target: &Target) -> Result<Holder<RenderPipelineHandle>> {
    if encoding(target.color).is_none() {
        return Err(Error::UnsupportedTarget { format: target.color });
    }
    let module = |stage, spirv, debug_name| {
        let words = words(spirv);
        let source = ShaderSource::Spirv(&words);
        ctx.create_shader_module(&ShaderModuleDesc { stage, source, debug_name, ..Default::default() })
    };
    let vertex = module(ShaderStage::Vertex, VERTEX, "egui.vert")?;
    let fragment = module(ShaderStage::Fragment, FRAGMENT, "egui.frag")?;
    let depth = |format| DepthTest { format, compare: CompareOp::Always, write: false };
    let pipeline = ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*fragment),
        cull: CullMode::None,
        color: &[ColorTarget::blended(target.color, Blend::PREMULTIPLIED_ALPHA)],
        depth: target.depth.map(depth),
        samples: target.samples,
        layouts: &[BlockLayout::push_constants::<Push>()],
        debug_name: "egui",
        ..RenderPipelineDesc::default()
    });
    Ok(pipeline?)
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

    use lvk::{Capabilities, compile_glsl};

    use super::*;

    /// `LVK_UPDATE_KERNELS=1 cargo test -p lvk-egui` writes the words.
    #[test]
    fn the_words_are_those_of_the_source() {
        let push = include_str!("shaders/push.glsl");
        let sources = [
            (ShaderStage::Vertex, "ui.vert", include_str!("shaders/ui.vert.glsl")),
            (ShaderStage::Fragment, "ui.frag", include_str!("shaders/ui.frag.glsl")),
        ];
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/shaders");
        for (stage, name, text) in sources {
            let includes = &[("push.glsl", push)];
            let source = ShaderSource::Glsl(text);
            let desc = ShaderModuleDesc { stage, source, includes, debug_name: name, ..Default::default() };
            let words = compile_glsl(&desc, &Capabilities::default()).unwrap();
            let (path, bytes) = (folder.join(format!("{name}.spv")), bytemuck::cast_slice(&words));
            if std::env::var("LVK_UPDATE_KERNELS").is_ok() {
                std::fs::write(path, bytes).unwrap();
            } else {
                assert!(std::fs::read(path).unwrap() == *bytes, "{name}: set LVK_UPDATE_KERNELS=1 once");
            }
        }
    }

    #[test]
    fn formats_without_colours_are_no_targets() {
        assert_eq!(encoding(Format::Bgra8Unorm), Some(TargetEncoding::Encoded));
        assert_eq!(encoding(Format::Bgra8Srgb), Some(TargetEncoding::Linear));
        assert_eq!(encoding(Format::Rgba16Float), Some(TargetEncoding::Linear));
        for format in [Format::R8Unorm, Format::Rgba8Uint, Format::D32Float, Format::Rgba8Snorm] {
            assert_eq!(encoding(format), None, "{format:?}");
        }
    }
}
