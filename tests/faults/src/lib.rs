//! Fault injection at every Vulkan call, from outside of the library.
//!
//! The crate is a Vulkan layer: a dynamic library that the Vulkan loader puts between a program and its driver. The layer
//! makes one call of the program fail, or that call and all later ones, and counts the objects that are alive. Programs
//! need no change. [`sweep`] runs a program once for each call and judges each run. The program `fault_scenarios` runs the
//! samples, and scenarios of the library that no sample has.

pub mod call_log;
pub mod fault;
pub mod fault_report;
pub mod layer;
pub mod leftovers;
pub mod sweep;
