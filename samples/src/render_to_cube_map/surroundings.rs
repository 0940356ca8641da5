//! The surroundings of the drop: a floor, and two rings of blocks that rise and sink.

use std::f32::consts::TAU;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::scene::Camera;

/// `Block` in `shaders/render_to_cube_map/frame.glsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Block {
    /// Middle of the block.
    pub middle: [f32; 3],
    /// 1 for squares of two colours in place of its own.
    pub is_floor: u32,
    /// Half of the width, height and depth.
    pub half_size: [f32; 3],
    /// Radians about its upright axis.
    pub turn: f32,
    /// Share of light that it throws back, red, green and blue.
    pub color: [f32; 3],
    padding: u32,
}

/// Blocks in a circle around the drop.
struct Ring {
    count: u32,
    radius: f32,
    half_width: f32,
    /// Lowest and highest half height.
    half_heights: [f32; 2],
    /// Crests of the wave that goes round, and the direction in which it goes.
    waves: f32,
    rounds: f32,
    /// Saturation of colours, 0 to 1.
    saturation: f32,
}

const RINGS: [Ring; 2] = [
    Ring {
        count: 22,
        radius: 5.0,
        half_width: 0.34,
        half_heights: [0.25, 1.0],
        waves: 3.0,
        rounds: 1.0,
        saturation: 0.9,
    },
    Ring {
        count: 26,
        radius: 8.5,
        half_width: 0.55,
        half_heights: [0.9, 2.1],
        waves: 2.0,
        rounds: -1.0,
        saturation: 0.6,
    },
];
const FLOOR: Block = Block {
    middle: [0.0, -1.0, 0.0],
    is_floor: 1,
    half_size: [90.0, 1.0, 90.0],
    turn: 0.0,
    color: [0.0; 3],
    padding: 0,
};

/// Middle of the drop, where the cube map is drawn from (`kDrop` in `shaders/render_to_cube_map/frame.glsl`).
pub(super) const DROP: [f32; 3] = [0.0, 1.35, 0.0];

/// Everything at `phase` of the animation's round, 0 to 1; always as many.
pub(super) fn blocks(phase: f32) -> Vec<Block> {
    let rings = RINGS.iter().flat_map(|ring| (0..ring.count).map(move |number| on_ring(ring, number, phase)));
    std::iter::once(FLOOR).chain(rings).collect()
}

/// The camera of the animation at `phase` of the round, 0 to 1.
pub(super) fn camera(phase: f32) -> Camera {
    let around = 0.9 + 0.5 * (TAU * phase).sin();
    let eye = [3.7 * around.sin(), 1.9, 3.7 * around.cos()];
    Camera::looking_at(eye, [0.0, 1.3, 0.0], 48.0)
}

fn on_ring(ring: &Ring, number: u32, phase: f32) -> Block {
    let share = number as f32 / ring.count as f32;
    let around = TAU * share;
    let crest = 0.5 + 0.5 * (ring.waves * around + TAU * ring.rounds * phase).sin();
    let [low, high] = ring.half_heights;
    let half_height = low + (high - low) * crest;
    Block {
        middle: [ring.radius * around.sin(), half_height, ring.radius * around.cos()],
        is_floor: 0,
        half_size: [ring.half_width, half_height, ring.half_width],
        turn: around,
        color: color(share, ring.saturation).into(),
        padding: 0,
    }
}

/// Colours in a circle, from 0 to 1.
fn color(share: f32, saturation: f32) -> Vec3 {
    let wave = |offset: f32| 0.5 + 0.45 * (TAU * (share + offset)).cos();
    Vec3::splat(0.55).lerp(Vec3::new(wave(0.0), wave(0.67), wave(0.33)), saturation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_ends_where_it_began_and_things_move_meanwhile() {
        let middle =
            |phase| blocks(phase).into_iter().map(|block| Vec3::from(block.middle)).collect::<Vec<_>>();
        for (first, last) in middle(0.0).iter().zip(middle(1.0)) {
            assert!(first.distance(last) < 1e-4, "{first} {last}");
        }
        assert!(middle(0.0).iter().zip(middle(0.4)).any(|(first, other)| first.distance(other) > 0.3));
        assert_eq!(blocks(0.3).len(), 49);
    }

    #[test]
    fn nothing_reaches_the_drop_or_the_camera() {
        for phase in [0.0, 0.2, 0.6, 0.9] {
            let eye = Vec3::from(camera(phase).eye);
            for block in blocks(phase).iter().filter(|block| block.is_floor == 0) {
                let across = 2.0_f32.sqrt() * block.half_size[0];
                for point in [eye, Vec3::from(DROP)] {
                    let beside = (point - Vec3::from(block.middle)) * Vec3::new(1.0, 0.0, 1.0);
                    assert!(beside.length() > across + 0.5 && point.y > 0.0, "{block:?} {point}");
                }
            }
        }
    }
}
