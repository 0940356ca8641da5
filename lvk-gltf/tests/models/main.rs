//! Models made in code: what each feature of glTF becomes, and what is refused.

mod containers;
mod damage;
mod geometry;
mod glb;
mod hierarchy;
mod images;
mod materials;
mod meshopt_codecs;
mod motion;
mod quantization;
mod references;
mod sample_models;
mod sparse;
mod support_table;
mod tangents;
