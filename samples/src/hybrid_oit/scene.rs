//! The scene: blocks on a floor, balls that bounce between them, spheres of tinted glass that drift above.

use crate::app::sample_error::SampleError;
use glam::{Vec2, Vec3};

use crate::scene::Camera;

/// Seconds after which the built-in scene's motions repeat themselves.
pub const PERIOD_SECONDS: f64 = 8.0;

/// A box on the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Smallest corner, in scene units.
    pub low: Vec3,
    /// Largest corner.
    pub high: Vec3,
    /// Linear albedo of red, green and blue, 0 to 1.
    pub albedo: Vec3,
}

/// The motion of a sphere. Rates should be whole multiples of 1/[`PERIOD_SECONDS`], so that the animation repeats itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion {
    /// Middle of the motion of glass; the lowest place of the centre of a ball.
    pub anchor: Vec3,
    /// Half axes, along x and z, of an ellipse around the anchor.
    pub orbit: Vec2,
    /// Turns a second on the ellipse.
    pub orbit_rate: f32,
    /// Position on the ellipse at time 0, in turns.
    pub orbit_phase: f32,
    /// Height of a ball's bounce, or amplitude of the glass.
    pub height: f32,
    /// Bounces or bobs a second.
    pub height_rate: f32,
    /// Phase of the bounce at time 0, 0 to 1.
    pub height_phase: f32,
}

/// An opaque sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Radius in scene units.
    pub radius: f32,
    /// Linear albedo of red, green and blue, 0 to 1.
    pub albedo: Vec3,
    /// Motion of the sphere.
    pub motion: Motion,
}

/// A sphere of tinted glass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Glass {
    /// Radius in scene units.
    pub radius: f32,
    /// Transmittance along a whole diameter for red, green and blue, above 0 to 1.
    pub tint: Vec3,
    /// Motion of the sphere.
    pub motion: Motion,
}

/// The light that casts shadows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sun {
    /// Towards the sun, of any length but zero.
    pub direction: Vec3,
    /// Tangent of half the angle under which the sun is seen.
    pub radius: f32,
    /// Radiance of a surface of albedo 1 that faces the sun, linear.
    pub color: Vec3,
}

/// Everything that is seen.
#[derive(Debug, Clone, PartialEq)]
pub struct OitScene {
    /// The camera.
    pub camera: Camera,
    /// The light that casts shadows.
    pub sun: Sun,
    /// Linear albedo of the floor, which is the plane y = 0.
    pub floor_albedo: Vec3,
    /// Boxes on the floor; at least one.
    pub blocks: Vec<Block>,
    /// Opaque spheres; at least one.
    pub balls: Vec<Ball>,
    /// Spheres of glass; at least one.
    pub glass: Vec<Glass>,
}

impl Glass {
    /// Absorption of red, green and blue per unit of length (Beer and Lambert).
    #[must_use]
    pub fn absorption(&self) -> Vec3 {
        -self.tint.max(Vec3::splat(1e-6)).map(f32::ln) / (2.0 * self.radius)
    }
}

impl Motion {
    /// A ball that bounces on the place `anchor` of its lowest centre.
    fn bouncing(anchor: Vec3, height: f32, bounces: f32, phase: f32) -> Self {
        let height_rate = bounces / PERIOD_SECONDS as f32;
        Self { anchor, height, height_rate, height_phase: phase, ..Self::default() }
    }

    /// Glass that drifts around `anchor` and bobs, in step with nothing else for another `phase`.
    fn drifting(anchor: Vec3, orbit: Vec2, turns: f32, bob: f32, phase: f32) -> Self {
        Self {
            anchor,
            orbit,
            orbit_rate: turns / PERIOD_SECONDS as f32,
            orbit_phase: phase,
            height: bob,
            height_rate: 1.0 / PERIOD_SECONDS as f32,
            height_phase: (phase * 1.618).fract(),
        }
    }

    fn is_finite(&self) -> bool {
        let numbers = [
            self.orbit_rate,
            self.orbit_phase,
            self.height,
            self.height_rate,
            self.height_phase,
            self.orbit.x,
            self.orbit.y,
        ];
        self.anchor.is_finite() && numbers.iter().all(|number| number.is_finite())
    }
}

impl OitScene {
    /// Checks that there is something of each kind and that all numbers are sound.
    pub(super) fn check(&self) -> Result<(), SampleError> {
        let broken = |what| Err(SampleError::BrokenScene(what));
        if self.blocks.is_empty() || self.balls.is_empty() || self.glass.is_empty() {
            return broken("it needs at least one block, one ball and one sphere of glass");
        }
        let radii =
            self.balls.iter().map(|ball| ball.radius).chain(self.glass.iter().map(|glass| glass.radius));
        if !radii.into_iter().all(|radius| radius > 0.0 && radius.is_finite()) {
            return broken("the radius of a sphere is not positive");
        }
        let motions =
            self.balls.iter().map(|ball| ball.motion).chain(self.glass.iter().map(|glass| glass.motion));
        if !motions.into_iter().all(|motion| motion.is_finite()) {
            return broken("a motion is not finite");
        }
        if !self
            .glass
            .iter()
            .all(|glass| glass.tint.cmpgt(Vec3::ZERO).all() && glass.tint.cmple(Vec3::ONE).all())
        {
            return broken("the tint of glass is not above 0 and at most 1");
        }
        if !self.blocks.iter().all(|block| block.low.cmplt(block.high).all() && block.low.is_finite()) {
            return broken("a block is inside out");
        }
        if self.sun.direction.try_normalize().is_none() {
            return broken("the sun has no direction");
        }
        Ok(())
    }
}

