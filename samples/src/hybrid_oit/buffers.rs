//! The sample's buffers.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lvk::{BufferDesc, BufferHandle, BufferUsage, Context, Holder};

use super::frame::{Addresses, GpuMotion};
use super::glass_lists::NODE_BYTES;
use super::scene::{Block, OitScene};

/// Half the side of the floor, far beyond where it has faded into the horizon.
const FLOOR_EXTENT: f32 = 150.0;
/// Bytes of a sphere, of a box and of an instance record.
const SPHERE_BYTES: u64 = 32;
const BOX_BYTES: u64 = 24;
const RECORD_BYTES: u64 = 64;
/// Instances besides the balls: floor and blocks, and all glass.
pub(super) const OTHER_INSTANCES: u32 = 2;

/// Everything that shaders reach by address.
pub(super) struct Buffers {
    pub(super) motions: Holder<BufferHandle>,
    /// Positions of the spheres, written every frame.
    pub(super) spheres: Holder<BufferHandle>,
    pub(super) faces: Holder<BufferHandle>,
    pub(super) positions: Holder<BufferHandle>,
    pub(super) blocks: Holder<BufferHandle>,
    /// Around each sphere of glass; written every frame.
    pub(super) boxes: Holder<BufferHandle>,
    /// Instances; written every frame.
    pub(super) records: Holder<BufferHandle>,
    pub(super) heads: Holder<BufferHandle>,
    pub(super) node_count: Holder<BufferHandle>,
    pub(super) nodes: Holder<BufferHandle>,
    pub(super) glass_light: Holder<BufferHandle>,
    /// Vertices of the floor and the blocks.
    pub(super) vertex_count: u32,
}

/// `Face` in the shaders.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Face {
    normal: [f32; 3],
    albedo: [f32; 3],
}

/// Triangles of the floor and the blocks, and a face for every two of them.
#[derive(Default)]
struct Solids {
    positions: Vec<[f32; 3]>,
    faces: Vec<Face>,
}

impl Buffers {
    /// The buffers for a raster of `samples` samples and a pool of `nodes` nodes.
    pub(super) fn new(ctx: &Context, scene: &OitScene, samples: u64, nodes: u32) -> lvk::Result<Self> {
        let solids = Solids::from_scene(scene);
        let blocks: Vec<[f32; 6]> = scene.blocks.iter().map(|block| corners(block.low, block.high)).collect();
        let motions = GpuMotion::of_scene(scene);
        let sphere_count = motions.len() as u64;
        let glass_count = scene.glass.len() as u64;
        let instances = scene.balls.len() as u64 + u64::from(OTHER_INSTANCES);
        let storage = BufferUsage::STORAGE;
        let input = storage | BufferUsage::ACCEL_INPUT;
        Ok(Self {
            motions: filled(ctx, bytemuck::cast_slice(&motions), storage, "motions")?,
            spheres: empty(ctx, sphere_count * SPHERE_BYTES, storage, "spheres")?,
            faces: filled(ctx, bytemuck::cast_slice(&solids.faces), storage, "faces")?,
            positions: filled(ctx, bytemuck::cast_slice(&solids.positions), input, "positions")?,
            blocks: filled(ctx, bytemuck::cast_slice(&blocks), storage, "blocks")?,
            boxes: filled(ctx, &vec![0; (glass_count * BOX_BYTES) as usize], input, "boxes of glass")?,
            records: empty(ctx, instances * RECORD_BYTES, storage, "instance records")?,
            heads: heads(ctx, samples)?,
            node_count: empty(ctx, 4, storage, "node count")?,
            nodes: pool(ctx, nodes)?,
            glass_light: empty(ctx, glass_count * 12, storage, "light on glass")?,
            vertex_count: solids.positions.len() as u32,
        })
    }

    /// Makes room for a raster of `samples` samples and a pool of `nodes` nodes.
    pub(super) fn resize(&mut self, ctx: &Context, samples: u64, nodes: u32) -> lvk::Result<()> {
        (self.heads, self.nodes) = (heads(ctx, samples)?, pool(ctx, nodes)?);
        Ok(())
    }

