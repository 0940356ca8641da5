//! What rays hit: triangles and boxes in every format, at every place, with every flag.

mod anywhere;
mod boxes;
mod far;
mod flags;
mod generated;
mod inactive;
mod meshes;
mod position_fetch;
mod range;
mod shared_vertices;
mod touched_boxes;
mod transforms;
mod vertex_formats;
