//! tangents
