//! Writes a planned city as a glTF file: a node for each mesh, with all its instances.

use glam::{Quat, Vec3};
use serde_json::{Value, json};

use super::City;
use super::glb::{BYTE, Elements, FLOAT, Glb, SHORT, UNSIGNED_INT, UNSIGNED_SHORT};
use super::plan::{Kind, Plan, View};
use super::solid::{Part, Solid};
use super::surfaces::Surface;

/// Largest half extent in metres of a mesh with positions of 16 bits: steps of 5 mm. Positions of others are floats.
const MOST_QUANTISED: f32 = 160.0;

/// Errors of making a city.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CityError {
    /// A number is out of range.
    #[error("{option} {value} is out of range; it is 1 to {most}")]
    OutOfRange {
        /// The option.
        option: &'static str,
        /// Value of the option.
        value: u32,
        /// The largest value.
        most: u32,
    },
    /// The file would have more than 4 GiB.
    #[error("the city has more than the 4 GiB of a GLB file; use fewer --kinds")]
    TooLarge,
}

impl CityError {
    pub(super) fn check(option: &'static str, value: u32, most: u32) -> Result<(), Self> {
        if (1..=most).contains(&value) { Ok(()) } else { Err(Self::OutOfRange { option, value, most }) }
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

/// The file of a plan.
pub(super) fn write(plan: &Plan) -> Result<City, CityError> {
    let mut glb = Glb::default();
    glb.set("asset", json!({ "version": "2.0", "generator": "lvk city" }));
    let extensions = ["EXT_mesh_gpu_instancing", "KHR_mesh_quantization"];
    glb.set("extensionsRequired", json!(extensions));
    glb.set("extensionsUsed", json!([extensions[0], "KHR_materials_clearcoat", extensions[1]]));
    glb.set("materials", Value::Array(Surface::materials()));
    let (mut triangles, mut instance_count) = (0, 0);
    for kind in &plan.kinds {
        write_kind(&mut glb, kind);
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
        mesh_count: plan.kinds.len(),
        distinct_triangles: plan.kinds.iter().map(|kind| kind.solid.triangle_count()).sum(),
        instance_count,
        triangles,
    })
}

fn write_kind(glb: &mut Glb, kind: &Kind) {
    let around = Box16::new(&kind.solid);
    let primitives: Vec<Value> =
        kind.solid.parts().map(|(surface, part)| primitive(glb, surface, part, &around)).collect();
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

fn primitive(glb: &mut Glb, surface: Surface, part: &Part, around: &Box16) -> Value {
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
    json!({
        "attributes": { "POSITION": positions, "NORMAL": normals },
        "indices": indices(glb, part),
        "material": surface.place(),
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

    const TINY: CityConfig = CityConfig { blocks: 1, kinds: 3, seed: 7 };

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
        for wrong in [CityConfig { blocks: 0, ..TINY }, CityConfig { kinds: 257, ..TINY }] {
            assert!(matches!(city(&wrong), Err(CityError::OutOfRange { .. })));
        }
    }

    #[test]
    fn the_usual_city_has_ten_million_triangles() {
        let city = city(&CityConfig::default()).unwrap();
        assert!(city.triangles >= 10_000_000, "{}", city.triangles);
        assert!((500_000..1_500_000).contains(&city.distinct_triangles), "{}", city.distinct_triangles);
    }
}
