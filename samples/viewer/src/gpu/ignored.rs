//! Features of a model that the viewer ignores.

use lvk_gltf::Model;

/// Sets of texture coordinates that shaders read.
const SETS: usize = 2;

/// Returns a warning for each material with an occlusion texture, and for each texture with a further set of coordinates.
pub(super) fn warnings(model: &Model) -> Vec<String> {
    let mut found = Vec::new();
    for (place, material) in model.materials.iter().enumerate() {
        let name = material.name.as_deref().unwrap_or("without a name");
        if material.occlusion_texture.is_some() && material.occlusion_strength > 0.0 {
            found.push(format!(
                "material {place} '{name}': occlusionTexture is ignored, as rays find occlusion"
            ));
        }
        let shown = material.textures().filter(|(texture, _)| *texture != "occlusionTexture");
        for (texture, reference) in shown.filter(|(_, reference)| reference.tex_coord >= SETS) {
            found.push(format!(
                "material {place} '{name}': {texture} wants texture coordinates {}, and has those of {}; write at most \
                 {SETS} sets",
                reference.tex_coord,
                SETS - 1
            ));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use lvk_gltf::{Material, TextureRef};

    use super::*;

    #[test]
    fn occlusion_and_further_sets_are_told() {
        let texture = |tex_coord| Some(TextureRef { image: 0, sampler: 0, tex_coord, transform: None });
        let named = |name: &str| Some(name.to_owned());
        let materials = vec![
            Material { name: named("shown"), base_color_texture: texture(1), ..Material::default() },
            Material { name: named("wall"), occlusion_texture: texture(2), ..Material::default() },
            Material { emissive_texture: texture(2), ..Material::default() },
        ];
        let told = super::warnings(&Model { materials, ..Model::default() });
        assert_eq!(told.len(), 2, "{told:?}");
        assert!(told[0].starts_with("material 1 'wall': occlusionTexture is ignored"), "{told:?}");
        assert!(told[1].starts_with("material 2 'without a name': emissiveTexture wants"), "{told:?}");
    }
}
