//! Anisotropy, thin films and normal maps of clear coats against values in double precision.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use lvk_gltf::{
    Anisotropy, Clearcoat, ColorSpace, Image, ImageData, Iridescence, Material, MipLevel, Model, TexelFormat,
    TextureRef,
};
use lvk_samples::scene::Camera;
use lvk_tests::rtx_sample::software_device;
use lvk_viewer::light::{Environment, Sun};

use crate::scenes::{Builder, PathTracer, View, colored, matte, mean};

/// A floor whose tangent is +x and whose bitangent is -z.
fn floor(material: Material) -> Model {
    Builder::default().quad(Vec3::new(-40.0, 0.0, -40.0), Vec3::Z * 80.0, Vec3::X * 80.0, material).model()
}

fn with_texel(mut model: Model, texel: [u8; 4]) -> Model {
    let level = MipLevel { width: 1, height: 1, bytes: texel.to_vec() };
    let data = Arc::new(ImageData { format: TexelFormat::Rgba8, mips: vec![level] });
    model.images.push(Image { name: None, source: 0, color_space: ColorSpace::Linear, data });
    model
}

const TEXTURE: TextureRef = TextureRef { image: 0, sampler: 0, tex_coord: 0, transform: None };

/// Radiance of the floor from a direction, where a small sun of irradiance 1 lights it from another.
fn lit(tracer: &mut PathTracer<'_>, model: &Model, view: DVec3, light: DVec3) -> [f64; 3] {
    let sun = Sun { direction: light.as_vec3().to_array(), irradiance: [1.0; 3], radius: 0.005 };
    let environment = Environment { sun: Some(sun), ..Environment::uniform([0.0; 3]) };
    mean(&tracer.radiance(model, &environment, &looking_along(view)))
}

fn looking_along(view: DVec3) -> View {
    let camera = Camera::looking_at((5.0 * view).as_vec3().to_array(), [0.0; 3], 0.2);
    View { camera, size: [8, 8], samples: 64 }
}

fn direction(polar: f64, azimuth: f64) -> DVec3 {
    DVec3::new(polar.sin() * azimuth.cos(), polar.cos(), polar.sin() * azimuth.sin())
}

/// GGX with Smith's shadowing, correlated by height, over four times the cosine of the view. `axes`: those of the surface, the normal
/// last. `alpha`: along the first two.
fn microfacets([x, y, z]: [DVec3; 3], alpha: [f64; 2], view: DVec3, light: DVec3) -> f64 {
    let half = (view + light).normalize();
    let slope = (half.dot(x) / alpha[0]).powi(2) + (half.dot(y) / alpha[1]).powi(2) + half.dot(z).powi(2);
    let distribution = 1.0 / (PI * alpha[0] * alpha[1] * slope * slope);
    let lambda = |w: DVec3| {
        let scaled = (alpha[0] * w.dot(x)).powi(2) + (alpha[1] * w.dot(y)).powi(2);
        0.5 * ((1.0 + scaled / w.dot(z).powi(2)).sqrt() - 1.0)
    };
    distribution / (1.0 + lambda(view) + lambda(light)) / (4.0 * view.dot(z))
}

fn brushed(strength: f32, rotation: f32, texture: Option<TextureRef>) -> Material {
    let anisotropy = Anisotropy { strength, rotation, texture };
    Material { anisotropy: Some(anisotropy), ..colored([0.8, 0.6, 0.4], 1.0, 0.5) }
}

