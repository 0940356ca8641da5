//! The frame constants of the shaders.

use bytemuck::{Pod, Zeroable};

use crate::scene::GpuCamera;

/// `Frame` in `shaders/omni_shadows/frame.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct FrameConstants {
    pub(super) camera: GpuCamera,
    pub(super) vertices: u64,
    pub(super) corners: u64,
    pub(super) instances: u64,
    pub(super) light: [f32; 3],
    pub(super) lamp_near: f32,
    pub(super) intensity: [f32; 3],
    pub(super) bulb: f32,
    pub(super) room: [f32; 3],
    pub(super) haze: f32,
    pub(super) cube: u32,
    /// Samplers: nearest comparing, linear comparing, reading.
    pub(super) samplers: [u32; 3],
    pub(super) faces: [u32; 6],
    pub(super) filtering: u32,
    pub(super) texel: f32,
}

/// `PushConstants` in `shaders/omni_shadows/frame.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Push {
    pub(super) frame: u64,
    pub(super) face: u32,
    pub(super) padding: u32,
}

impl Push {
    pub(super) fn new(frame: u64, face: u32) -> Self {
        Self { frame, face, padding: 0 }
    }
}
