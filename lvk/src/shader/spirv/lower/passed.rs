//! Variables that pass values between shaders.

use std::collections::HashMap;

use super::linker::Linker;

/// Variables that pass payloads or data between shaders, one for each shape of a type.
#[derive(Debug, Default)]
pub(super) struct Passed {
    by_shape: HashMap<u32, u32>,
}

impl Passed {
    /// Returns the variable for values of the type that the variable `like` has.
    pub(super) fn variable(&mut self, linker: &mut Linker, like: u32) -> u32 {
        let ty = linker.variable_type(like).unwrap_or(0);
        let shape = linker.shape(ty);
        *self.by_shape.entry(shape).or_insert_with(|| linker.private(ty))
    }

    /// Returns all variables.
    pub(super) fn all(&self) -> Vec<u32> {
        let mut all: Vec<u32> = self.by_shape.values().copied().collect();
        all.sort_unstable();
        all
    }
}
