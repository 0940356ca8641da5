//! Images of the `hybrid_oit` sample, and a reference on the host for the same scene.
#![expect(clippy::expect_used, reason = "a test without its picture has failed")]

use image::RgbaImage;
use lvk::Context;
use lvk::glam::{DVec3, Vec3};
use lvk_samples::hybrid_oit::{GlassNode, HybridOit, HybridOitConfig, Motion, OitScene};

/// The sample with one configuration of a scene.
pub struct OitRenderer {
    /// The sample.
    pub sample: HybridOit,
    size: [u32; 2],
}

/// A sphere at one time.
#[derive(Debug, Clone, Copy)]
pub struct Sphere {
    /// Centre of the sphere.
    pub center: DVec3,
    /// Radius of the sphere.
    pub radius: f64,
    /// Absorption of glass in a unit of length; `None` for balls.
    pub absorption: Option<DVec3>,
}

/// The scene at one time, for rays on the host.
pub struct HostScene {
    /// Balls and glass.
    pub spheres: Vec<Sphere>,
    scene: OitScene,
}

/// Light along a ray, computed on the host.
pub struct Sunlight {
    /// Share of the light at the end of the ray that arrives at its origin.
    pub light: DVec3,
    /// True if the ray passes an edge or silhouette so closely that rounding decides.
    pub is_doubtful: bool,
}

impl OitRenderer {
    /// Creates the sample with `config`.
    ///
    /// # Panics
    /// When the sample cannot be created.
    pub fn new(ctx: &Context, scene: &OitScene, config: &HybridOitConfig) -> Self {
        let sample = HybridOit::new(ctx, scene, config).expect("the sample can be set up");
        Self { sample, size: [config.width, config.height] }
    }

    /// Renders an image at a time.
    ///
    /// # Panics
    /// When rendering fails.
    pub fn render(&mut self, seconds: f64) -> RgbaImage {
        self.sample.update(seconds);
        self.sample.render().expect("the sample renders");
        let pixels = self.sample.picture().expect("the image can be read");
        RgbaImage::from_raw(self.size[0], self.size[1], pixels).expect("a picture has four bytes a pixel")
    }
}

impl HostScene {
    /// Returns the scene at `seconds`.
    pub fn new(scene: &OitScene, seconds: f64) -> Self {
        let balls = scene.balls.iter().map(|ball| Sphere {
            center: center_at(&ball.motion, false, seconds),
            radius: f64::from(ball.radius),
            absorption: None,
        });
        let glass = scene.glass.iter().map(|glass| Sphere {
            center: center_at(&glass.motion, true, seconds),
            radius: f64::from(glass.radius),
            absorption: Some(glass.absorption().as_dvec3()),
        });
        Self { spheres: balls.chain(glass).collect(), scene: scene.clone() }
    }

    /// Returns the origin of a pixel's ray, and its direction of unit length.
    pub fn camera_ray(&self, pixel: [u32; 2], size: [u32; 2]) -> (DVec3, DVec3) {
        let camera = &self.scene.camera;
        let [right, up, forward] = camera.frame().map(|axis| Vec3::from(axis).as_dvec3());
        let half = (0.5 * f64::from(camera.vertical_fov_degrees).to_radians()).tan();
        let ndc = [0, 1].map(|axis| (f64::from(pixel[axis]) + 0.5) / f64::from(size[axis]) * 2.0 - 1.0);
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let direction = forward + right * (ndc[0] * half * aspect) - up * (ndc[1] * half);
        (Vec3::from(camera.eye).as_dvec3(), direction.normalize())
    }

    /// Returns the outer normal of the surface at a point on the floor, a block or a ball.
    pub fn normal_at(&self, point: DVec3) -> DVec3 {
        let mut best = (point.y.abs(), DVec3::Y);
        let mut offer = |distance: f64, normal: DVec3| {
            if distance < best.0 {
                best = (distance, normal);
            }
        };
        for sphere in self.spheres.iter().filter(|sphere| sphere.absorption.is_none()) {
            let out = point - sphere.center;
            offer((out.length() - sphere.radius).abs(), out.normalize());
        }
        for block in &self.scene.blocks {
            let (center, half) =
                (0.5 * (block.low + block.high).as_dvec3(), 0.5 * (block.high - block.low).as_dvec3());
            let out = point - center;
            let outside = (out.abs() - half).max_element();
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let along = out.dot(axis);
                let off = (along.abs() - half.dot(axis)).abs();
                offer(off.max(outside), axis * along.signum());
            }
        }
        best.1
    }

    /// Returns the sunlight that arrives at `origin`, a point a little outside of a surface.
    pub fn sunlight(&self, origin: DVec3) -> Sunlight {
        let direction = self.scene.sun.direction.as_dvec3().normalize();
        let mut found = Sunlight { light: DVec3::ONE, is_doubtful: false };
        for block in &self.scene.blocks {
            let (is_hit, is_doubtful) =
                cross_block(block.low.as_dvec3(), block.high.as_dvec3(), origin, direction);
            found.is_doubtful |= is_doubtful;
            found.light *= if is_hit { 0.0 } else { 1.0 };
        }
        for sphere in &self.spheres {
            let Some([entry, exit]) = sphere.crossing(origin, direction, &mut found.is_doubtful) else {
                continue;
            };
            let Some(absorption) = sphere.absorption else {
                found.light = DVec3::ZERO;
                continue;
            };
            let cosine = (0.5 * (exit - entry) / sphere.radius).min(1.0);
            let boundaries = if entry >= 0.0 { 2 } else { 1 };
            let passed = (-absorption * (exit - entry.max(0.0))).map(f64::exp);
            found.light *= passed * (1.0 - reflectance(cosine)).powi(boundaries);
        }
        found
    }
}

