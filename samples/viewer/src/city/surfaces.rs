//! The materials of a city.

use glam::Vec3;
use serde_json::{Value, json};

use super::patterns::Pattern;

/// A material, by its place in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Surface {
    Asphalt,
    Paving,
    Kerb,
    Grass,
    Gravel,
    Marking,
    Limestone,
    Sandstone,
    Brick,
    DarkBrick,
    Plaster,
    Ochre,
    Rose,
    Concrete,
    Slate,
    Tiles,
    Felt,
    Glass,
    Curtain,
    Frame,
    Bronze,
    Steel,
    Door,
    Awning,
    Bark,
    Leaf,
    LightLeaf,
    DarkLeaf,
    Tyre,
    RedPaint,
    BluePaint,
    WhitePaint,
    BlackPaint,
    SilverPaint,
    Lamp,
}

/// A surface with its name, linear colour, metalness, roughness and clearcoat.
type Look = (Surface, &'static str, [f32; 3], f32, f32, f32);

impl Surface {
    /// All of them, in the order of their places.
    const LOOKS: [Look; 35] = [
        (Self::Asphalt, "asphalt", [0.055, 0.056, 0.06], 0.0, 0.85, 0.0),
        (Self::Paving, "paving", [0.30, 0.29, 0.27], 0.0, 0.8, 0.0),
        (Self::Kerb, "kerb", [0.42, 0.41, 0.39], 0.0, 0.7, 0.0),
        (Self::Grass, "grass", [0.085, 0.125, 0.045], 0.0, 0.95, 0.0),
        (Self::Gravel, "gravel", [0.42, 0.36, 0.26], 0.0, 0.95, 0.0),
        (Self::Marking, "marking", [0.72, 0.72, 0.68], 0.0, 0.6, 0.0),
        (Self::Limestone, "limestone", [0.60, 0.55, 0.45], 0.0, 0.8, 0.0),
        (Self::Sandstone, "sandstone", [0.50, 0.37, 0.23], 0.0, 0.85, 0.0),
        (Self::Brick, "brick", [0.29, 0.095, 0.055], 0.0, 0.9, 0.0),
        (Self::DarkBrick, "dark brick", [0.13, 0.07, 0.05], 0.0, 0.9, 0.0),
        (Self::Plaster, "plaster", [0.68, 0.66, 0.61], 0.0, 0.9, 0.0),
        (Self::Ochre, "ochre plaster", [0.62, 0.43, 0.17], 0.0, 0.9, 0.0),
        (Self::Rose, "rose plaster", [0.58, 0.33, 0.26], 0.0, 0.9, 0.0),
        (Self::Concrete, "concrete", [0.36, 0.36, 0.35], 0.0, 0.75, 0.0),
        (Self::Slate, "slate", [0.085, 0.095, 0.11], 0.0, 0.55, 0.0),
        (Self::Tiles, "roof tiles", [0.34, 0.11, 0.055], 0.0, 0.8, 0.0),
        (Self::Felt, "roofing felt", [0.13, 0.13, 0.13], 0.0, 0.95, 0.0),
        (Self::Glass, "window", [0.018, 0.022, 0.026], 0.0, 0.03, 0.0),
        (Self::Curtain, "curtain wall", [0.20, 0.27, 0.31], 0.85, 0.06, 0.0),
        (Self::Frame, "window frame", [0.62, 0.61, 0.58], 0.0, 0.5, 0.0),
        (Self::Bronze, "bronze", [0.20, 0.13, 0.07], 0.9, 0.35, 0.0),
        (Self::Steel, "steel", [0.42, 0.43, 0.44], 0.95, 0.35, 0.0),
        (Self::Door, "door", [0.045, 0.10, 0.075], 0.0, 0.35, 0.5),
        (Self::Awning, "awning", [0.45, 0.055, 0.04], 0.0, 0.9, 0.0),
        (Self::Bark, "bark", [0.11, 0.075, 0.05], 0.0, 0.95, 0.0),
        (Self::Leaf, "leaf", [0.075, 0.155, 0.025], 0.0, 0.6, 0.0),
        (Self::LightLeaf, "light leaf", [0.15, 0.23, 0.035], 0.0, 0.6, 0.0),
        (Self::DarkLeaf, "dark leaf", [0.03, 0.085, 0.022], 0.0, 0.6, 0.0),
        (Self::Tyre, "tyre", [0.02, 0.02, 0.02], 0.0, 0.8, 0.0),
        (Self::RedPaint, "red paint", [0.42, 0.022, 0.018], 0.0, 0.45, 1.0),
        (Self::BluePaint, "blue paint", [0.02, 0.06, 0.25], 0.0, 0.45, 1.0),
        (Self::WhitePaint, "white paint", [0.75, 0.75, 0.73], 0.0, 0.45, 1.0),
        (Self::BlackPaint, "black paint", [0.012, 0.012, 0.014], 0.0, 0.4, 1.0),
        (Self::SilverPaint, "silver paint", [0.52, 0.53, 0.55], 0.8, 0.4, 1.0),
        (Self::Lamp, "lamp glass", [0.80, 0.79, 0.74], 0.0, 0.15, 0.0),
    ];

    /// Place among the materials of the file.
    pub(super) fn place(self) -> usize {
        self as usize
    }

    /// The surface of a place.
    #[cfg(test)]
    pub(super) fn of_place(place: usize) -> Self {
        Self::LOOKS[place].0
    }

    /// The pattern of the surface.
    pub(super) fn pattern(self) -> Option<Pattern> {
        Some(match self {
            Self::Asphalt | Self::Felt => Pattern::Asphalt,
            Self::Paving => Pattern::Paving,
            Self::Grass => Pattern::Grass,
            Self::Gravel => Pattern::Gravel,
            Self::Brick | Self::DarkBrick => Pattern::Bricks,
            Self::Limestone | Self::Sandstone => Pattern::Blocks,
            Self::Plaster | Self::Ochre | Self::Rose => Pattern::Plaster,
            Self::Kerb | Self::Concrete => Pattern::Concrete,
            Self::Slate | Self::Tiles => Pattern::Tiles,
            _ => return None,
        })
    }

    /// True for what is seen from both sides: what is as thin as a leaf, and twigs, whose ends are open.
    fn is_double_sided(self) -> bool {
        matches!(self, Self::Bark | Self::Leaf | Self::LightLeaf | Self::DarkLeaf | Self::Awning)
    }

    /// The materials of the file. `texture` returns the reference to the texture of a pattern and its mean, if the file has it.
    pub(super) fn materials(texture: impl Fn(Pattern) -> Option<(Value, Vec3)>) -> Vec<Value> {
        Self::LOOKS.iter().map(|look| material(look, look.0.pattern().and_then(&texture))).collect()
    }
}

/// A material. With a texture, its mean colour is that of the surface.
fn material(
    (surface, name, color, metalness, roughness, coat): &Look,
    texture: Option<(Value, Vec3)>,
) -> Value {
    let mean = texture.as_ref().map_or(Vec3::ONE, |(_, mean)| *mean);
    let [red, green, blue] = (Vec3::from(*color) / mean).to_array();
    let mut material = json!({
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [red, green, blue, 1.0],
            "metallicFactor": metalness,
            "roughnessFactor": roughness,
        },
    });
    if let Some((reference, _)) = texture {
        material["pbrMetallicRoughness"]["baseColorTexture"] = reference;
    }
    if surface.is_double_sided() {
        material["doubleSided"] = json!(true);
    }
    if *coat > 0.0 {
        let clearcoat = json!({ "clearcoatFactor": coat, "clearcoatRoughnessFactor": 0.04 });
        material["extensions"] = json!({ "KHR_materials_clearcoat": clearcoat });
    }
    material
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_surface_has_its_look() {
        assert_eq!(Surface::Lamp.place(), Surface::LOOKS.len() - 1);
        for (place, look) in Surface::LOOKS.iter().enumerate() {
            assert_eq!(look.0.place(), place);
        }
    }

    #[test]
    fn textures_leave_the_mean_colour_as_it_is_and_reflect_no_more_light_than_there_is() {
        for look in &Surface::LOOKS {
            let Some(pattern) = look.0.pattern() else { continue };
            let mean = pattern.paint(1).unwrap().mean;
            let material = material(look, Some((json!({ "index": 0 }), mean)));
            for channel in 0..3 {
                let factor = &material["pbrMetallicRoughness"]["baseColorFactor"][channel];
                let factor = factor.as_f64().unwrap() as f32;
                assert!(factor <= 1.0, "{} {factor}", look.1);
                assert!((factor * mean[channel] - look.2[channel]).abs() < 1e-4, "{}", look.1);
            }
        }
    }
}
