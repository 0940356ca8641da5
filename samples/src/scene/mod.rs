//! A scene: one list of triangles with materials, textures, lights, a sky and five cameras.
//!
//! A [`Scene`] comes from a Wavefront OBJ file ([`Scene::from_obj`]) or from code ([`Scene::procedural`]);
//! nothing here knows Vulkan. All lengths are in scene units (metres in the scenes that ship), +y is up,
//! coordinates are right-handed, colours are linear with Rec. 709 primaries unless a texture says sRGB.
//!
//! # The lighting model
//!
//! Both sources of scenes are lit for the following model, which the shaders of the `hybrid` sample implement
//! (Phong's, extended by the paper's recursive reflection and refraction). With `n` the unit normal turned
//! towards the viewer, `l` the unit vector to a light, `r` the direction of view mirrored at `n`:
//!
//! ```text
//! base    = albedo * texture * vertex colour
//! direct  = sum over lights that are seen: light(p) * (base * max(n.l, 0) + specular * max(r.l, 0)^shininess)
//! phong   = emission + base * ambient.evaluate(n) + direct        (specular only where n.l > 0)
//! glass   = fresnel * mirrored + (1 - fresnel) * refracted         (fresnel from `ior`)
//! result  = phong * (1 - reflectivity - transmission)
//!         + tint * (reflectivity * mirrored + transmission * glass)
//! ```
//!
//! `light(p)` is [`PointLight::irradiance`] or [`DirectionalLight::color`]; a ray that leaves the scene sees
//! [`Sky::radiance`]. The picture is `sRGB(1 - exp(-result))`, which [`display`] computes on the CPU.

mod benchmark;
mod byte_names;
mod camera;
mod camera_file;
mod camera_path;
mod error;
#[cfg(test)]
mod exporter_tests;
mod framing;
mod gpu_camera;
mod image_name;
mod interior;
mod key_numbers;
mod large_polygon;
mod light;
mod material;
mod mesh;
mod mip_levels;
mod mtl;
mod mtl_text;
pub mod noise;
mod normals;
mod obj;
mod obj_mesh;
mod obj_text;
mod placement;
mod polygon;
mod procedural;
mod relief;
mod segments;
mod setting;
mod sky;
mod texcoord_mapping;
mod text_blocks;
mod text_lines;
mod text_numbers;
mod texture;
#[cfg(test)]
mod tobj_comparison_tests;
mod vertex_colors;
mod warnings;

use std::path::PathBuf;

use crate::app::progress::Progress;

pub use camera::Camera;
pub use camera_path::CameraPath;
pub(crate) use camera_path::CameraTour;
pub use error::SceneError;
pub use gpu_camera::GpuCamera;
pub use light::{Ambient, DirectionalLight, PointLight, display, encode_srgb};
pub use material::Material;
pub use mip_levels::{Encoding, blits_keep_the_mean, mip_levels};
pub(crate) use procedural::{PAINTED, Valley, painted_textures};

pub use sky::Sky;
pub use texture::Texture;

/// Everything a renderer needs, in flat arrays.
///
/// Invariants, kept by every constructor: `positions`, `normals` and `texcoords` have the same length, which `colors` has too
/// unless it is empty; every index is in range; every position and texture coordinate is finite; every normal has unit length;
/// `triangle_materials` and `source_triangles` have one entry per triangle; there is at least one triangle.
#[derive(Debug, Clone)]
pub struct Scene {
    /// File stem, or `courtyard` for the procedural scene.
    pub name: String,
    /// Vertex positions in scene units.
    pub positions: Vec<[f32; 3]>,
    /// Unit vertex normals.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates in images that repeat; (0, 0) is the image's first texel, so `v` runs down.
    pub texcoords: Vec<[f32; 2]>,
    /// Vertex colours, linear RGB, 0 to 1, which multiply the diffuse reflectance; empty if all are white.
    pub colors: Vec<[f32; 3]>,
    /// Vertex indices; opaque triangles first, then refractive ones, each group in the order of
    /// the source.
    pub triangles: Vec<[u32; 3]>,
    /// Number of opaque `triangles`, which come first. Shadow rays pass through the rest.
    pub opaque_triangle_count: u32,
    /// Index into `materials`, one per triangle.
    pub triangle_materials: Vec<u32>,
    /// The triangle's number in its source (polygons count as fans), one per triangle.
    pub source_triangles: Vec<u32>,
    /// Materials; never empty.
    pub materials: Vec<Material>,
    /// Images, each once, however many materials use it.
    pub textures: Vec<Texture>,
    /// Images of directions on surfaces, each once: red to the right, green up, blue off the surface, 0 to 255 for -1 to 1.
    /// Empty unless they were asked for.
    pub normal_maps: Vec<Texture>,
    /// The lamp.
    pub light: PointLight,
    /// A second, directional light, where the scene has one.
    pub sun: Option<DirectionalLight>,
    /// Light that comes from everywhere and casts no shadow.
    pub ambient: Ambient,
    /// The sky that rays meet when they leave the scene.
    pub sky: Sky,
    /// Five views of the scene, the first being the one to show.
    pub cameras: [Camera; 5],
    /// Triangles of the source without area, which were dropped.
    pub degenerate_triangle_count: u32,
    /// Factor from the units of the file, after [`ObjOptions::scale`], to scene units: a power of two for a mesh so large or small
    /// that its numbers would leave the range of single precision, else 1. Cameras and lights are in scene units.
    pub resize: f64,
    /// Errors of the source and their corrections, one line each, for the user to read.
    pub warnings: Vec<String>,
}

