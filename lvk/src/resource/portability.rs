//! Features that textures and samplers need and that devices with `VK_KHR_portability_subset` may lack.

use super::swizzle::Swizzle;
use super::texture_desc::{TextureDesc, TextureUsage};
use crate::format::Format;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::gpu::caps::portability::PortabilityNeed;

const SWIZZLE: PortabilityNeed =
    PortabilityNeed::new(OptionalFeature::ViewSwizzle, "the swizzle", "reorder the channels in the shader");
const REINTERPRETATION: PortabilityNeed = PortabilityNeed::new(
    OptionalFeature::ViewFormatReinterpretation,
    "a view format with other components",
    "copy the texels through a buffer to a texture of that format",
);
const MULTISAMPLED_ARRAY: PortabilityNeed = PortabilityNeed::new(
    OptionalFeature::MultisampledArrays,
    "more than one layer with several samples",
    "create a texture for each layer",
);
const SLICES: PortabilityNeed = PortabilityNeed::new(
    OptionalFeature::View2dOf3d,
    "the usage TARGET of the kind D3",
    "draw to a D2Array, or write the volume as a storage image",
);
const COMPARISON: PortabilityNeed = PortabilityNeed::new(
    OptionalFeature::ComparisonSamplers,
    "the comparison",
    "compare the sampled depth in the shader",
);
const LOD_BIAS: PortabilityNeed = PortabilityNeed::new(
    OptionalFeature::SamplerLodBias,
    "the level of detail bias",
    "give the bias to texture() in the shader",
);

fn used<const N: usize>(table: [(bool, PortabilityNeed); N]) -> impl Iterator<Item = PortabilityNeed> {
    table.into_iter().filter(|(used, _)| *used).map(|(_, need)| need)
}

/// Returns the uses of such features in the description of a texture.
pub(super) fn texture_needs(desc: &TextureDesc<'_>) -> impl Iterator<Item = PortabilityNeed> {
    let reinterpreted = |format: &Format| !format.has_components_of(desc.format);
    used([
        (desc.swizzle != Swizzle::IDENTITY, SWIZZLE),
        (desc.view_formats.iter().any(reinterpreted), REINTERPRETATION),
        (desc.samples > 1 && desc.kind.layers() > 1, MULTISAMPLED_ARRAY),
        (desc.kind.is_3d() && desc.usage.contains(TextureUsage::TARGET), SLICES),
    ])
}

/// Returns the uses of such features in a view of format `format` of an image of format `image`.
pub(super) fn view_needs(
    swizzle: Swizzle,
    format: Format,
    image: Format,
) -> impl Iterator<Item = PortabilityNeed> {
    used([(swizzle != Swizzle::IDENTITY, SWIZZLE), (!format.has_components_of(image), REINTERPRETATION)])
}

/// Returns the uses of such features in a sampler.
pub(super) fn sampler_needs(compares: bool, lod_bias: f32) -> impl Iterator<Item = PortabilityNeed> {
    used([(compares, COMPARISON), (lod_bias != 0.0, LOD_BIAS)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resource::swizzle::Channel;
    use crate::resource::texture_desc::TextureKind;

    const GREY: Swizzle = Swizzle { green: Channel::Red, blue: Channel::Red, ..Swizzle::IDENTITY };

    fn features(needs: impl Iterator<Item = PortabilityNeed>) -> Vec<OptionalFeature> {
        needs.map(|need| need.feature).collect()
    }

    #[test]
    fn each_use_of_a_texture_needs_its_feature() {
        let plain = TextureDesc { format: Format::Rgba8Unorm, ..TextureDesc::default() };
        assert!(features(texture_needs(&plain)).is_empty());
        let volume = TextureKind::D3 { depth: 4 };
        for (desc, feature) in [
            (TextureDesc { swizzle: GREY, ..plain }, OptionalFeature::ViewSwizzle),
            (
                TextureDesc { view_formats: &[Format::Rgba8Srgb, Format::R32Uint], ..plain },
                OptionalFeature::ViewFormatReinterpretation,
            ),
            (
                TextureDesc { kind: TextureKind::D2Array { layers: 2 }, samples: 4, ..plain },
                OptionalFeature::MultisampledArrays,
            ),
            (TextureDesc { kind: volume, usage: TextureUsage::TARGET, ..plain }, OptionalFeature::View2dOf3d),
        ] {
            assert_eq!(features(texture_needs(&desc)), [feature]);
        }
    }

    #[test]
    fn uses_that_every_device_has_need_nothing() {
        let plain = TextureDesc { format: Format::Rgba8Unorm, ..TextureDesc::default() };
        let encodings = &[Format::Rgba8Srgb, Format::Bgra8Unorm, Format::Rgba8Uint];
        for desc in [
            TextureDesc { view_formats: encodings, ..plain },
            TextureDesc { kind: TextureKind::D2Array { layers: 1 }, samples: 4, ..plain },
            TextureDesc { kind: TextureKind::D3 { depth: 4 }, usage: TextureUsage::SAMPLED, ..plain },
        ] {
            assert!(features(texture_needs(&desc)).is_empty(), "{desc:?}");
        }
    }

    #[test]
    fn views_of_planes_are_reinterpreted() {
        let view = |format, image| features(view_needs(Swizzle::IDENTITY, format, image));
        assert_eq!(view(Format::R8Unorm, Format::Nv12), [OptionalFeature::ViewFormatReinterpretation]);
        assert!(view(Format::D32Float, Format::D32Float).is_empty());
        assert!(view(Format::Bc7Srgb, Format::Bc7Unorm).is_empty());
        assert_eq!(
            features(view_needs(GREY, Format::D32Float, Format::D32Float)),
            [OptionalFeature::ViewSwizzle]
        );
    }

    #[test]
    fn each_use_of_a_sampler_needs_its_feature() {
        assert!(features(sampler_needs(false, 0.0)).is_empty());
        assert_eq!(features(sampler_needs(true, 0.0)), [OptionalFeature::ComparisonSamplers]);
        assert_eq!(features(sampler_needs(false, -0.5)), [OptionalFeature::SamplerLodBias]);
    }
}
