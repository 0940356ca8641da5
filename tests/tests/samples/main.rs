//! The samples: images, frames, sequences, and the report of the experiment.

mod deferred;
mod frames;
mod group_pixel;
mod hello_triangle;
mod hybrid_images;
mod hybrid_oit;
mod hybrid_reference;
mod hybrid_visibility;
mod large_scene;
mod mesh_shaders;
mod obj_files;
mod omni_shadows;
mod panels;
mod paper;
mod pipeline_paths;
mod profiles;
mod reflections;
mod render_to_cube_map;
mod rtx_ao;
mod rtx_hello;
mod rtx_pipeline;
mod rtx_textures;
mod sequences;
mod sponza;
mod triplanar;
mod yuv;
