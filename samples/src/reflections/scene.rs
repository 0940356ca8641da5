//! The scene of the sample: models of several materials each, their transforms, lamps and sky.

use std::f32::consts::TAU;

use glam::{Affine3A, Quat, Vec3};

use super::meshes;
use super::procedural_textures::Picture;
use crate::scene::{Camera, Sky};
use crate::shapes::Mesh;

/// A surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Material {
    /// Linear; multiplied with the texture.
    pub(super) albedo: [f32; 3],
    /// 0 to 1; multiplied with the texture's alpha.
    pub(super) roughness: f32,
    pub(super) emission: [f32; 3],
    /// 0 to 1.
    pub(super) metalness: f32,
    /// A place in [`HallScene::textures`], and the units of length that it covers.
    pub(super) texture: Option<(usize, f32)>,
    /// 1 for opaque surfaces.
    pub(super) opacity: f32,
    /// Extinction of a body of water per unit of length; 0 for surfaces.
    pub(super) density: f32,
}

/// One mesh for each material: they become the geometries of one bottom-level structure.
pub(super) struct Model {
    pub(super) name: &'static str,
    /// Meshes and places in [`HallScene::materials`].
    pub(super) parts: Vec<(Mesh, u32)>,
    /// Light passes through it.
    pub(super) is_transparent: bool,
}

/// A model that stands somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placed {
    /// A place in [`HallScene::models`].
    pub(super) model: usize,
    /// Rotation, scale that is the same along all axes, and translation.
    pub(super) to_world: Affine3A,
}

/// A lamp, or the sun where the radius is 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Light {
    /// Position in scene units; for the sun the unit vector towards it.
    pub(super) position: [f32; 3],
    pub(super) radius: f32,
    /// Irradiance over pi; for a lamp at one unit of distance.
    pub(super) color: [f32; 3],
    /// Sine of half the angle that the sun covers.
    pub(super) spread: f32,
}

/// Everything static, and what the animation things are made of.
pub(super) struct HallScene {
    pub(super) models: Vec<Model>,
    /// Those of one model stand together.
    pub(super) placed: Vec<Placed>,
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<Picture>,
    pub(super) lights: Vec<Light>,
    pub(super) sky: Sky,
    /// Materials of the serpent's parts.
    pub(super) serpent_materials: [u32; 4],
    pub(super) leaf_material: u32,
    pub(super) leaf_count: u32,
}

/// Places in [`HallScene::materials`].
pub(super) mod material {
    pub(in super::super) const FLOOR: u32 = 0;
    pub(in super::super) const STONE: u32 = 1;
    pub(in super::super) const MARBLE: u32 = 2;
    pub(in super::super) const GOLD: u32 = 3;
    pub(in super::super) const MIRROR: u32 = 4;
    pub(in super::super) const BRONZE: u32 = 5;
    pub(in super::super) const MOSAIC: u32 = 6;
    pub(in super::super) const SAND: u32 = 7;
    pub(in super::super) const FLAME: u32 = 8;
    pub(in super::super) const LANTERN: u32 = 9;
    pub(in super::super) const GLASS: u32 = 10;
    pub(in super::super) const WATER: u32 = 11;
    pub(in super::super) const SCALES: u32 = 12;
    pub(in super::super) const BELLY: u32 = 13;
    pub(in super::super) const FINS: u32 = 14;
    pub(in super::super) const EYES: u32 = 15;
    pub(in super::super) const LEAF: u32 = 16;
    pub(in super::super) const HILLS: u32 = 17;
}

impl HallScene {
    pub(super) fn new() -> Self {
        let (models, placed) = create_models();
        Self {
            models,
            placed,
            materials: materials(),
            textures: vec![Picture::marble_floor(), Picture::stone(), Picture::mosaic(), Picture::leaf()],
            lights: lights(),
            sky: sky(),
            serpent_materials: [material::SCALES, material::BELLY, material::FINS, material::EYES],
            leaf_material: material::LEAF,
            leaf_count: 220,
        }
    }
}

/// The camera at `phase` of the round, 0 to 1: a slow walk into the hall and back.
pub(super) fn camera(phase: f32) -> Camera {
    let (sway, away) = (TAU * phase).sin_cos();
    let walk = 0.5 - 0.5 * away;
    let eye = [-2.0 + 0.6 * sway, 1.3 + 0.25 * walk, 3.6 - 2.5 * walk];
    Camera::looking_at(eye, [0.45 + 0.3 * sway, 1.0, -9.0], 50.0)
}

