//! Tests of the tests: pictures of samples must not be what they were when a shader is broken on purpose.

mod hybrid;
mod raster;
mod rays;
