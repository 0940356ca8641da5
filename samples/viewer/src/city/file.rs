//! Writes a planned city as a glTF file: a node for each mesh, with all its instances, and its textures.

use std::ops::RangeInclusive;

use glam::{Quat, Vec2, Vec3};
use serde_json::{Value, json};

use super::City;
use super::glb::{BYTE, Elements, FLOAT, Glb, SHORT, UNSIGNED_INT, UNSIGNED_SHORT};
use super::patterns::Pattern;
use super::plan::{Kind, Plan, View};
use super::solid::{Part, Solid};
use super::surfaces::Surface;

/// Largest half extent in metres of a mesh with positions of 16 bits: steps of 5 mm. Positions of others are floats.
const MOST_QUANTISED: f32 = 160.0;
/// Texture coordinates of the file are metres times this, in 16 bits where the positions are.
const TEXCOORDS_PER_METRE: f32 = 128.0;

/// Errors of making a city.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CityError {
    /// A number is out of range.
    #[error("{option} {value} is out of range; it is {least} to {most}")]
    OutOfRange {
        /// The option.
        option: &'static str,
        /// Value of the option.
        value: u32,
        /// The smallest value.
        least: u32,
        /// The largest value.
        most: u32,
    },
    /// The file would have more than 4 GiB.
    #[error("the city has more than the 4 GiB of a GLB file; use fewer --kinds")]
    TooLarge,
    /// A texture could not be encoded.
    #[error("cannot encode the texture '{name}': {why}")]
    Texture {
        /// Name of the image.
        name: &'static str,
        /// The error of the PNG encoder.
        why: String,
    },
}

impl CityError {
    pub(super) fn check(option: &'static str, value: u32, range: RangeInclusive<u32>) -> Result<(), Self> {
        let (least, most) = range.into_inner();
        match (least..=most).contains(&value) {
            true => Ok(()),
            false => Err(Self::OutOfRange { option, value, least, most }),
        }
    }
}

/// How positions of a mesh become those of the file, from -1 to 1.
#[derive(Debug, Clone, Copy)]
struct Box16 {
    middle: Vec3,
    /// Half of the largest extent; `None` for floats.
    scale: Option<f32>,
}

impl Box16 {
    fn new(solid: &Solid) -> Self {
        let [low, high] = solid.bounds();
        let scale = (0.5 * (high - low)).max_element().max(f32::MIN_POSITIVE);
        match scale <= MOST_QUANTISED {
            true => Self { middle: 0.5 * (low + high), scale: Some(scale) },
            false => Self { middle: Vec3::ZERO, scale: None },
        }
    }

    fn steps(&self, position: Vec3, scale: f32) -> [i16; 3] {
        ((position - self.middle) / scale).to_array().map(|part| (part * 32_767.0).round() as i16)
    }
}

/// The file of a plan, with textures of `texture_size` x `texture_size` texels, or without any.
pub(super) fn write(plan: &Plan, texture_size: Option<u32>) -> Result<City, CityError> {
    let mut glb = Glb::default();
    glb.set("asset", json!({ "version": "2.0", "generator": "lvk city" }));
    let mut required = vec!["EXT_mesh_gpu_instancing", "KHR_mesh_quantization"];
    let mut textures = Vec::new();
    if let Some(size) = texture_size {
        required.push("KHR_texture_transform");
        textures = write_textures(&mut glb, size)?;
    }
    let texture = |pattern: Pattern| textures.get(pattern as usize).cloned();
    glb.set("materials", Value::Array(Surface::materials(texture)));
    let used: Vec<&str> = required.iter().copied().chain(["KHR_materials_clearcoat"]).collect();
    glb.set("extensionsUsed", json!(used));
    glb.set("extensionsRequired", json!(required));
    let has_textures = texture_size.is_some();
    let (mut triangles, mut instance_count) = (0, 0);
    for kind in &plan.kinds {
        write_kind(&mut glb, kind, has_textures);
        instance_count += kind.places.len() as u64;
        triangles += kind.places.len() as u64 * kind.solid.triangle_count();
    }
    for view in &plan.views {
        write_view(&mut glb, view);
    }
    let nodes: Vec<usize> = (0..plan.kinds.len() + plan.views.len()).collect();
    glb.push("scenes", json!({ "name": "city", "nodes": nodes }));
    glb.set("scene", json!(0));
    Ok(City {
        glb: glb.into_bytes().ok_or(CityError::TooLarge)?,
        texture_count: textures.len(),
        mesh_count: plan.kinds.len(),
        distinct_triangles: plan.kinds.iter().map(|kind| kind.solid.triangle_count()).sum(),
        instance_count,
        triangles,
    })
}

