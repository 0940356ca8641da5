//! Test doubles and hooks for the tests of this workspace. No part of the library's interface.
#![cfg_attr(not(feature = "test-hooks"), allow(dead_code, reason = "unit tests use only some of it"))]

pub(crate) mod collapse_kernels;
pub(crate) mod collapse_model;
pub(crate) mod fault_injection;
pub(crate) mod gpu_build_check;
pub mod hooks;
pub(crate) mod null_commands;
pub(crate) mod sort_kernels;
pub(crate) mod submit_hook;
