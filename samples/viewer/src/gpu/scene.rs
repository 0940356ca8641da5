//! A model on the GPU: arrays, textures, light and acceleration structures.

use std::ops::Range;

use glam::{Mat3, Mat4, Vec3};
use lvk::{
    AccelStructHandle, BufferHandle, BufferUsage, Context, Holder, TlasDesc, TlasInstance, rows_from_columns,
};
use lvk_gltf::{Bounds, Model, Placement, Pose};
use lvk_samples::app::array_buffer::array;

use super::albedo_table::albedo_table;
use super::geometry::{GpuMesh, GpuMeshes};
use super::layout::{GpuInstance, GpuTextureSlot, LightConstants, SceneConstants};
use super::lights::GpuLights;
use super::materials::GpuMaterials;
use super::textures::GpuTextures;
use crate::light::Environment;

/// Instances whose volume is a smaller share of that of their mesh have no inside, and are left out.
const SMALLEST_DETERMINANT: f32 = 1e-30;
/// A scene's largest coordinate over the extent that rounding errors near the origin are measured by.
const OFFSET_SHARE: f32 = 8.0;

/// A geometry to rasterise in some instances.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Draw {
    /// The geometry of the mesh.
    pub(crate) geometry: u32,
    pub(crate) triangle_count: u32,
    /// Places in the table of instances.
    pub(crate) instances: Range<u32>,
}

/// A model on the GPU.
pub(crate) struct GpuScene {
    pub(crate) constants: SceneConstants,
    pub(crate) light: LightConstants,
    pub(crate) tlas: Holder<AccelStructHandle>,
    /// The unit of length of rounding errors near the origin.
    pub(crate) offset_extent: f32,
    /// Triangles of all meshes, each mesh once.
    pub(crate) triangle_count: u64,
    /// Instances of meshes.
    pub(crate) instance_count: u32,
    /// Everything to rasterise.
    pub(crate) draws: Vec<Draw>,
    /// What is left out, for the user to read.
    pub(crate) warnings: Vec<String>,
    _meshes: GpuMeshes,
    _textures: GpuTextures,
    _buffers: Vec<Holder<BufferHandle>>,
}

impl GpuScene {
    /// Uploads a scene of `model` in a pose and builds its structures. Directional lights are discs of the radius
    /// `disc_radius`, in radians.
    pub(crate) fn new(
        ctx: &Context,
        model: &Model,
        scene: usize,
        pose: &Pose,
        environment: &Environment,
        disc_radius: f32,
    ) -> lvk::Result<Self> {
        let textures = GpuTextures::new(ctx, model)?;
        let meshes = GpuMeshes::new(ctx, model, &model.placements(scene, pose))?;
        let shown = SceneInstances::new(model, scene, pose, &meshes);
        let bounds = model.bounds(scene, pose).unwrap_or(Bounds { min: Vec3::ZERO, max: Vec3::ZERO });
        let lights = GpuLights::new(model, scene, pose, environment, disc_radius, &bounds);
        let mut arrays = Arrays { ctx, held: Vec::new() };
        let materials = GpuMaterials::new(model, &textures);
        let constants = arrays.constants(&meshes, &shown, &materials, &lights, environment)?;
        let (instances, debug_name) = (shown.tlas.as_slice(), "scene tlas");
        let capacity = instances.len().max(1) as u32;
        let tlas = ctx.create_tlas(&TlasDesc { instances, capacity, debug_name, ..TlasDesc::default() })?;
        let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
        Ok(Self {
            constants,
            light: LightConstants {
                light_count: lights.lights.len() as u32,
                disc_count: lights.disc_count,
                sky_probability: lights.sky_probability,
                sky_size: [environment.sky.width, environment.sky.height],
            },
            tlas,
            offset_extent: (largest / OFFSET_SHARE).max(f32::MIN_POSITIVE),
            triangle_count: meshes.triangle_counts.iter().map(|count| u64::from(*count)).sum(),
            instance_count: instances.len() as u32,
            draws: shown.draws,
            warnings: [textures.warnings.as_slice(), &materials.warnings].concat(),
            _meshes: meshes,
            _textures: textures,
            _buffers: arrays.held,
        })
    }
}