/// Writes the textures of all patterns, in the order of [`Pattern::ALL`]. Returns the reference to each and its mean.
fn write_textures(glb: &mut Glb, size: u32) -> Result<Vec<(Value, Vec3)>, CityError> {
    // Linear filters with all mip levels, repeated along both axes.
    let sampler = glb.push("samplers", json!({ "magFilter": 9729, "minFilter": 9987 }));
    let write = |pattern: Pattern| {
        let name = pattern.name();
        let painted =
            pattern.paint(size).map_err(|error| CityError::Texture { name, why: error.to_string() })?;
        let view = glb.view(&painted.png, None);
        let image = glb.push("images", json!({ "name": name, "mimeType": "image/png", "bufferView": view }));
        let texture = glb.push("textures", json!({ "name": name, "source": image, "sampler": sampler }));
        let scale = 1.0 / (TEXCOORDS_PER_METRE * pattern.period());
        let transform = json!({ "KHR_texture_transform": { "scale": [scale, scale] } });
        Ok((json!({ "index": texture, "extensions": transform }), painted.mean))
    };
    Pattern::ALL.into_iter().map(write).collect()
}

fn write_kind(glb: &mut Glb, kind: &Kind, has_textures: bool) {
    let around = Box16::new(&kind.solid);
    let primitive = |(surface, part): (Surface, &Part)| {
        let has_texcoords = has_textures && surface.pattern().is_some();
        primitive(glb, surface, part, &around, has_texcoords)
    };
    let primitives: Vec<Value> = kind.solid.parts().map(primitive).collect();
    let mesh = glb.push("meshes", json!({ "name": kind.name, "primitives": primitives }));
    // The node scales the box to metres, after its instances have moved it.
    let scale = around.scale.unwrap_or(1.0);
    let to = |place: &super::plan::Place| (place.position + place.rotation() * around.middle) / scale;
    let translations: Vec<[f32; 3]> = kind.places.iter().map(|place| to(place).to_array()).collect();
    let rotations: Vec<[i16; 4]> = kind.places.iter().map(|place| shorts(place.rotation())).collect();
    let elements = |bytes, component, shape, is_normalized| Elements {
        bytes,
        component,
        shape,
        count: kind.places.len(),
        is_normalized,
        stride: None,
        range: None,
    };
    let translation = glb.accessor(&elements(bytemuck::cast_slice(&translations), FLOAT, "VEC3", false));
    let rotation = glb.accessor(&elements(bytemuck::cast_slice(&rotations), SHORT, "VEC4", true));
    let attributes = json!({ "TRANSLATION": translation, "ROTATION": rotation });
    glb.push(
        "nodes",
        json!({
            "name": kind.name,
            "mesh": mesh,
            "scale": [scale, scale, scale],
            "extensions": { "EXT_mesh_gpu_instancing": { "attributes": attributes } },
        }),
    );
}

fn shorts(rotation: Quat) -> [i16; 4] {
    rotation.to_array().map(|part| (part * 32_767.0).round() as i16)
}

fn primitive(glb: &mut Glb, surface: Surface, part: &Part, around: &Box16, has_texcoords: bool) -> Value {
    let count = part.positions.len();
    let positions = match around.scale {
        Some(scale) => quantised(glb, part, |position| around.steps(position, scale)),
        None => floats(glb, part),
    };
    let normals: Vec<[i8; 4]> = part
        .normals
        .iter()
        .map(|normal| normal.extend(0.0).to_array().map(|part| (part * 127.0).round() as i8))
        .collect();
    let normals = glb.accessor(&Elements {
        bytes: bytemuck::cast_slice(&normals),
        component: BYTE,
        shape: "VEC3",
        count,
        is_normalized: true,
        stride: Some(4),
        range: None,
    });
    let mut attributes = json!({ "POSITION": positions, "NORMAL": normals });
    if has_texcoords {
        attributes["TEXCOORD_0"] = json!(texcoords(glb, part, around.scale.is_some()));
    }
    json!({ "attributes": attributes, "indices": indices(glb, part), "material": surface.place() })
}

