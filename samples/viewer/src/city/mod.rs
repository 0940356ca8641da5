//! A city made by code, as a glTF file: few meshes in fine detail, which thousands of instances show (`EXT_mesh_gpu_instancing`,
//! `KHR_mesh_quantization`), with textures that repeat by metres (`KHR_texture_transform`). It measures how the viewer loads and draws large scenes.
//!
//! `plan` says what stands where, `buildings`, `trees` and `street` make its meshes of the quads and rings of `solid`, `surfaces`
//! lists the materials, `patterns` paints their textures, and `file` writes all of it.

mod buildings;
mod facade;
mod file;
mod glb;
mod patterns;
mod plan;
mod random;
mod solid;
mod street;
mod surfaces;
mod trees;

pub use file::CityError;

/// The numbers that a city follows from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CityConfig {
    /// Blocks along each side, 1 to [`CityConfig::MOST_BLOCKS`].
    pub blocks: u32,
    /// Kinds of buildings, 1 to [`CityConfig::MOST_KINDS`]. Each is a mesh of its own.
    pub kinds: u32,
    /// Cities of the same numbers and another seed differ.
    pub seed: u64,
    /// Texels along each side of the textures, up to [`CityConfig::MOST_TEXTURE_SIZE`]; 0 for none.
    pub texture_size: u32,
}

impl CityConfig {
    /// Most blocks along a side.
    pub const MOST_BLOCKS: u32 = 64;
    /// Most kinds of buildings.
    pub const MOST_KINDS: u32 = 256;
    /// Most texels along a side of a texture.
    pub const MOST_TEXTURE_SIZE: u32 = 4096;
}

impl Default for CityConfig {
    /// A square kilometre: more than 10 million triangles by instances.
    fn default() -> Self {
        Self { blocks: 10, kinds: 40, seed: 1, texture_size: 512 }
    }
}

/// A city and what is in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct City {
    /// The bytes of a `.glb` file.
    pub glb: Vec<u8>,
    /// Textures.
    pub texture_count: usize,
    /// Meshes.
    pub mesh_count: usize,
    /// Triangles of all meshes, each mesh once.
    pub distinct_triangles: u64,
    /// Instances of meshes.
    pub instance_count: u64,
    /// Triangles of all instances.
    pub triangles: u64,
}

/// Builds a city, the same on every machine and every call. It is lit by the sky and the sun of who shows it.
///
/// # Errors
/// [`CityError`] for numbers out of range, for a file of more than 4 GiB, and for textures that cannot be encoded.
pub fn city(config: &CityConfig) -> Result<City, CityError> {
    CityError::check("--blocks", config.blocks, 1..=CityConfig::MOST_BLOCKS)?;
    CityError::check("--kinds", config.kinds, 1..=CityConfig::MOST_KINDS)?;
    CityError::check("--texture-size", config.texture_size, 0..=CityConfig::MOST_TEXTURE_SIZE)?;
    file::write(&plan::plan(config), Some(config.texture_size).filter(|size| *size > 0))
}
