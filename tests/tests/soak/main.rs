//! Long runs: an hour of frames that create, update and destroy everything, with flat counts.
//!
//! `flat` decides if a series of samples is flat, `sample` takes the samples, `scene` holds what every frame uses,
//! `frame` draws a frame, `churn` creates and destroys, `shown` presents, `run` is the loop, and `lengths` are the tests.

mod churn;
mod flat;
mod frame;
mod lengths;
mod run;
mod sample;
mod scene;
mod shown;
