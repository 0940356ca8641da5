//! A program and its run without a fault, with which runs with faults are compared.

use std::io;

use lvk_layer::LayerFolder;
use tempfile::TempDir;

use super::run::{Caches, Program, fault_layer, run};
use super::verdict::{Flaw, RunOutcome, flaws};
use crate::fault::Fault;
use crate::layer::NAMES_VARIABLE;

/// Runs of a fault, until one reaches it.
const TRIES: usize = 5;

/// A program, the caches that it finds when a call fails, and its run without a fault.
pub struct CleanProgram {
    /// The program.
    pub program: Program,
    /// The outcome of its run without a fault, with the names that it gives to objects for a tool.
    pub clean: RunOutcome,
    layer: LayerFolder,
    caches: TempDir,
}

impl CleanProgram {
    /// Runs the program without a fault, with caches such as it finds when a call fails, and once for a tool that reads names.
    ///
    /// # Errors
    /// Those of files and processes.
    pub fn new(program: Program) -> io::Result<Self> {
        let (layer, caches, filled) = (fault_layer()?, tempfile::tempdir()?, tempfile::tempdir()?);
        let mut named = program.clone();
        named.variables.push((NAMES_VARIABLE.to_owned(), "1".to_owned()));
        // The first run fills the caches that it finds.
        let (names, mut clean) = match program.caches {
            Caches::Warm => {
                let names = run(&named, &layer, caches.path(), None)?.names;
                (names, run(&program, &layer, caches.path(), None)?)
            }
            Caches::Cold => {
                let clean = run(&program, &layer, filled.path(), None)?;
                (run(&named, &layer, filled.path(), None)?.names, clean)
            }
        };
        clean.names.extend(names);
        Ok(Self { program, clean, layer, caches })
    }

    /// Returns the number of calls of a command without a fault.
    #[must_use]
    pub fn count(&self, command: &str) -> usize {
        self.clean.calls.iter().filter(|call| call.command == command).count()
    }

    /// Runs the program with a fault. Returns the outcome, and its flaws.
    ///
    /// # Errors
    /// Those of files and processes.
    pub fn run(&self, fault: &Fault) -> io::Result<(RunOutcome, Vec<Flaw>)> {
        let outcome = run(&self.program, &self.layer, self.caches.path(), Some(fault))?;
        let found = flaws(Some(fault), &outcome, &self.clean);
        Ok((outcome, found))
    }

    /// Runs the program with a fault, again where the fault was not reached: threads and the speed of the device change the number of calls
    /// from run to run. Returns the outcome of the last run, and its flaws.
    ///
    /// # Errors
    /// Those of files and processes.
    pub fn run_until_reached(&self, fault: &Fault) -> io::Result<(RunOutcome, Vec<Flaw>)> {
        let mut tries = 1;
        loop {
            let (outcome, found) = self.run(fault)?;
            if outcome.reached || !found.is_empty() || tries == TRIES {
                return Ok((outcome, found));
            }
            tries += 1;
        }
    }
}