/// The instances of a scene, for shaders and for the top-level structure.
struct SceneInstances {
    instances: Vec<GpuInstance>,
    tlas: Vec<TlasInstance>,
    draws: Vec<Draw>,
}

impl SceneInstances {
    fn new(model: &Model, scene: usize, pose: &Pose, meshes: &GpuMeshes) -> Self {
        let mut shown = Self { instances: Vec::new(), tlas: Vec::new(), draws: Vec::new() };
        let mut placements = model.placements(scene, pose);
        placements.retain(|placement| has_inside(&placement.transform));
        placements.sort_by_key(|placement| placement.mesh);
        for same in placements.chunk_by(|a, b| a.mesh == b.mesh) {
            let mesh = same.first().and_then(|placement| meshes.meshes.get(placement.mesh)?.as_ref());
            if let Some(mesh) = mesh {
                shown.add(mesh, same, meshes);
            }
        }
        shown
    }

    /// Adds the instances of a mesh.
    fn add(&mut self, mesh: &GpuMesh, placements: &[Placement], meshes: &GpuMeshes) {
        let first = self.instances.len() as u32;
        for Placement { transform, .. } in placements {
            self.tlas.push(TlasInstance {
                transform: rows(transform),
                custom_index: self.instances.len() as u32,
                ..TlasInstance::new(*mesh.blas)
            });
            self.instances.push(gpu_instance(transform, mesh.first_geometry));
        }
        let instances = first..self.instances.len() as u32;
        self.draws.extend((0..mesh.geometry_count).map(|geometry| {
            let triangle_count = meshes.triangle_counts[(mesh.first_geometry + geometry) as usize];
            Draw { geometry, triangle_count, instances: instances.clone() }
        }));
    }
}

/// True if a transform leaves a mesh its volume.
fn has_inside(transform: &Mat4) -> bool {
    transform.is_finite() && Mat3::from_mat4(*transform).determinant().abs() >= SMALLEST_DETERMINANT
}

/// The upper three rows of a matrix.
fn rows(matrix: &Mat4) -> [f32; 12] {
    let [x, y, z, w] = [matrix.x_axis, matrix.y_axis, matrix.z_axis, matrix.w_axis];
    rows_from_columns([x, y, z, w].map(|column| column.truncate().to_array()))
}

fn gpu_instance(transform: &Mat4, first_geometry: u32) -> GpuInstance {
    let normals = Mat3::from_mat4(*transform).inverse().transpose();
    GpuInstance { rows: rows(transform), normal_columns: normals.to_cols_array(), first_geometry }
}

/// Buffers while they are made.
struct Arrays<'a> {
    ctx: &'a Context,
    held: Vec<Holder<BufferHandle>>,
}

impl Arrays<'_> {
    /// Uploads elements and returns their address. Without elements there is an unused one.
    fn upload<T: bytemuck::Pod>(&mut self, name: &str, elements: &[T]) -> lvk::Result<u64> {
        let none = [T::zeroed()];
        let elements = if elements.is_empty() { &none } else { elements };
        let buffer = array(self.ctx, name, BufferUsage::STORAGE, elements)?;
        let address = buffer.address()?;
        self.held.push(buffer);
        Ok(address)
    }

    fn constants(
        &mut self,
        meshes: &GpuMeshes,
        shown: &SceneInstances,
        materials: &GpuMaterials,
        lights: &GpuLights,
        environment: &Environment,
    ) -> lvk::Result<SceneConstants> {
        let sky = environment.sky.distribution();
        Ok(SceneConstants {
            instances: self.upload("instances", &shown.instances)?,
            geometries: self.upload("geometries", &meshes.geometries)?,
            materials: self.upload("materials", &materials.materials)?,
            slots: self.upload::<GpuTextureSlot>("texture slots", &materials.slots)?,
            lights: self.upload("lights", &lights.lights)?,
            sky_rows: self.upload("rows of the sky", &sky.rows)?,
            sky_columns: self.upload("columns of the sky", &sky.columns)?,
            sky: self.upload("sky", &environment.sky.texels)?,
            albedos: self.upload("albedos", &albedo_table())?,
        })
    }
}
