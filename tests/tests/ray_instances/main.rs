//! Instances in top-level structures: from the host, from lists, by shaders, in great numbers.

mod culling;
mod from_shaders;
mod geometries;
mod lists;
mod many;
mod overlaps;
mod swiftshader;
