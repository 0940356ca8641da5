//! Hits of rays, computed on the CPU in f64 and without the library under test.
//!
//! A GPU computes in f32. The reference reports rays for which f32 may give another result: a ray through an edge,
//! along a surface, past a silhouette, two surfaces at one position, a hit at the very end of the ray. The caller
//! leaves such a ray out and counts it.

mod candidate;
mod rules;
mod sphere;
mod triangle;
mod world;

pub use candidate::{Answer, Hit, HitIds};
pub use rules::Rules;
pub use sphere::Sphere;
pub use world::{Geometry, Instance, Reference};
