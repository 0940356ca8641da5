//! Ray queries by the library's own traversal.

mod corrupt_blobs;
mod denormal_directions;
mod queries;
mod sample_images;
mod singular_matrices;
mod watertightness;
