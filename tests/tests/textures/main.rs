//! Textures and samplers: every kind, format, view and filter.

mod contents;
mod errors;
mod formats;
mod kinds;
mod samplers;
mod transient_heaps;
mod views;
mod yuv;
