//! A model with every kind of surface that a ray treats in its own way.

use glam::Vec3;
use lvk_gltf::{AlphaMode, Clearcoat, Light, LightKind, Material, Model, Transmission, Volume};

use crate::scenes::{Builder, colored};

/// Boxes of glass, paint and metal, a pane, a veil and a lamp.
pub fn still_life() -> Model {
    let volume = Volume {
        thickness: 1.0,
        thickness_texture: None,
        attenuation_distance: 1.0,
        attenuation_color: [0.6, 0.9, 0.7],
    };
    let transmission = Some(Transmission { factor: 1.0, texture: None });
    let glass = Material { transmission, volume: Some(volume), ..colored([1.0; 3], 0.0, 0.05) };
    let pane = Material { transmission, ..colored([0.9, 0.8, 0.5], 0.0, 0.0) };
    let veil = Material { alpha_mode: AlphaMode::Blend, ..colored([0.2, 0.3, 0.9], 0.0, 0.4) };
    let veil = Material { base_color: [0.2, 0.3, 0.9, 0.4], ..veil };
    let coat = Clearcoat {
        factor: 1.0,
        texture: None,
        roughness: 0.1,
        roughness_texture: None,
        normal_texture: None,
        normal_scale: 1.0,
    };
    let paint = Material { clearcoat: Some(coat), ..colored([0.7, 0.1, 0.1], 0.0, 0.6) };
    let lamp =
        Light { name: None, color: [1.0; 3], intensity: 3.0, range: Some(9.0), kind: LightKind::Point };
    Builder::default()
        .quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, colored([0.7; 3], 0.0, 0.5))
        .cuboid(Vec3::new(-1.6, 0.0, -0.5), Vec3::new(-0.6, 1.0, 0.5), &glass)
        .cuboid(Vec3::new(0.5, 0.0, -0.6), Vec3::new(1.5, 1.2, 0.4), &paint)
        .cuboid(Vec3::new(-0.4, 0.0, -1.5), Vec3::new(0.4, 1.8, -0.9), &colored([0.9, 0.8, 0.6], 1.0, 0.15))
        .quad(Vec3::new(-0.3, 0.0, 1.0), Vec3::X * 1.2, Vec3::Y * 0.9, pane)
        .quad(Vec3::new(-2.2, 0.0, 0.9), Vec3::X * 1.2, Vec3::Y * 0.7, veil)
        .lamp(lamp, Vec3::new(-2.0, 2.5, 2.0))
        .model()
}
