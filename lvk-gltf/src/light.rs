//! Lights of `KHR_lights_punctual`.

/// A light. Its node says where it stands: directional lights and spots shine along -Z. The scale of the node has no effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// Name in the file.
    pub name: Option<String>,
    /// Linear colour.
    pub color: [f32; 3],
    /// Candela (point and spot), or lux (directional).
    pub intensity: f32,
    /// Distance, metres, beyond which the light may be taken as zero, or `None` for no such distance.
    pub range: Option<f32>,
    /// Shape of the light.
    pub kind: LightKind,
}

/// Shape of a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightKind {
    /// Infinitely far away.
    Directional,
    /// Shines from a point in all directions.
    Point,
    /// Shines from a point into a cone.
    Spot {
        /// Angle from the axis at which the light begins to fall, radians, below `outer_cone_angle`.
        inner_cone_angle: f32,
        /// Angle from the axis at which the light ends, radians, at most half of pi.
        outer_cone_angle: f32,
    },
}
