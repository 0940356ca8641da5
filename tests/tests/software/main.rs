//! Ray queries that the library walks itself.

mod corrupt_blobs;
mod denormal_directions;
mod queries;
mod sample_images;
mod singular_matrices;
mod watertightness;
