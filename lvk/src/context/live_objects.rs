//! List of live objects, for tools and for the report at the end of a context.

use super::Context;
use crate::store::LiveObject;

impl Context {
    /// Returns every object that has a handle, grouped by kind. Destroyed objects that wait for the GPU are not
    /// included.
    pub fn live_objects(&self) -> Vec<LiveObject> {
        self.device_state().store.live()
    }
}
