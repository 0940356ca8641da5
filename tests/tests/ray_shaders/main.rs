//! Shaders that trace rays and shaders that rays run: pipelines and their records, any-hit shaders, queries in every
//! stage.

mod any_hit;
mod invocation_reorder;
mod judging_loops;
mod launches;
mod lowered;
mod payload_types;
mod pipelines;
mod query_getters;
mod query_stages;
mod random_pipelines;
mod recursion;
mod shader_forms;
mod swiftshader;
mod which_runs;