fn texcoords(glb: &mut Glb, part: &Part, is_quantised: bool) -> usize {
    let scaled: Vec<Vec2> = part.texcoords.iter().map(|metres| *metres * TEXCOORDS_PER_METRE).collect();
    let shorts: Vec<[i16; 2]>;
    let (bytes, component) = match is_quantised {
        true => {
            shorts = scaled.iter().map(|steps| steps.to_array().map(|step| step.round() as i16)).collect();
            (bytemuck::cast_slice(&shorts), SHORT)
        }
        false => (bytemuck::cast_slice(&scaled), FLOAT),
    };
    let (shape, count) = ("VEC2", scaled.len());
    glb.accessor(&Elements {
        bytes,
        component,
        shape,
        count,
        is_normalized: false,
        stride: None,
        range: None,
    })
}

fn quantised(glb: &mut Glb, part: &Part, steps: impl Fn(Vec3) -> [i16; 3]) -> usize {
    let all: Vec<[i16; 3]> = part.positions.iter().map(|position| steps(*position)).collect();
    let range = all.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], steps| {
        let steps = Vec3::from(steps.map(f32::from));
        [low.min(steps), high.max(steps)]
    });
    let padded: Vec<[i16; 4]> = all.iter().map(|[x, y, z]| [*x, *y, *z, 0]).collect();
    glb.accessor(&Elements {
        bytes: bytemuck::cast_slice(&padded),
        component: SHORT,
        shape: "VEC3",
        count: all.len(),
        is_normalized: true,
        stride: Some(8),
        range: Some(range),
    })
}

fn floats(glb: &mut Glb, part: &Part) -> usize {
    let range = part.positions.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], position| {
        [low.min(*position), high.max(*position)]
    });
    glb.accessor(&Elements {
        bytes: bytemuck::cast_slice(&part.positions),
        component: FLOAT,
        shape: "VEC3",
        count: part.positions.len(),
        is_normalized: false,
        stride: None,
        range: Some(range),
    })
}

/// Indices of 16 bits where these are enough.
fn indices(glb: &mut Glb, part: &Part) -> usize {
    let mut elements = Elements {
        bytes: bytemuck::cast_slice(&part.indices),
        component: UNSIGNED_INT,
        shape: "SCALAR",
        count: part.indices.len(),
        is_normalized: false,
        stride: None,
        range: None,
    };
    if part.positions.len() >= usize::from(u16::MAX) {
        return glb.accessor(&elements);
    }
    let short: Vec<u16> = part.indices.iter().map(|index| *index as u16).collect();
    (elements.bytes, elements.component) = (bytemuck::cast_slice(&short), UNSIGNED_SHORT);
    glb.accessor(&elements)
}

/// A camera, which looks along its -z.
fn write_view(glb: &mut Glb, view: &View) {
    let camera = glb.push(
        "cameras",
        json!({ "name": view.name, "type": "perspective", "perspective": { "yfov": view.fov, "znear": 0.1 } }),
    );
    let back = (view.eye - view.target).normalize_or(Vec3::Z);
    let right = Vec3::Y.cross(back).normalize_or(Vec3::X);
    let rotation = Quat::from_mat3(&glam::Mat3::from_cols(right, back.cross(right), back));
    glb.push(
        "nodes",
        json!({
            "name": view.name,
            "camera": camera,
            "translation": view.eye.to_array(),
            "rotation": rotation.to_array(),
        }),
    );
}

#[cfg(test)]
mod tests {
    use super::super::{CityConfig, city};
    use super::*;
    use lvk_gltf::{LoadOptions, Model};

    const TINY: CityConfig = CityConfig { blocks: 1, kinds: 3, seed: 7, texture_size: 16 };

