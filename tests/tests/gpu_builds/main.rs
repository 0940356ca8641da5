//! Acceleration acceleration structures that the library's own kernels build and refit on the GPU.

mod blas;
mod cluster;
mod collapse;
mod kernels;
mod refit;
mod sort;
mod swiftshader;
mod tlas;
