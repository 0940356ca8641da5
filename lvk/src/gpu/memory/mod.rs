//! Device memory: the allocator, its slabs and the budget of each heap.

pub(crate) mod allocator;
pub(crate) mod budget;
#[cfg(unix)]
pub(crate) mod external;
pub(crate) mod slab;
