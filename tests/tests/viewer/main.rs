//! The viewer: its path tracer against values that are known, against an independent path tracer, and against itself by other ray
//! tracing paths; files that it loads.

mod ambient_occlusion;
mod animation;
mod city;
mod cycles;
mod cycles_description;
mod cycles_scenes;
mod depth_pyramid;
mod dropped;
mod emitters;
mod features;
mod furnace;
mod hybrid;
mod hybrid_materials;
mod known_values;
mod layers;
mod moving_model;
mod occlusion;
mod paths;
mod radiance_cache;
mod reference;
mod reference_tracer;
mod sample_models;
mod scenes;
mod single_sided;
mod still_life;
mod texture_budget;
