//! Test doubles and hooks for the tests of this workspace. Not part of the library's interface.
#![cfg_attr(not(feature = "test-hooks"), allow(dead_code, reason = "unit tests use only some of it"))]

pub(crate) mod fault_injection;
pub mod hooks;
pub(crate) mod kept_modules;
#[cfg(test)]
pub(crate) mod micromap_functions;
pub(crate) mod null_commands;
#[cfg(feature = "test-hooks")]
pub mod outside_bytes;
#[cfg(all(feature = "glsl", any(test, feature = "test-hooks")))]
pub mod outside_pipelines;
#[cfg(test)]
pub(crate) mod recording_memory;
#[cfg(test)]
pub(crate) mod scattered_bounds;
#[cfg(feature = "software-ray-query")]
pub(crate) mod software_ray_query;
pub(crate) mod submit_hook;
pub(crate) mod unordered_queues;
#[cfg(feature = "window")]
pub(crate) mod window;