impl Default for OitScene {
    /// The built-in scene.
    fn default() -> Self {
        Self {
            camera: Camera::looking_at([0.6, 4.6, 10.6], [0.15, 1.25, 0.0], 34.0),
            sun: Sun {
                direction: Vec3::new(-0.74, 0.68, 0.16),
                radius: 0.022,
                color: Vec3::new(2.20, 1.94, 1.56),
            },
            floor_albedo: Vec3::new(0.70, 0.69, 0.67),
            blocks: blocks(),
            balls: balls(),
            glass: glass(),
        }
    }
}

fn blocks() -> Vec<Block> {
    let chalk = Vec3::new(0.80, 0.79, 0.77);
    let sand = Vec3::new(0.72, 0.62, 0.50);
    let slate = Vec3::new(0.16, 0.19, 0.24);
    let clay = Vec3::new(0.62, 0.24, 0.15);
    // x, z, half width, half depth, height
    [
        (-0.35, -0.70, 0.72, 0.62, 2.7, chalk),
        (1.25, -0.25, 0.60, 0.62, 1.55, slate),
        (-1.75, 0.15, 0.55, 0.50, 1.05, sand),
        (0.25, 0.95, 0.50, 0.45, 0.75, chalk),
        (-3.10, -1.35, 0.48, 0.55, 1.95, clay),
        (3.05, -1.25, 0.55, 0.52, 2.25, chalk),
        (-0.95, 1.75, 0.34, 0.34, 0.42, slate),
        (2.45, 1.20, 0.42, 0.40, 0.55, sand),
    ]
    .map(|(x, z, width, depth, height, albedo)| Block {
        low: Vec3::new(x - width, 0.0, z - depth),
        high: Vec3::new(x + width, height, z + depth),
        albedo,
    })
    .to_vec()
}

fn balls() -> Vec<Ball> {
    let ball = |radius: f32, x, ground: f32, z, albedo, height, bounces, phase| Ball {
        radius,
        albedo,
        motion: Motion::bouncing(Vec3::new(x, ground + radius, z), height, bounces, phase),
    };
    let (white, coral, ink, mustard) = (
        Vec3::new(0.82, 0.80, 0.77),
        Vec3::new(0.80, 0.20, 0.14),
        Vec3::new(0.06, 0.09, 0.16),
        Vec3::new(0.78, 0.50, 0.08),
    );
    vec![
        ball(0.34, 1.25, 1.55, -0.25, coral, 0.9, 8.0, 0.62),
        ball(0.30, -1.75, 1.05, 0.15, white, 0.7, 9.0, 0.25),
        ball(0.26, -2.55, 0.0, 2.35, mustard, 0.5, 10.0, 0.05),
        ball(0.40, 3.75, 0.0, 0.55, white, 0.6, 9.0, 0.95),
        ball(0.22, 0.25, 0.75, 0.95, ink, 0.6, 10.0, 0.45),
        ball(0.28, 1.35, 0.0, 2.55, coral, 0.4, 11.0, 0.02),
    ]
}

fn glass() -> Vec<Glass> {
    let glass = |radius, x, y, z, tint: [f32; 3], turns, phase| Glass {
        radius,
        tint: Vec3::from(tint),
        motion: Motion::drifting(Vec3::new(x, y, z), Vec2::new(0.34, 0.26), turns, 0.16, phase),
    };
    let (aqua, rose, amber) = ([0.05, 0.58, 0.78], [0.86, 0.07, 0.30], [0.96, 0.52, 0.04]);
    let (emerald, violet, sky) = ([0.05, 0.66, 0.22], [0.38, 0.12, 0.84], [0.09, 0.32, 0.92]);
    vec![
        glass(0.82, -3.55, 1.20, 1.55, aqua, 1.0, 0.10),
        glass(0.62, -2.75, 0.95, 2.85, rose, -1.0, 0.35),
        glass(0.48, 0.35, 0.80, 2.75, amber, 1.0, 0.60),
        glass(0.40, 0.90, 0.95, 3.35, sky, -1.0, 0.15),
        glass(0.74, 3.35, 1.25, 2.15, emerald, -1.0, 0.85),
        glass(0.52, 4.45, 1.05, 1.25, violet, 1.0, 0.45),
        glass(0.66, -1.45, 2.55, 0.65, violet, -1.0, 0.75),
        glass(0.50, -0.55, 2.10, 1.15, amber, 1.0, 0.30),
        glass(0.58, 1.75, 2.75, 0.75, aqua, 1.0, 0.05),
        glass(0.44, 2.35, 2.25, 1.15, rose, -1.0, 0.55),
        glass(0.60, -4.55, 2.35, -0.65, emerald, 1.0, 0.20),
        glass(0.54, 0.45, 3.75, -0.35, rose, 1.0, 0.90),
        glass(0.46, 4.55, 2.75, -0.85, amber, -1.0, 0.65),
        glass(0.36, -0.25, 0.62, 3.85, emerald, 1.0, 0.40),
    ]
}
