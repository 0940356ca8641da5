//! What is alive: for lists in tools, and for the report at the end of a context.

use super::Context;
use crate::store::LiveObject;

impl Context {
    /// Every object that has a handle, kind by kind; those that were destroyed and wait for the GPU are not among them.
    pub fn live_objects(&self) -> Vec<LiveObject> {
        self.device_state().store.live()
    }
}
