//! The interface of a measured library.

use std::ops::Add;
use std::time::Instant;

use super::program::Program;
use super::row::Row;
use super::workload::Workload;

/// The reason why a peer cannot do a row.
pub type Failure = Box<dyn std::error::Error>;

/// A library that takes part in the comparison.
#[derive(Debug, Clone, Copy)]
pub struct PeerEntry {
    /// Short name, for columns and for the command line.
    pub name: &'static str,
    /// Name and version requirement of the library's package.
    pub package: &'static str,
    /// Opens a device by the library. Vulkan's loader is in the process already.
    pub open: fn() -> Result<Box<dyn Peer>, Failure>,
    /// The program that draws one triangle, and others that only differ in how the library is built.
    pub triangles: &'static [Program],
}

/// The device that a peer has opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PeerDevice {
    /// Name of the device, as the driver gives it.
    pub name: String,
    /// True if the driver runs on the CPU.
    pub is_cpu: bool,
}

/// A device that a library has opened.
pub trait Peer {
    /// Returns the opened device.
    fn device(&self) -> PeerDevice;

    /// Creates what a row needs. The row keeps the device.
    ///
    /// # Errors
    /// The reason why the library, or the library on this device, cannot do the row.
    fn prepare(self: Box<Self>, row: Row, workload: &Workload) -> Result<Box<dyn RowRun>, Failure>;
}

/// The prepared work of one row.
pub trait RowRun {
    /// Does the work once, and waits until the GPU is done.
    ///
    /// # Errors
    /// The library's error.
    fn sample(&mut self) -> Result<Sample, Failure>;

    /// Returns a number that depends on the results of the last sample, and that is equal for all peers; `None` for work
    /// without a result.
    ///
    /// # Errors
    /// The library's error.
    fn result(&mut self) -> Result<Option<f64>, Failure> {
        Ok(None)
    }
}

/// Times of one sample, in milliseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sample {
    /// Time of the thread until all work was submitted.
    pub cpu: f64,
    /// Time until the GPU was done.
    pub done: f64,
}

impl Add for Sample {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { cpu: self.cpu + other.cpu, done: self.done + other.done }
    }
}

impl Sample {
    /// Times the work from `submit` until `wait` returns.
    ///
    /// # Errors
    /// The first error of the two.
    pub fn take<T>(
        submit: impl FnOnce() -> Result<T, Failure>,
        wait: impl FnOnce(T) -> Result<(), Failure>,
    ) -> Result<Self, Failure> {
        let start = Instant::now();
        let submission = submit()?;
        let cpu = start.elapsed().as_secs_f64() * 1e3;
        wait(submission)?;
        Ok(Self { cpu, done: start.elapsed().as_secs_f64() * 1e3 })
    }
}
