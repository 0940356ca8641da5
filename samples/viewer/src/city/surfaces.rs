//! The materials of a city.

use serde_json::{Value, json};

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

/// Name, linear colour, metalness, roughness and clearcoat.
type Look = (&'static str, [f32; 3], f32, f32, f32);

impl Surface {
    /// All of them, in the order of their places.
    const LOOKS: [Look; 35] = [
        ("asphalt", [0.055, 0.056, 0.06], 0.0, 0.85, 0.0),
        ("paving", [0.30, 0.29, 0.27], 0.0, 0.8, 0.0),
        ("kerb", [0.42, 0.41, 0.39], 0.0, 0.7, 0.0),
        ("grass", [0.085, 0.125, 0.045], 0.0, 0.95, 0.0),
        ("gravel", [0.42, 0.36, 0.26], 0.0, 0.95, 0.0),
        ("marking", [0.72, 0.72, 0.68], 0.0, 0.6, 0.0),
        ("limestone", [0.60, 0.55, 0.45], 0.0, 0.8, 0.0),
        ("sandstone", [0.50, 0.37, 0.23], 0.0, 0.85, 0.0),
        ("brick", [0.29, 0.095, 0.055], 0.0, 0.9, 0.0),
        ("dark brick", [0.13, 0.07, 0.05], 0.0, 0.9, 0.0),
        ("plaster", [0.68, 0.66, 0.61], 0.0, 0.9, 0.0),
        ("ochre plaster", [0.62, 0.43, 0.17], 0.0, 0.9, 0.0),
        ("rose plaster", [0.58, 0.33, 0.26], 0.0, 0.9, 0.0),
        ("concrete", [0.36, 0.36, 0.35], 0.0, 0.75, 0.0),
        ("slate", [0.085, 0.095, 0.11], 0.0, 0.55, 0.0),
        ("roof tiles", [0.34, 0.11, 0.055], 0.0, 0.8, 0.0),
        ("roofing felt", [0.13, 0.13, 0.13], 0.0, 0.95, 0.0),
        ("window", [0.018, 0.022, 0.026], 0.0, 0.03, 0.0),
        ("curtain wall", [0.20, 0.27, 0.31], 0.85, 0.06, 0.0),
        ("window frame", [0.62, 0.61, 0.58], 0.0, 0.5, 0.0),
        ("bronze", [0.20, 0.13, 0.07], 0.9, 0.35, 0.0),
        ("steel", [0.42, 0.43, 0.44], 0.95, 0.35, 0.0),
        ("door", [0.045, 0.10, 0.075], 0.0, 0.35, 0.5),
        ("awning", [0.45, 0.055, 0.04], 0.0, 0.9, 0.0),
        ("bark", [0.11, 0.075, 0.05], 0.0, 0.95, 0.0),
        ("leaf", [0.075, 0.155, 0.025], 0.0, 0.6, 0.0),
        ("light leaf", [0.15, 0.23, 0.035], 0.0, 0.6, 0.0),
        ("dark leaf", [0.03, 0.085, 0.022], 0.0, 0.6, 0.0),
        ("tyre", [0.02, 0.02, 0.02], 0.0, 0.8, 0.0),
        ("red paint", [0.42, 0.022, 0.018], 0.0, 0.45, 1.0),
        ("blue paint", [0.02, 0.06, 0.25], 0.0, 0.45, 1.0),
        ("white paint", [0.75, 0.75, 0.73], 0.0, 0.45, 1.0),
        ("black paint", [0.012, 0.012, 0.014], 0.0, 0.4, 1.0),
        ("silver paint", [0.52, 0.53, 0.55], 0.8, 0.4, 1.0),
        ("lamp glass", [0.80, 0.79, 0.74], 0.0, 0.15, 0.0),
    ];

    /// Place among the materials of the file.
    pub(super) fn place(self) -> usize {
        self as usize
    }

    /// The materials of the file.
    pub(super) fn materials() -> Vec<Value> {
        Self::LOOKS.iter().map(material).collect()
    }
}

fn material((name, [red, green, blue], metalness, roughness, coat): &Look) -> Value {
    let mut material = json!({
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [red, green, blue, 1.0],
            "metallicFactor": metalness,
            "roughnessFactor": roughness,
        },
    });
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
        for (surface, name) in
            [(Surface::Asphalt, "asphalt"), (Surface::Glass, "window"), (Surface::Bark, "bark")]
        {
            assert_eq!(Surface::LOOKS[surface.place()].0, name);
        }
    }
}
