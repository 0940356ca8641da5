//! The world on the GPU: vertices and indices of everything, and the gpu_scene that lead a hit to its surface.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Mat3A, Vec3};
use lvk::{
    BlasGeometry, BufferHandle, BufferUsage, Context, GeometryFlags, Holder, IndexFormat, Indices,
    TextureHandle, Triangles, VertexFormat, transform_rows,
};

use super::animation::Animation;
use super::quantise::{Grid, PackedVertex};
use super::scene::{HallScene, Material, Model, Placed};
use super::transparency_sort::{SortBounds, farthest_first};
use crate::app::array_buffer::array;
use crate::app::scene_textures::NO_TEXTURE;
use crate::shapes::Mesh;

/// `kKindStatic`, `kKindSkinned` and `kKindLeaf` there.
const KIND_STATIC: u32 = 0;
const KIND_SKINNED: u32 = 1;
const KIND_LEAF: u32 = 2;

/// `Material` there.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct GpuMaterial {
    albedo: [f32; 3],
    roughness: f32,
    emission: [f32; 3],
    metalness: f32,
    albedo_texture: u32,
    texels_per_unit: f32,
    opacity: f32,
    density: f32,
}

/// `Geometry` there.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct GpuGeometry {
    vertices: u64,
    normals: u64,
    indices: u64,
    material: u32,
    kind: u32,
}

/// `Instance` there.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct GpuInstance {
    rows: [f32; 12],
    normal_columns: [f32; 9],
    first_geometry: u32,
}

/// A geometry to rasterise in some instances.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Draw {
    /// A place in the table of geometries.
    pub(super) geometry: u32,
    /// Range in the buffer of indices.
    pub(super) indices: Range<u32>,
    /// Places in the table of instances.
    pub(super) instances: Range<u32>,
}

/// Vertices and indices while they are collected, and where the parts of each model came to lie.
#[derive(Default)]
pub(super) struct GeometryArena {
    vertices: Vec<PackedVertex>,
    indices: Vec<u16>,
    models: Vec<PackedModel>,
}

struct PackedModel {
    grid: Grid,
    parts: Vec<Part>,
}

struct Part {
    vertices: Range<u32>,
    /// Places of indices; they begin at an even one, as shaders read pairs.
    indices: Range<u32>,
    material: u32,
}

/// Buffers and gpu_scene; the static models' geometries for the builds, and what to draw.
pub(super) struct GpuScene {
    pub(super) indices: Holder<BufferHandle>,
    pub(super) materials: u64,
    pub(super) geometries: u64,
    pub(super) instances: u64,
    pub(super) opaque: Vec<Draw>,
    transparent: Vec<Draw>,
    /// Bounds of each transparent draw.
    layers: Vec<SortBounds>,
    _held: [Holder<BufferHandle>; 4],
}

impl GeometryArena {
    /// Puts all models on grids of their own.
    pub(super) fn from_models(models: &[Model]) -> Self {
        let mut arena = Self::default();
        for model in models {
            let bounds = model.parts.iter().map(|(mesh, _)| mesh.bounds());
            let (low, high) = bounds.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default();
            let grid = Grid::from_bounds(low, high);
            let parts = model.parts.iter().map(|(mesh, material)| arena.add(mesh, *material, grid)).collect();
            arena.models.push(PackedModel { grid, parts });
        }
        arena
    }

    fn add(&mut self, mesh: &Mesh, material: u32, grid: Grid) -> Part {
        let first = self.vertices.len() as u32;
        self.vertices.extend(mesh.vertices.iter().map(|vertex| grid.pack(vertex)));
        let indices = self.add_indices(&mesh.triangles);
        Part { vertices: first..self.vertices.len() as u32, indices, material }
    }

    /// Adds indices and answers their places.
    pub(super) fn add_indices(&mut self, triangles: &[[u16; 3]]) -> Range<u32> {
        self.indices.resize(self.indices.len().next_multiple_of(2), 0);
        let first = self.indices.len() as u32;
        self.indices.extend(triangles.as_flattened());
        first..self.indices.len() as u32
    }

