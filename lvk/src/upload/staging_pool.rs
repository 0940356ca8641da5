//! A thread-safe pool of staging pages. Ranges are allocated under a lock, and pages are created without it.

use std::sync::Arc;

use super::page_allocator::{PageAllocation, PageAllocator, PageRange};
use crate::error::{Error, Result};
use crate::lock_order::{Guard, Mutex, Rank};

/// Pages of one kind of memory. `P` is the type of a page.
pub(super) struct StagingPool<P> {
    page_list: Mutex<PageList<P>>,
}

struct PageList<P> {
    pages: PageAllocator,
    /// Pages by their number; `None` for removed pages and pages being created.
    created: Vec<Option<Arc<P>>>,
}

impl<P> StagingPool<P> {
    pub(super) fn new(page_bytes: u64, kept_bytes: u64) -> Self {
        let listed = PageList { pages: PageAllocator::new(page_bytes, kept_bytes), created: Vec::new() };
        Self { page_list: Mutex::new(Rank::Staging, listed) }
    }

    /// Allocates a range, and returns it with its page. It belongs to the command buffer `sequence`, or to the caller
    /// until [`mark_used`](Self::mark_used). If no page has space, `make` creates one of the given size, while other
    /// threads can allocate.
    pub(super) fn allocate(
        &self,
        bytes: u64,
        align: u64,
        sequence: Option<u64>,
        make: impl FnOnce(u64) -> Result<P>,
    ) -> Result<(PageRange, Arc<P>)> {
        let mut listed = self.lock();
        let place = match listed.pages.allocate(bytes, align) {
            PageAllocation::Existing(place) => place,
            PageAllocation::NewPage(place, size) => {
                drop(listed);
                let made = make(size);
                listed = self.lock();
                listed.add_page(place.page, made)?;
                place
            }
        };
        if let Some(sequence) = sequence {
            listed.pages.mark_used(place.page, 1, sequence);
        }
        let page = listed.created.get(place.page).cloned().flatten();
        Ok((place, page.ok_or_else(|| Error::usage("staging", "the page is gone"))?))
    }

    /// Records that the command buffer `sequence` uses `count` ranges of a page that had no command buffer.
    pub(super) fn mark_used(&self, page: usize, count: u32, sequence: u64) {
        self.lock().pages.mark_used(page, count, sequence);
    }

    /// Frees the ranges of a finished command buffer. Returns the pages to destroy.
    pub(super) fn release(&self, sequence: u64) -> Vec<Arc<P>> {
        let PageList { pages, created: made } = &mut *self.lock();
        let unwanted = pages.release(sequence);
        unwanted.into_iter().filter_map(|page| made.get_mut(page)?.take()).collect()
    }

    /// Returns the bytes of all pages.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(super) fn total_bytes(&self) -> u64 {
        self.lock().pages.total_bytes()
    }

    fn lock(&self) -> Guard<'_, PageList<P>> {
        self.page_list.lock()
    }
}

impl<P> PageList<P> {
    /// Adds a created page, or removes a page whose creation failed.
    fn add_page(&mut self, number: usize, made: Result<P>) -> Result<()> {
        let page = made.inspect_err(|_| self.pages.remove_page(number))?;
        self.created.resize_with(self.created.len().max(number + 1), || None);
        self.created[number] = Some(Arc::new(page));
        self.pages.page_created(number);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn no_memory() -> Error {
        Error::allocating("staging", 100)(ash::vk::Result::ERROR_OUT_OF_DEVICE_MEMORY)
    }

    #[test]
    fn other_threads_take_places_while_a_page_is_made() {
        let set = StagingPool::new(100, 100);
        let mut other = None;
        let (first, size) = set
            .allocate(60, 1, Some(1), |size| {
                other = Some(set.allocate(10, 1, Some(2), Ok)?);
                Ok(size)
            })
            .unwrap();
        let (other, _) = other.unwrap();
        assert_ne!(first.page, other.page, "the page that is being made is not there yet");
        assert_eq!((*size, set.total_bytes()), (100, 200));
        let (next, _) = set.allocate(60, 1, Some(2), |_| Err(no_memory())).unwrap();
        assert_eq!(next, PageRange { page: other.page, offset: 10 }, "the other has more room");
        assert!(set.release(1).len() == 1 && set.release(2).is_empty());
        assert_eq!(set.total_bytes(), 100);
    }

    #[test]
    fn a_page_that_cannot_be_created_is_forgotten_and_other_pages_stay() {
        let set = StagingPool::new(100, 0);
        let refused = set.allocate(60, 1, Some(1), |_| {
            set.allocate(60, 1, Some(2), Ok)?;
            Err(no_memory())
        });
        assert!(matches!(refused, Err(Error::OutOfDeviceMemory { .. })));
        assert_eq!(set.total_bytes(), 100);
        assert!(set.release(1).is_empty() && set.release(2).len() == 1);
        let (again, _) = set.allocate(60, 1, Some(3), Ok).unwrap();
        assert_eq!((again, set.total_bytes()), (PageRange { page: 0, offset: 0 }, 100));
    }
}
