//! Textures and samplers: every kind, format, part and filter.

mod contents;
mod errors;
mod formats;
mod kinds;
mod samplers;
mod views;
mod yuv;
