//! The constants that every shader of the sample reads, laid out as `shaders/sponza/frame.glsl` has them.

use bytemuck::{Pod, Zeroable};

use super::frustum::Frustum;
use crate::hybrid::SceneAddresses;
use crate::scene::GpuCamera;

/// `Frame`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct FrameConstants {
    pub(super) camera: GpuCamera,
    pub(super) scene: SceneAddresses,
    pub(super) finishes: u64,
    pub(super) draws: u64,
    pub(super) views: [GpuView; 2],
    pub(super) counts: u64,
    pub(super) draw_count: u32,
    pub(super) is_packed: u32,
    pub(super) sun: GpuSun,
    pub(super) surface_sampler: u32,
    pub(super) sky: u32,
    pub(super) sky_sampler: u32,
    pub(super) has_relief: u32,
}

/// `View`: what a view culls by, and where it writes its draws.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuView {
    pub(super) planes: [[f32; 4]; 6],
    pub(super) arguments: u64,
}

/// `Sun`, and the light from everywhere else.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuSun {
    pub(super) rows: [[f32; 4]; 3],
    pub(super) to_sun: [f32; 3],
    pub(super) map: u32,
    pub(super) color: [f32; 3],
    pub(super) sampler: u32,
    pub(super) ambient_above: [f32; 3],
    pub(super) filter: u32,
    pub(super) ambient_below: [f32; 3],
    pub(super) texel: f32,
    pub(super) lamp: [f32; 3],
    pub(super) lamp_reach: f32,
    pub(super) lamp_color: [f32; 3],
    pub(super) texel_size: f32,
}

/// `Finish`: what the sample has of a material beside what all samples have.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuFinish {
    pub(super) is_masked: u32,
    pub(super) normal_map: u32,
}

/// `Draw`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuDraw {
    pub(super) low: [f32; 3],
    pub(super) first_vertex: u32,
    pub(super) high: [f32; 3],
    pub(super) vertex_count: u32,
}

impl GpuView {
    pub(super) fn new(frustum: &Frustum, arguments: u64) -> Self {
        Self { planes: frustum.planes, arguments }
    }
}

const _: () = assert!(std::mem::offset_of!(FrameConstants, views) == 168);
const _: () = assert!(std::mem::offset_of!(FrameConstants, counts) == 376);
const _: () = assert!(std::mem::offset_of!(FrameConstants, sun) == 392);