    #[test]
    fn the_file_is_read_back_without_warnings_and_with_all_that_was_counted() {
        let city = city(&TINY).unwrap();
        let model = Model::from_bytes(&city.glb, None, &LoadOptions::default()).unwrap();
        assert_eq!(model.warnings, []);
        let placements = model.placements(0, &model.pose(None, 0.0));
        let triangles = |mesh: usize| {
            model.meshes[mesh].primitives.iter().map(|part| part.triangle_count() as u64).sum::<u64>()
        };
        assert_eq!(placements.len() as u64, city.instance_count);
        assert_eq!(placements.iter().map(|placement| triangles(placement.mesh)).sum::<u64>(), city.triangles);
        assert_eq!((0..model.meshes.len()).map(triangles).sum::<u64>(), city.distinct_triangles);
        assert_eq!(model.cameras.len(), 3);
        // Everything but the ground stands on it.
        for placement in placements
            .iter()
            .filter(|placement| model.meshes[placement.mesh].name.as_deref() != Some("ground"))
        {
            let lowest = model.meshes[placement.mesh]
                .primitives
                .iter()
                .flat_map(|part| part.positions.iter())
                .map(|position| placement.transform.transform_point3(position.into()).y)
                .fold(f32::INFINITY, f32::min);
            assert!((-0.02..0.2).contains(&lowest), "{:?} {lowest}", model.meshes[placement.mesh].name);
        }
    }

    #[test]
    fn cities_are_the_same_each_time_and_differ_by_their_seeds() {
        assert_eq!(city(&TINY), city(&TINY));
        assert_ne!(city(&TINY), city(&CityConfig { seed: 8, ..TINY }));
        for wrong in [
            CityConfig { blocks: 0, ..TINY },
            CityConfig { kinds: 257, ..TINY },
            CityConfig { texture_size: CityConfig::MOST_TEXTURE_SIZE + 1, ..TINY },
        ] {
            assert!(matches!(city(&wrong), Err(CityError::OutOfRange { .. })));
        }
    }

    #[test]
    fn walls_and_ground_have_textures_that_repeat_by_metres_unless_there_are_none() {
        let load =
            |config| Model::from_bytes(&city(&config).unwrap().glb, None, &LoadOptions::default()).unwrap();
        let (textured, plain) = (load(TINY), load(CityConfig { texture_size: 0, ..TINY }));
        assert_eq!((textured.images.len(), plain.images.len()), (Pattern::ALL.len(), 0));
        assert!(textured.images.iter().all(|image| image.data.extent() == [16, 16]));
        let primitives = |model: &Model| model.meshes.iter().map(|mesh| mesh.primitives.len()).sum::<usize>();
        assert_eq!(primitives(&textured), primitives(&plain));
        for part in plain.meshes.iter().flat_map(|mesh| &mesh.primitives) {
            assert!(part.tex_coords.is_empty());
        }
        let mut checked = 0;
        for (mesh, part) in
            textured.meshes.iter().flat_map(|mesh| mesh.primitives.iter().map(move |part| (mesh, part)))
        {
            let material = &textured.materials[part.material.unwrap()];
            let Some(texture) = &material.base_color_texture else { continue };
            let scale = texture.transform.unwrap().scale;
            let image = textured.images[texture.image].name.as_deref().unwrap();
            let pattern = Pattern::ALL.into_iter().find(|pattern| pattern.name() == image).unwrap();
            assert_eq!(Surface::of_place(part.material.unwrap()).pattern(), Some(pattern), "{image}");
            assert!((scale[0] * TEXCOORDS_PER_METRE * pattern.period() - 1.0).abs() < 1e-5);
            if mesh.name.as_deref() == Some("ground") {
                // A square: its diagonal is as long in texture coordinates.
                let [low, high] = part
                    .positions
                    .iter()
                    .map(Vec3::from_array)
                    .fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], position| {
                        [low.min(position), high.max(position)]
                    });
                let coords: Vec<Vec2> = part.tex_coords[0].iter().map(|pair| Vec2::from(*pair)).collect();
                let longest = coords.iter().map(|coord| coord.distance(coords[0])).fold(0.0, f32::max);
                let metres = longest / TEXCOORDS_PER_METRE;
                assert!((metres / low.distance(high) - 1.0).abs() < 1e-3, "{metres}");
                checked += 1;
            }
        }
        assert_eq!(checked, 2, "asphalt and grass");
    }

    #[test]
    fn the_usual_city_has_ten_million_triangles() {
        let city = city(&CityConfig::default()).unwrap();
        assert!(city.triangles >= 10_000_000, "{}", city.triangles);
        assert!((500_000..1_500_000).contains(&city.distinct_triangles), "{}", city.distinct_triangles);
    }
}
