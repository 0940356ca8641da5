//! Random programs: sequences of calls, right and wrong, against a model of their outcomes and of every byte.
//!
//! `op` lists the operations, `world` holds the objects and judges outcomes, `memory` models contents, `plan` and
//! `calls` say what each operation must do, `run` runs a program, `shrink` makes failing ones small, and `seeds` are
//! the tests.

mod calls;
mod cell;
mod environment;
mod image;
mod kit;
mod memory;
mod op;
mod plan;
mod plan_rays;
mod plan_textures;
mod run;
mod seeds;
mod shrink;
mod world;