    /// The buffers that builds read: vertices and indices.
    pub(super) fn upload(&self, ctx: &Context) -> lvk::Result<[Holder<BufferHandle>; 2]> {
        let usage = BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT;
        let mut indices = self.indices.clone();
        indices.resize(indices.len().next_multiple_of(2), 0);
        Ok([
            array(ctx, "static vertices", usage, &self.vertices)?,
            array(ctx, "indices", usage | BufferUsage::INDEX, &indices)?,
        ])
    }

    /// Returns the mapping from the vertices of a model to the model.
    pub(super) fn grid(&self, model: usize) -> Grid {
        self.models[model].grid
    }

    /// The geometries of a model, for its bottom-level structure.
    pub(super) fn geometries(
        &self,
        model: usize,
        [vertices, indices]: [BufferHandle; 2],
    ) -> Vec<BlasGeometry> {
        let stride = size_of::<PackedVertex>() as u64;
        let geometry = |part: &Part| {
            BlasGeometry::Triangles(Triangles {
                vertex_buffer: vertices,
                vertex_offset: u64::from(part.vertices.start) * stride,
                vertex_stride: stride,
                vertex_format: VertexFormat::Snorm16x4,
                vertex_count: part.vertices.end - part.vertices.start,
                indices: Some(index_range(indices, &part.indices)),
                triangle_count: (part.indices.end - part.indices.start) / 3,
                transform: None,
                flags: GeometryFlags::OPAQUE,
            })
        };
        self.models[model].parts.iter().map(geometry).collect()
    }
}

/// Indices of 16 bits at these places of a buffer.
pub(super) fn index_range(buffer: BufferHandle, places: &Range<u32>) -> Indices {
    Indices { buffer, offset: 2 * u64::from(places.start), format: IndexFormat::U16 }
}

impl GpuScene {
    pub(super) fn new(
        ctx: &Context,
        world: &HallScene,
        arena: &GeometryArena,
        [vertices, indices]: [Holder<BufferHandle>; 2],
        animation: &Animation,
        textures: &[Holder<TextureHandle>],
    ) -> lvk::Result<Self> {
        let mut lists = Lists { vertices: vertices.address()?, ..Lists::default() };
        lists.indices = indices.address()?;
        for (number, model) in world.models.iter().enumerate() {
            lists.add_model(world, arena, number, model);
        }
        lists.add_moving(world, animation);
        let materials: Vec<_> =
            world.materials.iter().map(|material| gpu_material(material, world, textures)).collect();
        let read = BufferUsage::STORAGE;
        let materials = array(ctx, "materials", read, &materials)?;
        let geometries = array(ctx, "geometries", read, &lists.geometries)?;
        let instances = array(ctx, "instances", read, &lists.instances)?;
        Ok(Self {
            indices,
            materials: materials.address()?,
            geometries: geometries.address()?,
            instances: instances.address()?,
            opaque: lists.opaque,
            transparent: lists.transparent,
            layers: lists.layers,
            _held: [vertices, materials, geometries, instances],
        })
    }
}

impl GpuScene {
    /// The transparent surfaces, one instance each, farthest first as seen from `eye`.
    pub(super) fn transparent(&self, eye: Vec3) -> Vec<Draw> {
        farthest_first(&self.layers, eye).into_iter().map(|place| self.transparent[place].clone()).collect()
    }
}

#[derive(Default)]
struct Lists {
    vertices: u64,
    indices: u64,
    geometries: Vec<GpuGeometry>,
    instances: Vec<GpuInstance>,
    opaque: Vec<Draw>,
    transparent: Vec<Draw>,
    layers: Vec<SortBounds>,
}