#[test]
fn highlights_of_brushed_metal_are_long_across_its_direction() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    let (strength, roughness) = (0.7_f64, 0.5_f64);
    let alpha = roughness * roughness;
    let alpha = [alpha + (1.0 - alpha) * strength * strength, alpha];
    // An angle of the direction, by the material and by a texel.
    let cases =
        [(0.0, None), (0.5, None), (0.0, Some([128, 255, 255, 255])), (0.5, Some([0, 128, 255, 255]))];
    for (rotation, texel) in cases {
        let turned = match texel {
            Some([128, ..]) => 0.5 * PI,
            Some(_) => PI,
            None => 0.0,
        };
        let material = brushed(strength as f32, rotation, texel.map(|_| TEXTURE));
        let model = texel.map_or(floor(material.clone()), |texel| with_texel(floor(material), texel));
        let angle = f64::from(rotation) + turned;
        let (x, y) = (
            DVec3::X * angle.cos() - DVec3::Z * angle.sin(),
            DVec3::NEG_X * angle.sin() - DVec3::Z * angle.cos(),
        );
        let view = direction(0.35, 0.3);
        let lights = [0.0, 0.9, 1.6, 2.5, 4.0].map(|azimuth| direction(0.6, azimuth));
        // Light that microfacets send back and forth is added by a factor that is the same for all lights.
        let seen = lights.map(|light| lit(&mut tracer, &model, view, light)[2]);
        let fresnel = |light: DVec3| 0.4 + 0.6 * (1.0 - view.dot((view + light).normalize())).powi(5);
        let known = lights.map(|light| fresnel(light) * microfacets([x, y, DVec3::Y], alpha, view, light));
        let shares = |all: [f64; 5]| all.map(|value| value / all.iter().sum::<f64>());
        let (seen, known) = (shares(seen), shares(known));
        eprintln!("rotation {rotation}, texel {texel:?}: {seen:.4?}, expected {known:.4?}");
        assert!(known.iter().any(|share| *share > 0.3), "the highlight is not round");
        assert!(seen.iter().zip(known).all(|(seen, known)| (seen - known).abs() < 0.005 + 0.01 * known));
    }
}

#[test]
fn brushed_metals_keep_about_all_light() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    for (strength, roughness) in [(0.3, 0.3), (0.6, 0.2), (0.8, 0.4), (1.0, 0.1), (1.0, 0.5)] {
        let material = Material { roughness, ..brushed(strength, 0.3, None) };
        let model = floor(Material { base_color: [1.0; 4], ..material });
        for view in [direction(0.1, 0.0), direction(0.8, 0.0), direction(0.8, 1.4)] {
            let white = Environment::uniform([1.0; 3]);
            let bright = mean(&tracer.radiance(&model, &white, &looking_along(view)))[0];
            eprintln!("strength {strength}, roughness {roughness}, from {view:.2}: {bright:.4}");
            // The compensation is that of a round highlight of the same area.
            assert!((0.9..1.04).contains(&bright), "{bright}");
        }
    }
}

/// The reflectance of a film on a base at a wavelength in nanometres: Airy's sum of Fresnel's amplitudes, for unpolarised light.
fn airy(film: f64, base: f64, thickness: f64, cosine: f64, wavelength: f64) -> f64 {
    let inside = |index: f64| (1.0 - (1.0 - cosine * cosine) / (index * index)).sqrt();
    let (in_film, in_base) = (inside(film), inside(base));
    let phase = 4.0 * PI * film * thickness * in_film / wavelength;
    let reflectance = |top: f64, bottom: f64| {
        let both = top * bottom;
        let round = 2.0 * both * phase.cos();
        (top * top + bottom * bottom + round) / (1.0 + both * both + round)
    };
    let amplitude = |a: f64, b: f64| (a - b) / (a + b);
    let across = reflectance(amplitude(cosine, film * in_film), amplitude(film * in_film, base * in_base));
    let along = reflectance(amplitude(film * cosine, in_film), amplitude(base * in_film, film * in_base));
    0.5 * (across + along)
}

/// Red, green and blue of a reflectance under light of equal energy, where a white surface is 1: the eye's curves by the Gaussians of
/// Wyman, Sloan and Shirley, 2013.
fn eye(reflectance: impl Fn(f64) -> f64) -> [f64; 3] {
    let lobe = |wavelength: f64, place: f64, left: f64, right: f64| {
        let width = if wavelength < place { left } else { right };
        (-0.5 * ((wavelength - place) / width).powi(2)).exp()
    };
    let curves = |w: f64| {
        DVec3::new(
            1.056 * lobe(w, 599.8, 37.9, 31.0) + 0.362 * lobe(w, 442.0, 16.0, 26.7)
                - 0.065 * lobe(w, 501.1, 20.4, 26.2),
            0.821 * lobe(w, 568.8, 46.9, 40.5) + 0.286 * lobe(w, 530.9, 16.3, 31.1),
            1.217 * lobe(w, 437.0, 11.8, 36.0) + 0.681 * lobe(w, 459.0, 26.0, 13.8),
        )
    };
    let rgb = |xyz: DVec3| {
        [
            3.240_454 * xyz.x - 1.537_139 * xyz.y - 0.498_531 * xyz.z,
            -0.969_266 * xyz.x + 1.876_011 * xyz.y + 0.041_556 * xyz.z,
            0.055_643 * xyz.x - 0.204_026 * xyz.y + 1.057_225 * xyz.z,
        ]
    };
    let wavelengths = || (360..=830).map(f64::from);
    let seen = rgb(wavelengths().map(|wavelength| curves(wavelength) * reflectance(wavelength)).sum());
    let white = rgb(wavelengths().map(curves).sum());
    [0, 1, 2].map(|channel| seen[channel] / white[channel])
}

