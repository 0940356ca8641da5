//! Hits of rays: triangles and AABBs in every format, at every position, with every flag.

mod aabbs;
mod degenerate_triangles;
mod extreme_coordinates;
mod flags;
mod grazing_aabbs;
mod meshes;
mod position_fetch;
mod procedural_hits;
mod ray_interval;
mod shared_vertices;
mod swiftshader;
mod transforms;
mod vertex_formats;
