//! Structures that the library builds and refits itself, on the GPU.

mod anywhere;
mod blas;
mod collapse;
mod kernels;
mod refit;
mod sort;
mod tlas;
