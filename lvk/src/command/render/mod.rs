//! Render passes: their description, targets, state and draws.

mod area;
mod attachments;
mod begin;
pub(crate) mod desc;
mod draw;
mod draw_mesh;
mod dynamic_state;
pub(crate) mod indirect_count;
mod input_attachments;
mod local_read;
pub(crate) mod pass;
mod resolve;
mod set_state;
mod shading_rate;
mod target;
mod target_hazards;
