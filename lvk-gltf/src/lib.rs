//! Reads glTF 2.0 models, `.gltf` and `.glb`, into plain data.
//!
//! [`Model::load`] reads a file. A [`Model`] owns all its data and knows nothing of Vulkan: indices into its lists take the place
//! of the file's references, meshes are lists of triangles, and every primitive has normals. [`Model::pose`] computes transforms
//! of nodes, joint matrices and weights of morph targets at a time of an animation.
//!
//! What a file has and the model leaves out is listed in [`Model::warnings`]. Files are not trusted: a file that breaks
//! the format's rules is an [`Error`], and never a panic, and the memory of a load has a bound ([`MemoryLimit`]).
#![forbid(unsafe_code)]

mod animation;
mod bounds;
mod camera;
mod error;
mod image;
mod light;
mod load;
mod material;
mod mesh;
mod model;
mod node;
mod pose;
mod positions;
mod skin;
mod warning;

pub use animation::{Animation, Channel, ChannelPath, Interpolation, Keyframes};
pub use bounds::Bounds;
pub use camera::{Camera, Projection};
pub use error::{Error, Problem, Result};
pub use glam;
pub use image::{ColorSpace, Filter, Image, ImageData, MipLevel, Sampler, TexelFormat, Wrap};
pub use light::{Light, LightKind};
pub use load::{LoadOptions, MemoryLimit, Progress, SUPPORTED_EXTENSIONS};
pub use material::{
    AlphaMode, Anisotropy, Clearcoat, Iridescence, Material, Sheen, Specular, TextureRef, TextureTransform,
    Transmission, Volume,
};
pub use mesh::{Mesh, MorphTarget, Primitive};
pub use model::{Model, Scene};
pub use node::{Node, Transform, Trs};
pub use pose::{Placement, Pose};
pub use positions::Positions;
pub use skin::Skin;
pub use warning::Warning;
