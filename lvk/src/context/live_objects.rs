//! Lists of live objects, for tools and for the report at the end of a context.

use std::ops::Range;

use super::Context;
use crate::handle::{BufferHandle, Handle};
use crate::store::LiveObject;

impl Context {
    /// Returns every object that has a handle, grouped by kind. Destroyed objects that wait for the GPU are not
    /// included.
    pub fn live_objects(&self) -> Vec<LiveObject> {
        self.device_state().store.live()
    }

    /// Returns the buffers with a byte at one of these addresses, such as those of [`FaultAddress::range`].
    ///
    /// As for [`live_objects`](Self::live_objects), destroyed buffers are not included, nor is memory of the library
    /// itself and of acceleration structures. An empty list at the address of a fault often means a buffer that was
    /// destroyed too early, or an address that was computed wrong.
    ///
    /// [`FaultAddress::range`]: crate::FaultAddress::range
    pub fn buffers_at(&self, addresses: &Range<u64>) -> Vec<LiveObject> {
        let buffers = self.device_state().store.buffers.all_objects();
        let found = buffers.iter().filter(|buffer| {
            overlap(addresses, &(buffer.address..buffer.address.saturating_add(buffer.size_bytes)))
        });
        found.map(|buffer| LiveObject { kind: BufferHandle::KIND, name: buffer.name.clone() }).collect()
    }
}

/// True if the ranges have an address in common.
fn overlap(a: &Range<u64>, b: &Range<u64>) -> bool {
    a.start.max(b.start) < a.end.min(b.end)
}

#[cfg(test)]
mod tests {
    use super::overlap;

    #[test]
    fn ranges_overlap_if_they_share_an_address() {
        for (other, expected) in
            [(0..16, false), (0..17, true), (20..21, true), (31..40, true), (32..40, false), (0..99, true)]
        {
            assert_eq!((overlap(&(16..32), &other), overlap(&other, &(16..32))), (expected, expected));
        }
        assert!(!overlap(&(16..32), &(20..20)), "an empty range has no address");
    }
}
