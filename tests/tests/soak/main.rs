//! Long runs: an hour of frames that create, update and destroy everything, with flat counts; and a full memory heap.
//!
//! `flat` decides if a series of samples is flat, `sample` takes the samples, `scene` holds what every frame uses,
//! `frame` draws a frame, `churn` creates and destroys, `rays` traces by a pipeline, `presentation` presents, `run` is the loop, `lengths` are the tests,
//! and `heap` fills the memory.

mod churn;
mod flat;
mod frame;
mod heap;
mod lengths;
mod presentation;
mod rays;
mod run;
mod sample;
mod scene;

/// Counts the bytes that the library, the tests and their dependencies hold, to the byte.
#[global_allocator]
static HEAP: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;
