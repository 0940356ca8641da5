//! The passes of a frame and what lies between them: all that depends on the size of the picture and on the shaders.

use std::ops::Range;

use lvk::{CommandBuffer, Context};

use super::accumulation::Accumulation;
use super::config::{Bounces, HybridConfig};
use super::frame::{FrameConstants, Indices, Lighting, Push, ReflectivePixelAddresses};
use super::geometry_stage::GeometryStage;
use super::gpu_scene::GpuScene;
use super::launch_tiles::launch_tiles;
use super::pixel_order::PixelOrder;
use super::ray_pass::{GeometryLeft, RayPass};
use crate::scene::GpuCamera;

/// Rows that a CPU renders in one go: short enough to show progress, long enough to keep every core busy.
const CPU_TILE_ROWS: u32 = 48;
/// Pixels that a GPU renders in one go: so few that no driver takes it for hung.
const GPU_TILE_PIXELS: u32 = 1 << 23;

/// The passes of a frame and what lies between them.
pub(super) struct FramePasses {
    pub(super) geometry: GeometryStage,
    pub(super) accumulation: Accumulation,
    /// The rows of each launch of rays.
    pub(super) launch_tiles: Vec<Range<u32>>,
    order: Option<PixelOrder>,
    rays: RayPass,
    addresses: Addresses,
    indices: Indices,
    width: u32,
    height: u32,
}

/// Addresses of buffers.
struct Addresses {
    sums: u64,
    bounces: ReflectivePixelAddresses,
    order: u64,
}

impl FramePasses {
    pub(super) fn new(ctx: &Context, scene: &GpuScene, config: &HybridConfig) -> lvk::Result<Self> {
        let HybridConfig { width, height, samples, .. } = *config;
        let accumulation = Accumulation::new(ctx, [width, height], samples)?;
        let geometry = GeometryStage::new(ctx, scene, config)?;
        let is_ordered = config.bounces == Some(Bounces::First) && config.max_depth > 0;
        let order = is_ordered.then(|| PixelOrder::new(ctx, [width, height])).transpose()?;
        let tile_rows = tile_rows(config, ctx.capabilities().is_cpu).min(height);
        let rays = RayPass::new(ctx, config, width * tile_rows)?;
        let addresses = Addresses {
            sums: accumulation.sums_address()?,
            bounces: rays.reflective_pixel_addresses()?,
            order: order.as_ref().map_or(Ok(0), PixelOrder::address)?,
        };
        Ok(Self {
            indices: indices(scene, &geometry, accumulation.picture.index()),
            launch_tiles: launch_tiles(height, tile_rows),
            geometry,
            accumulation,
            order,
            rays,
            addresses,
            width,
            height,
        })
    }

    /// Returns the constants of one of `sample_count` samples.
    pub(super) fn constants(
        &self,
        view: &GpuCamera,
        scene: &GpuScene,
        lighting: Lighting,
        [sample_number, sample_count]: [u32; 2],
    ) -> FrameConstants {
        FrameConstants {
            camera: view.for_sample(sample_number, sample_count),
            scene: scene.addresses(),
            lighting,
            indices: self.indices,
            visibility: self.geometry.addresses(),
            bounces: self.addresses.bounces,
            order: self.addresses.order,
            sums: self.addresses.sums,
            sample_number,
            sample_count,
            padding: [0; 2],
        }
    }

    /// Records what comes before the rays of a sample, whose constants are at the address `frame`.
    pub(super) fn record_geometry(&self, cmd: &mut CommandBuffer, frame: u64) -> lvk::Result<()> {
        let push = Push { frame, first: 0, end: self.height };
        self.geometry.record(cmd, &push)?;
        self.order.as_ref().map_or(Ok(()), |order| order.record(cmd, &push, &self.geometry.left()))
    }

    /// Records the rays of a tile of a sample.
    pub(super) fn record_tile(&self, cmd: &mut CommandBuffer, frame: u64, tile: usize) -> lvk::Result<()> {
        let Range { start: first, end } = self.launch_tiles[tile];
        let push = Push { frame, first, end };
        self.rays.record(cmd, self.width, &push, &self.left(), &self.accumulation)
    }

    /// Resources that the geometry pass and the pixel order leave.
    fn left(&self) -> GeometryLeft {
        let mut left = self.geometry.left();
        left.buffers.extend(self.order.as_ref().map(PixelOrder::buffer));
        left
    }
}

fn tile_rows(config: &HybridConfig, is_cpu: bool) -> u32 {
    if is_cpu { CPU_TILE_ROWS } else { GPU_TILE_PIXELS / config.width }
}

fn indices(scene: &GpuScene, geometry: &GeometryStage, output: u32) -> Indices {
    let mut indices = Indices {
        tlas: scene.tlas.index(),
        sky: scene.sky.index(),
        surface_sampler: scene.surface_sampler.index(),
        sky_sampler: scene.sky_sampler.index(),
        output,
        ..bytemuck::Zeroable::zeroed()
    };
    geometry.name_in(&mut indices);
    indices
}
