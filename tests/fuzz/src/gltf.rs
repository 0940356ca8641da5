//! The target `gltf`: what programs rely on of any model that loads.

use lvk_gltf::{LoadOptions, MemoryLimit, Model, Primitive, TextureRef};

use crate::files::with_files;
use crate::gltf_edits::edited_model;

/// Where a target reads a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// Bytes in memory, which may name no other files.
    Memory,
    /// A file, read a part at a time as programs do. It may name `a.bin` beside it, which has the same bytes, and itself, `model`.
    File,
}

/// A `.gltf` or `.glb` file. A first byte below 16 is a number of a model, whose JSON the rest edits: so inputs get behind the
/// container and the parser. Bit 3 of that number, or else bit 2 of the input's length, tells whether the model is read in a file;
/// the length of a `.glb` file is a multiple of 4.
pub(crate) fn read_gltf(bytes: &[u8]) -> bool {
    let place = |is_file: bool| if is_file { Place::File } else { Place::Memory };
    match edited_model(bytes) {
        Some(model) => loads(&model, place(bytes.first().is_some_and(|first| first & 8 != 0))),
        None => loads(bytes, place(bytes.len() & 4 != 0)),
    }
}

/// Reads a file, and checks what programs rely on. True if it loads. Within the bound of the target lie that of the load, and the
/// tables of decoders of images.
fn loads(bytes: &[u8], place: Place) -> bool {
    let memory = MemoryLimit { fixed_bytes: 1 << 20, multiple: 32 };
    let options = LoadOptions { memory, most_threads: Some(1), ..LoadOptions::default() };
    let check = |model: lvk_gltf::Result<Model>| {
        match &model {
            Ok(model) => check_model(model),
            Err(error) => drop(error.to_string()),
        }
        model.is_ok()
    };
    match place {
        Place::Memory => check(Model::from_bytes(bytes, None, &options)),
        Place::File => with_files(&[("model", bytes), ("a.bin", bytes)], |folder| {
            check(Model::load(&folder.join("model"), &options))
        }),
    }
}

fn check_model(model: &Model) {
    model.warnings.iter().for_each(|warning| drop(warning.to_string()));
    for texture in model.materials.iter().flat_map(|material| material.textures()).map(|(_, texture)| texture)
    {
        let TextureRef { image, sampler, .. } = *texture;
        assert!(image < model.images.len() && sampler < model.samplers.len());
    }
    for level in model.images.iter().flat_map(|image| &image.data.mips) {
        assert!(level.width > 0 && level.height > 0 && !level.bytes.is_empty());
    }
    for mesh in &model.meshes {
        mesh.primitives.iter().for_each(|primitive| check_primitive(model, primitive));
    }
    check_nodes(model);
}

fn check_primitive(model: &Model, primitive: &Primitive) {
    let count = primitive.vertex_count();
    let fits = |length: usize| length == 0 || length == count;
    assert!(
        primitive.indices.iter().all(|index| (*index as usize) < count)
            && primitive.indices.len().is_multiple_of(3)
    );
    assert!(primitive.positions.iter().flatten().all(f32::is_finite));
    assert!(
        primitive.normals.iter().flatten().chain(primitive.tangents.iter().flatten()).all(|x| x.is_finite())
    );
    assert!(
        primitive.normals.len() == count && fits(primitive.tangents.len()) && fits(primitive.colors.len())
    );
    assert!(primitive.tex_coords.iter().all(|set| fits(set.len())));
    assert!(primitive.joints.len() == primitive.weights.len());
    assert!(primitive.material.is_none_or(|material| material < model.materials.len()));
    for target in &primitive.morph_targets {
        assert!(fits(target.positions.len()) && fits(target.normals.len()) && fits(target.tangents.len()));
    }
}

fn check_nodes(model: &Model) {
    let times = [(None, 0.0), (Some(0), 0.5), (Some(0), f32::NAN)];
    for pose in times.map(|(animation, seconds)| model.pose(animation, seconds)) {
        assert!(pose.world.len() == model.nodes.len() && pose.joints.len() == model.skins.len());
        (0..model.scenes.len()).for_each(|scene| _ = model.bounds(scene, &pose));
    }
    for node in &model.nodes {
        let skin = node.skin.and_then(|skin| model.skins.get(skin));
        let Some(mesh) = node.mesh.map(|mesh| &model.meshes[mesh]) else { continue };
        let joints = mesh.primitives.iter().flat_map(|primitive| primitive.joints.iter().flatten().flatten());
        assert!(skin.is_none_or(|skin| joints.clone().all(|joint| usize::from(*joint) < skin.joints.len())));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mutation::{Random, mutated};

    /// Most mutations of a file are no JSON. Of edited models a quarter loads, and the rest fails behind the parser.
    #[test]
    fn edited_models_get_behind_the_parser() {
        for place in [Place::Memory, Place::File] {
            let mut random = Random::new(11);
            let mut count = 0;
            for number in 0..300 {
                let edits: Vec<u8> = (0..12).map(|_| random.below(256) as u8).collect();
                let input = mutated(&[&[number as u8 % 16], &edits[..]].concat(), &[], &mut random);
                count += u32::from(edited_model(&input).is_some_and(|edited| loads(&edited, place)));
            }
            assert!(count >= 75, "{count} of 300 in {place:?}");
        }
    }

    #[test]
    fn models_in_files_name_others() {
        let model = include_bytes!("../corpus/gltf/names-a-file.gltf");
        assert!(loads(model, Place::File) && !loads(model, Place::Memory));
        assert!(model.len() & 4 != 0, "it is read in memory");
    }
}