impl Lists {
    fn add_model(&mut self, world: &HallScene, arena: &GeometryArena, number: usize, model: &Model) {
        let PackedModel { grid, parts } = &arena.models[number];
        let (first_geometry, first) = (self.geometries.len() as u32, self.instances.len() as u32);
        for placed in world.placed.iter().filter(|placed| placed.model == number) {
            self.instances.push(gpu_instance(placed.to_world, *grid, first_geometry));
        }
        for (part, (mesh, _)) in parts.iter().zip(&model.parts) {
            let geometry = GpuGeometry {
                vertices: self.vertices + u64::from(part.vertices.start) * size_of::<PackedVertex>() as u64,
                normals: 0,
                indices: self.indices + 2 * u64::from(part.indices.start),
                material: part.material,
                kind: KIND_STATIC,
            };
            if model.is_transparent {
                let places = world.placed.iter().filter(|placed| placed.model == number);
                self.add_layers(geometry, &part.indices, first, mesh, places);
            } else {
                self.add_geometry(geometry, part.indices.clone(), first);
            }
        }
    }

    /// A draw for each instance of a transparent mesh: they are ordered one by one.
    fn add_layers<'a>(
        &mut self,
        geometry: GpuGeometry,
        indices: &Range<u32>,
        first: u32,
        mesh: &Mesh,
        places: impl Iterator<Item = &'a Placed>,
    ) {
        let number = self.geometries.len() as u32;
        self.geometries.push(geometry);
        let (low, high) = mesh.bounds();
        for (instance, placed) in (first..).zip(places) {
            self.layers.push(SortBounds::new(low, high, &placed.to_world));
            let (indices, instances) = (indices.clone(), instance..instance + 1);
            self.transparent.push(Draw { geometry: number, indices, instances });
        }
    }

    /// The serpent, then the leaves: an instance each.
    fn add_moving(&mut self, world: &HallScene, animation: &Animation) {
        let serpent = self.add_identity();
        let parts = animation.skin_parts.iter().zip(world.serpent_materials);
        for (part, material) in parts {
            let geometry = GpuGeometry {
                vertices: animation.skin_positions + 12 * u64::from(part.first_vertex),
                normals: animation.skin_normals + 4 * u64::from(part.first_vertex),
                indices: self.indices + 2 * u64::from(part.indices.start),
                material,
                kind: KIND_SKINNED,
            };
            self.add_geometry(geometry, part.indices.clone(), serpent);
        }
        let leaves = self.add_identity();
        let geometry = GpuGeometry {
            vertices: animation.leaf_positions,
            normals: 0,
            indices: self.indices + 2 * u64::from(animation.leaf_indices.start),
            material: world.leaf_material,
            kind: KIND_LEAF,
        };
        self.add_geometry(geometry, animation.leaf_indices.clone(), leaves);
    }

    fn add_identity(&mut self) -> u32 {
        let rows = transform_rows(&Affine3A::IDENTITY);
        let normal_columns = Mat3A::IDENTITY.to_cols_array();
        let first_geometry = self.geometries.len() as u32;
        self.instances.push(GpuInstance { rows, normal_columns, first_geometry });
        self.instances.len() as u32 - 1
    }

    fn add_geometry(&mut self, geometry: GpuGeometry, indices: Range<u32>, first: u32) {
        let (number, end) = (self.geometries.len() as u32, self.instances.len() as u32);
        self.geometries.push(geometry);
        self.opaque.push(Draw { geometry: number, indices, instances: first..end });
    }
}

fn gpu_instance(to_world: Affine3A, grid: Grid, first_geometry: u32) -> GpuInstance {
    let normals = to_world.matrix3.inverse().transpose();
    let rows = transform_rows(&(to_world * grid.to_model()));
    GpuInstance { rows, normal_columns: normals.to_cols_array(), first_geometry }
}

fn gpu_material(material: &Material, world: &HallScene, textures: &[Holder<TextureHandle>]) -> GpuMaterial {
    let texture = material
        .texture
        .map(|(place, extent)| (textures[place].index(), world.textures[place].size as f32 / extent));
    let (albedo_texture, texels_per_unit) = texture.unwrap_or((NO_TEXTURE, 0.0));
    GpuMaterial {
        albedo: material.albedo,
        roughness: material.roughness,
        emission: material.emission,
        metalness: material.metalness,
        albedo_texture,
        texels_per_unit,
        opacity: material.opacity,
        density: material.density,
    }
}