#[test]
fn iridescent_surfaces_have_the_colours_of_interference() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    let (film, ior) = (2.0_f32, 1.5_f32);
    let mut extremes = [f64::MAX, 0.0_f64];
    for thickness in [120.0, 250.0, 400.0, 550.0] {
        for cosine in [0.95_f64, 0.7] {
            let iridescence = Iridescence {
                factor: 1.0,
                texture: None,
                ior: film,
                thickness_min: 0.0,
                thickness_max: thickness,
                thickness_texture: None,
            };
            let black = Material { ior, iridescence: Some(iridescence), ..colored([0.0; 3], 0.0, 0.0) };
            let view = looking_along(direction(cosine.acos(), 0.4));
            let white = Environment::uniform([1.0; 3]);
            let seen = mean(&tracer.radiance(&floor(black), &white, &view));
            let [film, ior, thickness] = [film, ior, thickness].map(f64::from);
            let known = eye(|wavelength| airy(film, ior, thickness, cosine, wavelength));
            eprintln!("{thickness} nm, cosine {cosine}: {seen:.3?}, expected {known:.3?}");
            for (seen, known) in seen.iter().zip(known) {
                // Schlick's approximation, and Gaussians of another fit.
                assert!((seen - known).abs() < 0.035, "{thickness} nm, cosine {cosine}");
                extremes = [extremes[0].min(known), extremes[1].max(known)];
            }
        }
    }
    assert!(extremes[1] - extremes[0] > 0.15, "films have colours: {extremes:?}");
}

#[test]
fn iridescence_neither_adds_nor_loses_light() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    let film = |factor| Iridescence {
        factor,
        texture: None,
        ior: 1.8,
        thickness_min: 0.0,
        thickness_max: 420.0,
        thickness_texture: None,
    };
    let white = Environment::uniform([1.0; 3]);
    for (factor, roughness) in [(1.0, 0.0), (0.5, 0.4), (1.0, 0.9)] {
        for view in [direction(0.1, 0.0), direction(1.2, 0.0)] {
            let mut bright = |metallic| {
                let material =
                    Material { iridescence: Some(film(factor)), ..colored([1.0; 3], metallic, roughness) };
                mean(&tracer.radiance(&floor(material), &white, &looking_along(view)))
            };
            // Below a film that reflects less of a colour, a white matte layer gets more of that colour.
            let (plastic, metal) = (bright(0.0), bright(1.0));
            eprintln!("factor {factor}, roughness {roughness}: {plastic:.3?}, metal {metal:.3?}");
            assert!(plastic.iter().all(|bright| (bright - 1.0).abs() < 0.01), "{plastic:?}");
            assert!(metal.iter().all(|bright| *bright < 1.01), "{metal:?}");
        }
    }
}

#[test]
fn a_clear_coat_follows_its_own_normal_map() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    let texel = [191_u8, 128, 238, 255];
    let coat = Clearcoat {
        factor: 1.0,
        texture: None,
        roughness: 0.5,
        roughness_texture: None,
        normal_texture: Some(TEXTURE),
        normal_scale: 1.0,
    };
    let model = with_texel(floor(Material { clearcoat: Some(coat), ..matte([0.0; 3]) }), texel);
    let [x, y, z] = [texel[0], texel[1], texel[2]].map(|value| f64::from(value) / 255.0 * 2.0 - 1.0);
    let normal = (DVec3::X * x - DVec3::Z * y + DVec3::Y * z).normalize();
    let along = (DVec3::X - normal * normal.x).normalize();
    let view = direction(0.2, 0.5);
    for azimuth in [0.0, 1.0, 3.0] {
        let light = direction(0.7, azimuth);
        let seen = lit(&mut tracer, &model, view, light)[1];
        let cosine = view.dot((view + light).normalize());
        let fresnel = 0.04 + 0.96 * (1.0 - cosine).powi(5);
        let known = fresnel * microfacets([along, normal.cross(along), normal], [0.25; 2], view, light);
        eprintln!("azimuth {azimuth}: {seen:.5}, expected {known:.5}");
        assert!((seen - known).abs() < 0.02 * known + 1e-5, "{seen}, expected {known}");
    }
}