fn create_models() -> (Vec<Model>, Vec<Placed>) {
    let upright = |x: f32, y: f32, z: f32| Affine3A::from_translation(Vec3::new(x, y, z));
    let here = vec![Affine3A::IDENTITY];
    let both = |x: f32, y: f32, zs: Vec<f32>| -> Vec<Affine3A> {
        [-x, x].iter().flat_map(|x| zs.iter().map(|z| upright(*x, y, *z)).collect::<Vec<_>>()).collect()
    };
    let along = |from: f32, step: f32, count: i32| -> Vec<f32> {
        (0..count).map(|k| from - step * k as f32).collect()
    };
    let turned = |angle, place| Affine3A::from_rotation_translation(Quat::from_rotation_y(angle), place);
    // The second is seen through the first.
    let screens = vec![turned(-0.75, Vec3::new(3.3, 0.0, -4.4)), turned(0.5, Vec3::new(3.9, 0.0, -5.6))];
    let studs = [both(2.15, 0.0, along(4.5, 0.25, 146)), both(3.6, 0.0, along(4.5, 0.25, 146))].concat();
    let lamps = [both(5.75, 0.0, along(4.2, 0.75, 48)), both(1.72, 0.1, along(-4.9, 1.15, 10))].concat();
    let list: Vec<(Model, Vec<Affine3A>)> = vec![
        (meshes::hall(), here.clone()),
        (meshes::ground(), here.clone()),
        (meshes::column(), both(4.6, 0.0, along(1.0, 4.0, 9))),
        (meshes::mirror_ball(), vec![upright(-3.1, 0.0, -4.2), upright(3.1, 0.0, -16.8)]),
        (meshes::knot(), vec![upright(-3.2, 0.0, -9.0), upright(-3.1, 0.0, -16.8)]),
        (meshes::lantern(), both(3.1, 3.1, vec![-7.0, -15.0])),
        (meshes::screen_frame(), screens.clone()),
        (meshes::lamp(), lamps),
        (meshes::stud(), studs),
        (meshes::pane(), screens),
        (meshes::water(), here),
    ];
    let mut placed = Vec::new();
    let mut models = Vec::new();
    for (model, places) in list {
        let number = models.len();
        placed.extend(places.into_iter().map(|to_world| Placed { model: number, to_world }));
        models.push(model);
    }
    (models, placed)
}

fn materials() -> Vec<Material> {
    let plain = |albedo, roughness| Material {
        albedo,
        roughness,
        emission: [0.0; 3],
        metalness: 0.0,
        texture: None,
        opacity: 1.0,
        density: 0.0,
    };
    let white = [1.0; 3];
    let textured = |texture, extent| Material { texture: Some((texture, extent)), ..plain(white, 1.0) };
    let metal = |albedo, roughness| Material { metalness: 1.0, ..plain(albedo, roughness) };
    let glowing = |emission| Material { emission, ..plain([0.2; 3], 0.9) };
    vec![
        textured(0, 4.0),
        textured(1, 2.0),
        plain([0.62, 0.58, 0.52], 0.35),
        metal([1.0, 0.72, 0.29], 0.18),
        metal([0.94, 0.94, 0.95], 0.02),
        metal([0.72, 0.45, 0.24], 0.28),
        textured(2, 2.0),
        plain([0.42, 0.33, 0.22], 0.95),
        glowing([9.0, 3.6, 0.9]),
        glowing([7.0, 4.4, 2.0]),
        Material { opacity: 0.2, ..plain([0.35, 0.65, 0.52], 0.02) },
        Material { opacity: 0.5, density: 1.1, ..plain([0.03, 0.16, 0.17], 0.02) },
        Material { metalness: 0.85, ..plain([0.06, 0.42, 0.32], 0.22) },
        metal([1.0, 0.76, 0.36], 0.25),
        Material { metalness: 0.6, ..plain([0.75, 0.10, 0.06], 0.3) },
        Material { emission: [1.5, 0.62, 0.05], ..plain([0.5, 0.2, 0.02], 0.2) },
        Material { texture: Some((3, 1.0)), ..plain([0.85, 0.85, 0.85], 0.8) },
        plain([0.15, 0.13, 0.13], 0.95),
    ]
}

fn sun_direction() -> [f32; 3] {
    Vec3::new(-0.66, 0.36, -0.55).normalize().to_array()
}

fn sky() -> Sky {
    Sky {
        zenith: [0.05, 0.11, 0.30],
        horizon: [0.86, 0.46, 0.26],
        ground: [0.16, 0.12, 0.10],
        sun_direction: sun_direction(),
        sun_color: [15.0, 8.5, 4.2],
        clouds: 0.5,
    }
}

fn lights() -> Vec<Light> {
    let lantern = |position| Light { position, radius: 0.14, color: [4.6, 2.5, 1.0], spread: 0.0 };
    vec![
        Light { position: sun_direction(), radius: 0.0, color: [4.4, 2.6, 1.35], spread: 0.009 },
        lantern([-3.1, 3.1, -7.0]),
        lantern([3.1, 3.1, -7.0]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_path_ends_where_it_began() {
        let eye = |phase| Vec3::from(camera(phase).eye);
        let step = eye(0.0).distance(eye(1.0 / 240.0));
        assert!(eye(1.0).distance(eye(0.0)) < 1e-3);
        assert!((eye(239.0 / 240.0).distance(eye(0.0)) - step).abs() < 1e-3, "nor does it halt there");
    }

    #[test]
    fn the_tables_fit_together() {
        let world = HallScene::new();
        assert!(world.lights.len() <= 3, "the shaders have room for three");
        assert!(world.materials.iter().all(|m| m.texture.is_none_or(|(t, _)| t < world.textures.len())));
        for model in &world.models {
            assert!(!model.parts.is_empty(), "{}", model.name);
            for (mesh, material) in &model.parts {
                assert!((*material as usize) < world.materials.len(), "{}", model.name);
                assert!(!mesh.triangles.is_empty() && mesh.vertices.len() < 65_536, "{}", model.name);
                assert_eq!(world.materials[*material as usize].opacity < 1.0, model.is_transparent);
            }
        }
        assert!(world.placed.windows(2).all(|pair| pair[0].model <= pair[1].model));
        assert!(world.models.iter().filter(|model| model.parts.len() > 1).count() >= 5);
    }
}
