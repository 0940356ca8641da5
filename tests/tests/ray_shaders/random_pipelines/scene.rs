//! The scene of random pipelines: three instances behind each other along each ray.

use lvk::glam::{Affine3A, Vec3};
use lvk::{
    Aabbs, AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferUsage, CommandBuffer, Context,
    GeometryFlags, Holder, Result, TlasDesc, TlasInstance, Triangles, transform_rows,
};
use lvk_tests::shader_groups::Push;

use super::program::MOST_HITS;

/// Columns of instances along x: those whose first instance is a triangle, and as many whose first is an AABB.
const COLUMNS: usize = 2 * MOST_HITS;
/// Instances behind each other.
pub const LAYERS: usize = 3;
/// Hit group of the second layer. That of the third one follows.
pub const GROUP_BEHIND: usize = MOST_HITS;

/// Returns the column of a target, where `procedural` has a bit for each target whose group is one of AABBs.
pub fn first_column(procedural: u32, target: usize) -> usize {
    target + MOST_HITS * (procedural >> target & 1) as usize
}

/// Returns the number of an instance.
pub fn instance(layer: usize, column: usize) -> u32 {
    (layer * COLUMNS + column) as u32
}

/// Returns the distance of a layer of triangles, in eighths. Rays start one unit in front of the first.
pub fn distance(layer: usize) -> u32 {
    8 + 16 * layer as u32
}

/// The instances.
pub struct Scene {
    _models: [Holder<AccelStructHandle>; 2],
    tlas: Holder<AccelStructHandle>,
}

impl Scene {
    /// Builds the instances.
    pub fn new(ctx: &Context) -> Result<Self> {
        let corners = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let bounds = [0.0_f32, 0.0, -0.75, 1.0, 1.0, 0.75];
        let buffer = |floats: &[f32]| {
            let data = Some(bytemuck::cast_slice(floats));
            ctx.create_buffer(&BufferDesc { data, usage: BufferUsage::ACCEL_INPUT, ..Default::default() })
        };
        let (vertices, boxes) = (buffer(&corners)?, buffer(&bounds)?);
        let flags = GeometryFlags::empty();
        let geometries = [
            BlasGeometry::Triangles(Triangles { flags, ..Triangles::packed(*vertices, 3) }),
            BlasGeometry::Aabbs(Aabbs { buffer: *boxes, offset: 0, stride: 0, count: 1, flags }),
        ];
        let model = |geometry: &BlasGeometry| {
            ctx.create_blas(&BlasDesc { geometries: std::slice::from_ref(geometry), ..Default::default() })
        };
        let models = [model(&geometries[0])?, model(&geometries[1])?];
        let place = |index: usize| {
            let (layer, column) = (index / COLUMNS, index % COLUMNS);
            let is_box = layer == 0 && column >= MOST_HITS;
            let at = Vec3::new(column as f32, 0.0, 2.0 * layer as f32);
            let group = if layer == 0 { column % MOST_HITS } else { GROUP_BEHIND + layer - 1 };
            TlasInstance {
                transform: transform_rows(&Affine3A::from_translation(at)),
                hit_group_offset: group as u32,
                ..TlasInstance::new(*models[usize::from(is_box)])
            }
        };
        let instances: Vec<_> = (0..LAYERS * COLUMNS).map(place).collect();
        let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() })?;
        Ok(Self { _models: models, tlas })
    }

    /// Writes push constants: the address of the results, the scene, and the numbers of hit groups and miss shaders.
    pub fn push_constants(&self, cmd: &mut CommandBuffer, results: u64, counts: [usize; 2]) -> Result<()> {
        let [hits, misses] = counts.map(|count| count as u32);
        cmd.push_constants(&Push { results, tlas: self.tlas.index(), hits, misses, pad: 0 })
    }
}