/// Options for reading an OBJ file.
#[derive(Debug, Clone, Default)]
pub struct ObjOptions {
    /// Factor from file units to scene units ([`Scene::resize`] comes on top); `None` takes the known scale of a benchmark scene, else 1.
    pub scale: Option<f32>,
    /// A camera file (see [`SceneError::CameraFile`]); `None` takes the built-in cameras of a benchmark scene,
    /// else cameras computed from the geometry.
    pub cameras: Option<PathBuf>,
    /// True if normal maps are read (`norm`, `map_bump`, `bump`).
    pub normal_maps: bool,
}

impl Scene {
    /// Loads a Wavefront OBJ file with its MTL and textures.
    ///
    /// Recoverable flaws (undefined materials, missing textures, missing normals) are mended and listed in
    /// [`Scene::warnings`].
    ///
    /// # Errors
    /// [`SceneError`] when the file cannot be read, is no OBJ, has no triangle with area, a face with a position that is not
    /// finite, or an index out of range, or when the camera file is wrong.
    pub fn from_obj(
        path: &std::path::Path,
        options: &ObjOptions,
        progress: &mut Progress,
    ) -> Result<Self, SceneError> {
        obj::load(path, options, progress)
    }

    /// Builds the courtyard, the scene that needs no file: at least 100,000 triangles with opaque, mirror and
    /// glass objects and painted textures. The same on every machine and every call.
    pub fn procedural() -> Self {
        procedural::courtyard()
    }

    /// Builds a columned atrium for rasterisers: opaque surfaces with painted textures. The same everywhere.
    pub fn atrium() -> Self {
        procedural::atrium()
    }

    /// Builds a town of paper, a scene of plain surfaces for light and shade. The same everywhere.
    pub fn town() -> Self {
        procedural::town()
    }

    /// Builds what turns around the vertical in the middle of the [`town`](Self::town).
    pub fn carousel() -> Self {
        procedural::carousel()
    }

    /// A scene without triangles under the usual sky, without light, to be completed.
    pub(crate) fn empty() -> Self {
        let setting = setting::Setting {
            light: PointLight { position: [0.0; 3], color: [0.0; 3], reach: 1.0 },
            sun: None,
            ambient: Ambient { above: [0.0; 3], below: [0.0; 3] },
            sky: Sky::day(),
            cameras: [Camera::looking_at([0.0; 3], [0.0, 0.0, -1.0], 60.0); 5],
        };
        setting.into_scene(String::new(), mesh::Mesh::default(), Vec::new())
    }

    /// True if it surrounds its middle, as rooms do.
    pub(crate) fn is_interior(&self) -> bool {
        framing::is_interior(&self.positions, &self.triangles)
    }

    /// Smallest box around all positions, as (minimum, maximum) in scene units.
    pub fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        bounds_of(&self.positions)
    }
}

/// Smallest box around `positions`; a point at the origin when there are none.
fn bounds_of(positions: &[[f32; 3]]) -> ([f32; 3], [f32; 3]) {
    let Some(&first) = positions.first() else { return ([0.0; 3], [0.0; 3]) };
    positions.iter().fold((first, first), |(low, high), p| {
        (std::array::from_fn(|i| low[i].min(p[i])), std::array::from_fn(|i| high[i].max(p[i])))
    })
}
