//! The `reflections` sample: ray traced reflections over a rasterised picture, after "Vulkan Ray Tracing Best Practices
//! for Hybrid Rendering" (Khronos, on Wolfenstein: Youngblood).
//!
//! * Opaque reflections start from depth and normals of a g-buffer; transparent surfaces are drawn into a second one,
//!   whose depth masks a second ray pass, and are blended over the lit picture afterwards, farthest first.
//! * One ray for each light says whether a pixel sees it; shadows are then smoothed as far as their penumbra reaches, which
//!   follows from the distance of the blocker.
//! * Rays are shortened by roughness ([`reflection_range`]) and what they find is filtered by roughness and by the
//!   distance of what they met.
//! * A character is skinned by compute into the buffer that its structure is refitted from in every frame; leaves turn
//!   to the camera and are built anew, alpha-masked by an any-hit shader or while a query walks.
//! * Models have a geometry for each material, positions of 16 bits and indices of 16 bits; the grid of the positions
//!   is undone by the transforms of the instances.
//! * The top-level structure shows what is seen under a large enough angle ([`InstanceCount`]).
//! * What is reflected is lit as what is seen, with shadow rays of its own, on screen or off; only light from all around
//!   is a guess there, by spherical harmonics (`shaders/reflections/lighting.glsl`).
//!
//! [`Reflections`] is the sample for programs and tests, `info.rs` describes its program.

mod animation;
mod config;
mod culling_cost;
mod frame;
mod gpu_scene;
mod image_passes;
mod info;
mod meshes;
#[cfg(feature = "window")]
mod panel;
mod pipelines;
mod procedural_textures;
mod quantise;
mod raster_passes;
mod ray_passes;
mod ray_range;
mod renderer;
mod scene;
mod serpent;
mod sky_light;
mod targets;
mod top_level;
mod transparency_sort;

pub use config::{ReflectionsConfig, SkinUpdate};
pub use culling_cost::{CullingCost, RayCost};
pub use info::ReflectionsArgs;
pub use ray_range::{FAR, ROUGHEST_TRACED, reflection_range};
pub use renderer::Reflections;
pub use top_level::InstanceCount;
