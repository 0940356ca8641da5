//! Tests of the image tests: a shader broken on purpose changes the image of its sample.

mod hybrid;
mod mistakes;
mod raster;
mod rays;
