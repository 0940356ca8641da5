//! Materials of the courtyard; each constant is the number of a material.

use crate::scene::{Material, Texture};

use super::paint;

pub(super) const PAVING: u32 = 0;
pub(super) const SANDSTONE: u32 = 1;
pub(super) const MARBLE: u32 = 2;
pub(super) const BRICK: u32 = 3;
pub(super) const WOOD: u32 = 4;
pub(super) const MOSAIC: u32 = 5;
pub(super) const WATER: u32 = 6;
pub(super) const GOLD: u32 = 7;
pub(super) const BRONZE: u32 = 8;
pub(super) const CHROME: u32 = 9;
pub(super) const COPPER: u32 = 10;
pub(super) const MIRROR: u32 = 11;
pub(super) const LACQUER: u32 = 12;
pub(super) const GLASS: u32 = 13;
pub(super) const GREEN_GLASS: u32 = 14;
pub(super) const AMBER_GLASS: u32 = 15;
pub(super) const GLOW: u32 = 16;
pub(super) const TERRACOTTA: u32 = 17;
pub(super) const LEAVES: u32 = 18;

/// The images, in the order that [`all`] refers to.
pub(super) fn textures() -> Vec<Texture> {
    paint::PAINTED.iter().map(|painted| (painted.paint)()).collect()
}

/// The materials, in the order of the constants.
pub(super) fn all() -> Vec<Material> {
    let textured = |name: &str, texture: u32, gloss: f32, shininess: f32| Material {
        albedo_texture: Some(texture),
        specular: [gloss; 3],
        shininess,
        ..Material::matte(name, [1.0; 3])
    };
    let lacquer = Material {
        specular: [0.6; 3],
        shininess: 120.0,
        reflectivity: 0.12,
        ..Material::matte("lacquer", [0.02, 0.07, 0.30])
    };
    // Almost nothing of a glass surface's own light is mixed in, hence the large number.
    let glow = Material { emission: [34.0, 20.0, 8.0], ..Material::glass("glow", [1.0, 0.93, 0.8], 1.08) };
    vec![
        textured("paving", 0, 0.18, 60.0),
        textured("sandstone", 1, 0.04, 10.0),
        textured("marble", 2, 0.30, 70.0),
        textured("brick", 3, 0.03, 8.0),
        textured("wood", 4, 0.08, 20.0),
        textured("mosaic", 5, 0.4, 90.0),
        Material { specular: [0.8; 3], ..Material::glass("water", [0.86, 0.97, 0.97], 1.33) },
        Material::metal("gold", [1.0, 0.72, 0.29], 0.82),
        Material { shininess: 60.0, ..Material::metal("bronze", [0.62, 0.42, 0.24], 0.35) },
        Material::metal("chrome", [0.95, 0.96, 0.97], 0.92),
        Material::metal("copper", [0.97, 0.55, 0.40], 0.80),
        Material::metal("mirror", [0.93, 0.95, 0.95], 0.94),
        lacquer,
        Material::glass("glass", [0.98, 0.99, 0.99], 1.5),
        Material::glass("green glass", [0.62, 0.93, 0.74], 1.5),
        Material::glass("amber glass", [0.98, 0.80, 0.52], 1.5),
        glow,
        Material {
            specular: [0.06; 3],
            shininess: 12.0,
            ..Material::matte("terracotta", [0.52, 0.20, 0.10])
        },
        textured("leaves", 6, 0.05, 15.0),
    ]
}
