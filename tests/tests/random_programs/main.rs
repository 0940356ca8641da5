//! Random programs: sequences of calls, right and wrong, against a model of their outcomes and of every byte.
//!
//! `op` lists the operations, `world` holds the objects and judges outcomes, `memory` models contents, `plan` and the
//! modules named after it, `queries` and `calls` with those named after it say what each operation must do, `run` runs a
//! program, `threads` runs programs on several threads, `shared` holds objects that all of them use, `shrink` makes failing
//! ones small, and `seeds` and `kept` are the tests: of generated programs, and of those that have failed. `covered` holds
//! the list of calls that no program makes.

mod calls;
mod calls_accel;
mod calls_ask;
mod cell;
mod covered;
mod draw_items;
mod environment;
mod image;
mod kept;
mod kit;
mod kit_draws;
mod memory;
mod numbered;
mod op;
mod plan;
mod plan_draws;
mod plan_mesh_draws;
mod plan_pipelines;
mod plan_rays;
mod plan_records;
mod plan_shared;
mod plan_targets;
mod plan_textures;
mod queries;
mod run;
mod seeds;
mod shared;
mod shrink;
mod threads;
mod watchdog;
mod world;
