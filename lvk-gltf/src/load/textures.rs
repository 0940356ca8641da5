//! Textures: which image and sampler a material uses.

use std::collections::HashMap;

use gltf::json::texture::{self as json, MagFilter, MinFilter, WrappingMode};
use gltf::json::validation::Checked;

use super::document::Document;
use super::place::place;
use crate::{ColorSpace, Filter, Problem, Sampler, Warning, Wrap};

/// The images and samplers that materials use.
#[derive(Debug)]
pub(super) struct Textures<'a> {
    document: &'a Document,
    /// Index of the image in the file, and how it is read, in the order of the model.
    pub(super) images: Vec<(usize, ColorSpace)>,
    indices: HashMap<(usize, ColorSpace), usize>,
    /// Samplers of the file and, last, the default one if it is used.
    pub(super) samplers: Vec<Sampler>,
}

impl<'a> Textures<'a> {
    pub(super) fn new(document: &'a Document) -> Self {
        let samplers = document.root.samplers.iter().map(sampler).collect();
        Self { document, images: Vec::new(), indices: HashMap::new(), samplers }
    }

    /// Returns image and sampler of a texture, as indices of the model. A texture without a readable image is left out.
    pub(super) fn use_texture(
        &mut self,
        index: usize,
        space: ColorSpace,
        user: &str,
        warnings: &mut Vec<Warning>,
    ) -> Result<Option<(usize, usize)>, Problem> {
        let count = self.document.root.textures.len();
        let Some(texture) = self.document.root.textures.get(index) else {
            let (index, count) = (index as u64, count as u64);
            return Err(Problem::OutOfRange { place: user.into(), what: "texture", index, count });
        };
        let name = place("texture", index, texture.name.as_deref());
        let Some(source) = self.source(index, texture, &name, warnings) else {
            let reason = "left out, as it has no image in a format that is read".into();
            warnings.push(Warning::ImageIgnored { place: format!("{user}, {name}"), reason });
            return Ok(None);
        };
        let count = self.document.root.images.len();
        if source >= count {
            let (index, count) = (source as u64, count as u64);
            return Err(Problem::OutOfRange {
                place: format!("{user}, {name}"),
                what: "image",
                index,
                count,
            });
        }
        let images = &mut self.images;
        let image = *self.indices.entry((source, space)).or_insert_with(|| {
            images.push((source, space));
            images.len() - 1
        });
        Ok(Some((image, self.sampler_of(texture))))
    }

    /// Chooses among the images of a texture. Basis Universal, which is not decoded, is the last choice.
    fn source(
        &self,
        index: usize,
        texture: &json::Texture,
        name: &str,
        warnings: &mut Vec<Warning>,
    ) -> Option<usize> {
        const NO_SOURCE: usize = u32::MAX as usize; // what the `gltf` crate puts where a texture has no source
        let plain = Some(texture.source.value()).filter(|source| *source != NO_SOURCE);
        let others = self.document.extensions.textures.get(index).map(|texture| &texture.extensions)?;
        if let Some(webp) = others.webp {
            return Some(webp.source as usize);
        }
        if let Some(basisu) = others.basisu {
            if plain.is_none() {
                return Some(basisu.source as usize);
            }
            let reason = "KHR_texture_basisu is ignored, as the texture has another image".into();
            warnings.push(Warning::ImageIgnored { place: name.into(), reason });
        }
        plain
    }

    fn sampler_of(&mut self, texture: &json::Texture) -> usize {
        let of_file = self.document.root.samplers.len();
        texture.sampler.map_or_else(
            || {
                self.samplers.resize(of_file + 1, Sampler::default());
                of_file
            },
            |sampler| sampler.value(),
        )
    }
}

fn sampler(json: &json::Sampler) -> Sampler {
    use MinFilter::{LinearMipmapLinear, LinearMipmapNearest, NearestMipmapLinear, NearestMipmapNearest};
    let (min_filter, mip_filter) = match json.min_filter {
        Some(Checked::Valid(MinFilter::Nearest)) => (Filter::Nearest, None),
        Some(Checked::Valid(MinFilter::Linear)) => (Filter::Linear, None),
        Some(Checked::Valid(NearestMipmapNearest)) => (Filter::Nearest, Some(Filter::Nearest)),
        Some(Checked::Valid(LinearMipmapNearest)) => (Filter::Linear, Some(Filter::Nearest)),
        Some(Checked::Valid(NearestMipmapLinear)) => (Filter::Nearest, Some(Filter::Linear)),
        Some(Checked::Valid(LinearMipmapLinear) | Checked::Invalid) | None => {
            (Filter::Linear, Some(Filter::Linear))
        }
    };
    let nearest = matches!(json.mag_filter, Some(Checked::Valid(MagFilter::Nearest)));
    let mag_filter = if nearest { Filter::Nearest } else { Filter::Linear };
    Sampler { mag_filter, min_filter, mip_filter, wrap_u: wrap(json.wrap_s), wrap_v: wrap(json.wrap_t) }
}

fn wrap(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::ClampToEdge,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::MirroredRepeat,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}
