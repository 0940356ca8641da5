//! Instances of a TLAS: from the host, from buffers, written by shaders, in large numbers.

mod culling;
mod from_shaders;
mod geometries;
mod lists;
mod many;
mod overlaps;
mod swiftshader;
