//! Features that a graphics pipeline needs and that devices with `VK_KHR_portability_subset` may lack.

use super::graphics_desc::{RenderPipelineDesc, VertexBinding};
use super::rasterization::{PolygonMode, Topology};
use crate::error::{Error, Result};
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::gpu::caps::portability::PortabilityNeed;
use crate::shader::Primitive;

const TRIANGLE_FAN: PortabilityNeed = PortabilityNeed::new(
    OptionalFeature::TriangleFans,
    "the topology TriangleFan",
    "draw Triangles with indices",
);
const POINT_POLYGONS: PortabilityNeed = PortabilityNeed::new(
    OptionalFeature::PointPolygons,
    "the polygon mode Point",
    "draw the vertices again with Topology::Points",
);
const CONSTANT_ALPHA: PortabilityNeed = PortabilityNeed::new(
    OptionalFeature::ConstantAlphaColorBlend,
    "a colour blend factor of constant alpha",
    "take a factor of constant colour, with the alpha in every channel of the constant",
);
const ISOLINES: PortabilityNeed = PortabilityNeed::new(
    OptionalFeature::TessellationIsolines,
    "tessellation into isolines",
    "draw lines whose vertices the vertex shader computes",
);
const POINT_MODE: PortabilityNeed = PortabilityNeed::new(
    OptionalFeature::TessellationPointMode,
    "tessellation into points",
    "draw points whose positions the vertex shader computes",
);

/// Returns the uses of such features. `tessellated` is the primitive that the evaluation shader declares.
pub(super) fn needs(
    desc: &RenderPipelineDesc<'_>,
    tessellated: Option<Primitive>,
) -> impl Iterator<Item = PortabilityNeed> {
    let constant_alpha =
        desc.color.iter().filter_map(|target| target.blend).any(|blend| blend.takes_constant_alpha());
    [
        (desc.mesh.is_none() && desc.topology == Topology::TriangleFan, TRIANGLE_FAN),
        (desc.polygon == PolygonMode::Point, POINT_POLYGONS),
        (constant_alpha, CONSTANT_ALPHA),
        (tessellated == Some(Primitive::Lines), ISOLINES),
        (tessellated == Some(Primitive::Points), POINT_MODE),
    ]
    .into_iter()
    .filter(|(used, _)| *used)
    .map(|(_, need)| need)
}

/// Fails unless each stride is a multiple of `alignment`, and not less.
pub(super) fn check_strides(name: &str, bindings: &[VertexBinding], alignment: u32) -> Result<()> {
    let fits = |stride: u32| stride >= alignment && stride.is_multiple_of(alignment);
    match bindings.iter().enumerate().find(|(_, binding)| !fits(binding.stride)) {
        None => Ok(()),
        Some((index, binding)) => {
            let what =
                format!("the stride {} of vertex binding {index} of pipeline '{name}'", binding.stride);
            let why = format!("the device takes multiples of {alignment} bytes; pad the vertices");
            Err(Error::unsupported(what, why))
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]
    use proptest::prelude::*;

    use super::*;
    use crate::format::Format;
    use crate::pipeline::blend::{Blend, BlendComponent, BlendFactor};
    use crate::pipeline::graphics_desc::ColorTarget;

    fn features(desc: &RenderPipelineDesc<'_>, tessellated: Option<Primitive>) -> Vec<OptionalFeature> {
        needs(desc, tessellated).map(|need| need.feature).collect()
    }

    #[test]
    fn plain_pipelines_need_nothing() {
        assert!(features(&RenderPipelineDesc::default(), Some(Primitive::Triangles)).is_empty());
    }

    #[test]
    fn each_use_needs_its_feature() {
        let plain = RenderPipelineDesc::default();
        let fan = RenderPipelineDesc { topology: Topology::TriangleFan, ..plain };
        assert_eq!(features(&fan, None), [OptionalFeature::TriangleFans]);
        let points = RenderPipelineDesc { polygon: PolygonMode::Point, ..plain };
        assert_eq!(features(&points, None), [OptionalFeature::PointPolygons]);
        assert_eq!(features(&plain, Some(Primitive::Lines)), [OptionalFeature::TessellationIsolines]);
        assert_eq!(features(&plain, Some(Primitive::Points)), [OptionalFeature::TessellationPointMode]);
    }

    #[test]
    fn constant_alpha_counts_in_factors_of_colour_alone() {
        let sum = BlendComponent::sum;
        let plain = sum(BlendFactor::One, BlendFactor::Zero);
        for factor in [BlendFactor::ConstantAlpha, BlendFactor::OneMinusConstantAlpha] {
            for (color, alpha, expected) in [
                (sum(factor, BlendFactor::One), plain, true),
                (sum(BlendFactor::One, factor), plain, true),
                (plain, sum(factor, factor), false),
                (sum(BlendFactor::ConstantColor, BlendFactor::SrcAlpha), plain, false),
            ] {
                let color = [ColorTarget::blended(Format::Rgba8Unorm, Blend { color, alpha })];
                let desc = RenderPipelineDesc { color: &color, ..RenderPipelineDesc::default() };
                assert_eq!(!features(&desc, None).is_empty(), expected, "{color:?}");
            }
        }
    }

    proptest! {
        #[test]
        fn strides_are_multiples_of_the_alignment(
            strides in prop::collection::vec(0..64_u32, 0..4), exponent in 0..5_u32
        ) {
            let alignment = 1 << exponent;
            let bindings: Vec<_> =
                strides.iter().map(|stride| VertexBinding { stride: *stride, per_instance: false }).collect();
            let wrong = strides.iter().position(|stride| *stride == 0 || stride % alignment != 0);
            match (check_strides("p", &bindings, alignment), wrong) {
                (Ok(()), None) => {}
                (Err(Error::Unsupported { what, .. }), Some(index)) => {
                    let part = format!("of vertex binding {} of pipeline 'p'", index);
                    prop_assert!(what.contains(&part), "{}", what);
                }
                (other, _) => prop_assert!(false, "{:?}", other),
            }
        }
    }
}
