//! Samples of `lvk`: each is a type that renders headless, with a small main in `src/bin`.
#![cfg_attr(
    not(feature = "window"),
    allow(
        dead_code,
        reason = "panels of windows alone read some fields; builds with windows find what nothing reads"
    )
)]

pub mod app;
pub mod catalogue;
pub mod deferred;
pub mod hello_triangle;
pub mod hybrid;
pub mod hybrid_oit;
pub mod large_scene;
pub mod mesh_shaders;
pub mod omni_shadows;
pub mod picture;
pub mod pipelines;
pub mod raster;
pub mod reflections;
pub mod render_to_cube_map;
pub mod rtx;
pub mod rtx_ao;
pub mod rtx_hello;
pub mod rtx_pipeline;
pub mod rtx_textures;
pub mod scene;
pub mod shader_folder;
pub mod shaders;
pub mod shapes;
pub mod sponza;
pub mod triplanar;
pub mod yuv;
