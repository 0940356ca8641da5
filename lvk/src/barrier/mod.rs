//! Hidden barriers, decided without a Vulkan device.
//!
//! A [`Tracker`] follows one command buffer while it is recorded; [`States`] follows the queue. Both advance the
//! `State` of each buffer and each subresource of a texture by one rule, `state::transition`.

mod access;
mod batch;
mod query_stages;
mod resource_id;
mod state;
mod states;
mod subresource;
mod tracker;

#[cfg(test)]
pub(crate) mod model;
#[cfg(test)]
mod model_tests;

pub(crate) use access::{Access, Layout, Stages, Use};
pub(crate) use batch::{Barriers, ImageBarrier, MemoryBarrier};
pub(crate) use query_stages::QueryStages;
pub(crate) use resource_id::{IdHasher, IdMap, ResourceId};
pub(crate) use states::States;
pub(crate) use subresource::{Subresources, TextureShape};
pub(crate) use tracker::{Tracker, Used};
