//! Structures that the library builds and refits itself, on the GPU.

mod blas;
mod collapse;
mod kernels;
mod refit;
mod sort;
mod swiftshader;
mod tlas;