    /// Addresses of the buffers.
    pub(super) fn addresses(&self) -> lvk::Result<Addresses> {
        Ok(Addresses {
            motions: self.motions.address()?,
            spheres: self.spheres.address()?,
            faces: self.faces.address()?,
            positions: self.positions.address()?,
            blocks: self.blocks.address()?,
            boxes: self.boxes.address()?,
            records: self.records.address()?,
            heads: self.heads.address()?,
            node_count: self.node_count.address()?,
            nodes: self.nodes.address()?,
            glass_light: self.glass_light.address()?,
        })
    }
}

impl Solids {
    fn from_scene(scene: &OitScene) -> Self {
        let mut solids = Self::default();
        let [x, z] = [Vec3::X, Vec3::Z].map(|axis| axis * FLOOR_EXTENT);
        solids.add_face(Vec3::ZERO, x, -z, scene.floor_albedo);
        for block in &scene.blocks {
            solids.add_block(block);
        }
        solids
    }

    /// A rectangle around `center`; `right` cross `up` points to its outer side.
    fn add_face(&mut self, center: Vec3, right: Vec3, up: Vec3, albedo: Vec3) {
        let normal = right.cross(up).normalize_or_zero().to_array();
        self.faces.push(Face { normal, albedo: albedo.to_array() });
        let corner = |x: f32, y: f32| (center + x * right + y * up).to_array();
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        self.positions.extend([a, b, c, a, c, d]);
    }

    /// The five sides of a block that can be seen.
    fn add_block(&mut self, block: &Block) {
        let (center, half) = (0.5 * (block.low + block.high), 0.5 * (block.high - block.low));
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * half);
        for (out, right, up) in [(y, x, -z), (x, -z, y), (-x, z, y), (z, x, y), (-z, -x, y)] {
            self.add_face(center + out, right, up, block.albedo);
        }
    }
}

fn heads(ctx: &Context, samples: u64) -> lvk::Result<Holder<BufferHandle>> {
    empty(ctx, samples * 4, BufferUsage::STORAGE, "heads of lists")
}

fn pool(ctx: &Context, nodes: u32) -> lvk::Result<Holder<BufferHandle>> {
    empty(ctx, u64::from(nodes.max(1)) * NODE_BYTES, BufferUsage::STORAGE, "nodes")
}

fn corners(low: Vec3, high: Vec3) -> [f32; 6] {
    [low.x, low.y, low.z, high.x, high.y, high.z]
}

fn filled(
    ctx: &Context,
    data: &[u8],
    usage: BufferUsage,
    debug_name: &str,
) -> lvk::Result<Holder<BufferHandle>> {
    ctx.create_buffer(&BufferDesc { data: Some(data), usage, debug_name, ..BufferDesc::default() })
}

fn empty(
    ctx: &Context,
    size_bytes: u64,
    usage: BufferUsage,
    debug_name: &str,
) -> lvk::Result<Holder<BufferHandle>> {
    ctx.create_buffer(&BufferDesc { size_bytes, usage, debug_name, ..BufferDesc::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_look_outwards() {
        let scene = OitScene::default();
        let solids = Solids::from_scene(&scene);
        assert_eq!(solids.faces.len(), 1 + 5 * scene.blocks.len());
        assert_eq!(solids.positions.len(), 6 * solids.faces.len());
        assert_eq!(solids.faces[0].normal, [0.0, 1.0, 0.0]);
        for (index, block) in scene.blocks.iter().enumerate() {
            let center = 0.5 * (block.low + block.high);
            for face in 1 + 5 * index..6 + 5 * index {
                let normal = Vec3::from(solids.faces[face].normal);
                for corner in &solids.positions[6 * face..6 * face + 6] {
                    assert!(normal.dot(Vec3::from(*corner) - center) > 0.0);
                }
            }
        }
    }
}