impl Sphere {
    /// Returns the distances where a ray enters and leaves the sphere, if any of it lies ahead. Sets `is_doubtful` on
    /// the silhouette.
    pub fn crossing(&self, origin: DVec3, direction: DVec3, is_doubtful: &mut bool) -> Option<[f64; 2]> {
        let to_center = self.center - origin;
        let middle = to_center.dot(direction);
        let passing = (to_center - middle * direction).length();
        let is_ahead = middle > -self.radius;
        let is_outside = to_center.length() > self.radius;
        if is_ahead && !(is_outside && middle < 0.0) {
            *is_doubtful |= (passing - self.radius).abs() < 2e-3 * self.radius;
        }
        if passing >= self.radius || (is_outside && middle <= 0.0) || !is_ahead {
            return None;
        }
        let half = (self.radius * self.radius - passing * passing).sqrt();
        (middle + half > 0.0).then_some([middle - half, middle + half])
    }
}

/// Returns the light of `background` behind nodes, which are sorted here.
pub fn composite_sorted(nodes: &[GlassNode], background: [f64; 3]) -> [f64; 3] {
    let mut sorted = nodes.to_vec();
    sorted.sort_by(|a, b| b.distance.total_cmp(&a.distance));
    composite(&sorted, background)
}

/// As [`composite_sorted`], in the given order. The first node is the farthest.
pub fn composite(nodes: &[GlassNode], background: [f64; 3]) -> [f64; 3] {
    nodes.iter().fold(background, |behind, node| {
        let channel = |c: usize| f64::from(node.radiance[c]) + f64::from(node.transmittance[c]) * behind[c];
        [0, 1, 2].map(channel)
    })
}

/// Converts linear light to a film's share of white, as `shaders/common/tonemap.glsl` does.
pub fn expose(radiance: f64) -> f64 {
    1.0 - (-radiance.max(0.0)).exp()
}

/// Converts a film's share of white to 8 bits, as `shaders/common/tonemap.glsl` does.
pub fn encode(exposed: f64) -> f64 {
    255.0 * if exposed <= 0.003_130_8 { 12.92 * exposed } else { 1.055 * exposed.powf(1.0 / 2.4) - 0.055 }
}

/// Returns the linear light of 8 bits.
pub fn decode(value: u8) -> f64 {
    let encoded = f64::from(value) / 255.0;
    let exposed = if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) };
    -(1.0 - exposed.min(0.999)).ln()
}

/// Returns the centre of a sphere at a time.
fn center_at(motion: &Motion, is_glass: bool, seconds: f64) -> DVec3 {
    let turn = std::f64::consts::TAU;
    let along = |rate: f32, phase: f32| (seconds * f64::from(rate) + f64::from(phase)).rem_euclid(1.0);
    let (angle, cycle) =
        (turn * along(motion.orbit_rate, motion.orbit_phase), along(motion.height_rate, motion.height_phase));
    let lift = if is_glass { (turn * cycle).sin() } else { 4.0 * cycle * (1.0 - cycle) };
    let orbit = motion.orbit.as_dvec2();
    let offset = DVec3::new(orbit.x * angle.cos(), f64::from(motion.height) * lift, orbit.y * angle.sin());
    motion.anchor.as_dvec3() + offset
}

fn reflectance(cosine: f64) -> f64 {
    0.04 + 0.96 * (1.0 - cosine).powi(5)
}

/// Returns whether a ray hits a block ahead, and whether it passes the block's edges closely.
fn cross_block(low: DVec3, high: DVec3, origin: DVec3, direction: DVec3) -> (bool, bool) {
    let (a, b) = ((low - origin) / direction, (high - origin) / direction);
    let (entry, exit) = (a.min(b).max_element(), a.max(b).min_element());
    let is_doubtful = exit > -2e-5 && (exit - entry).abs() < 4e-3 || exit.abs() < 2e-5;
    (exit > entry && exit > 0.0, is_doubtful)
}
