//! Automatic barriers, computed without a Vulkan device.
//!
//! A [`Tracker`] follows one command buffer while it is recorded; [`QueueState`] follows the queue. Both
//! advance the `ResourceState` of each buffer and of each texture subresource by one rule,
//! `resource_state::transition`.

mod access;
mod batch;
mod queue_state;
mod ray_query_stages;
mod resource_id;
mod resource_state;
mod subresource;
mod tracker;

#[cfg(test)]
pub(crate) mod model;
#[cfg(test)]
mod model_tests;

pub(crate) use access::{Access, Layout, Stages, Use};
pub(crate) use batch::{Barriers, ImageBarrier, MemoryBarrier};
pub(crate) use queue_state::QueueState;
pub(crate) use ray_query_stages::RayQueryStages;
pub(crate) use resource_id::{IdHasher, IdMap, ResourceId};
pub(crate) use subresource::{Subresources, TextureShape};
pub(crate) use tracker::{TrackedUse, Tracker};
