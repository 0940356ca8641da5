//! Allocation of byte ranges in pages of staging memory.

/// An allocated range of a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PageRange {
    pub(crate) page: usize,
    /// Offset in the page, in bytes.
    pub(crate) offset: u64,
}

/// Result of an allocation, with the action that the caller must take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PageAllocation {
    /// The page exists.
    Existing(PageRange),
    /// The caller must create the page with this many bytes. Then it calls
    /// [`page_created`](PageAllocator::page_created), or on failure [`remove_page`](PageAllocator::remove_page).
    NewPage(PageRange, u64),
}

/// Pages that are filled from the front, and cleared once none of their ranges is in use.
///
/// A range belongs first to its allocator's caller, then to a command buffer, by its sequence number. Then it is free.
#[derive(Debug)]
pub(crate) struct PageAllocator {
    /// Bytes of a page, except pages with a single larger range.
    page_bytes: u64,
    /// Empty pages are kept while all pages together have at most this many bytes.
    keep_bytes: u64,
    /// Pages by their number; `None` for unused numbers.
    pages: Vec<Option<Page>>,
    /// The page that is being filled.
    current: Option<usize>,
    /// Sequence number of a command buffer, a page, and the number of ranges of the page that it uses.
    pages_in_use: Vec<(u64, usize, u32)>,
    total_bytes: u64,
}

#[derive(Debug)]
struct Page {
    bytes: u64,
    used: u64,
    /// Number of ranges in use.
    allocation_count: u32,
}

impl PageAllocator {
    pub(crate) fn new(page_bytes: u64, keep_bytes: u64) -> Self {
        Self {
            page_bytes,
            keep_bytes,
            pages: Vec::new(),
            current: None,
            pages_in_use: Vec::new(),
            total_bytes: 0,
        }
    }

    /// Allocates `bytes` at an offset that is a multiple of `align`, a power of two.
    pub(crate) fn allocate(&mut self, bytes: u64, align: u64) -> PageAllocation {
        let fits = |page: &Page| page.fit(bytes, align).map(|offset| (offset, bytes));
        let current = self.current.and_then(|page| Some((page, fits(self.pages[page].as_ref()?)?)));
        let empty = || {
            let numbered = self.pages.iter().enumerate();
            let mut empty = numbered.filter_map(|(number, page)| Some((number, page.as_ref()?)));
            empty.find_map(|(number, page)| {
                (page.allocation_count == 0).then(|| Some((number, fits(page)?)))?
            })
        };
        if let Some((number, (offset, _))) = current.or_else(empty) {
            if let Some(page) = &mut self.pages[number] {
                page.used = offset + bytes;
                page.allocation_count += 1;
            }
            self.choose_current(number);
            return PageAllocation::Existing(PageRange { page: number, offset });
        }
        let size = bytes.max(self.page_bytes);
        let number = self.pages.iter().position(Option::is_none).unwrap_or(self.pages.len());
        if number == self.pages.len() {
            self.pages.push(None);
        }
        self.pages[number] = Some(Page { bytes: size, used: bytes, allocation_count: 1 });
        self.total_bytes += size;
        PageAllocation::NewPage(PageRange { page: number, offset: 0 }, size)
    }

    /// Records that a new page is created. Other ranges of it may be allocated from now on.
    pub(crate) fn page_created(&mut self, number: usize) {
        self.choose_current(number);
    }

    /// Selects the page to fill next: the one with the most free bytes.
    fn choose_current(&mut self, number: usize) {
        let room = |number: usize| self.pages[number].as_ref().map_or(0, |page| page.bytes - page.used);
        if self.current.is_none_or(|current| room(current) <= room(number)) {
            self.current = Some(number);
        }
    }

    /// Records that the command buffer `sequence` uses `count` ranges of a page from now on.
    pub(crate) fn mark_used(&mut self, page: usize, count: u32, sequence: u64) {
        match self.pages_in_use.last_mut() {
            Some((last, of, held)) if *last == sequence && *of == page => *held += count,
            _ => self.pages_in_use.push((sequence, page, count)),
        }
    }

    /// Frees the ranges of a finished command buffer. Returns the pages to destroy.
    pub(crate) fn release(&mut self, sequence: u64) -> Vec<usize> {
        let mut held = std::mem::take(&mut self.pages_in_use);
        let mut unwanted = Vec::new();
        held.retain(|(of, page, count)| {
            if *of == sequence {
                unwanted.extend(self.release_ranges(*page, *count));
            }
            *of != sequence
        });
        self.pages_in_use = held;
        unwanted
    }

    /// Removes a page that could not be created.
    pub(crate) fn remove_page(&mut self, number: usize) {
        if let Some(page) = self.pages.get_mut(number).and_then(Option::take) {
            self.total_bytes -= page.bytes;
            self.current = self.current.filter(|current| *current != number);
        }
    }

    /// Frees `count` ranges of a page. Returns the page if it is to be destroyed.
    fn release_ranges(&mut self, number: usize, count: u32) -> Option<usize> {
        let page = self.pages.get_mut(number)?.as_mut()?;
        page.allocation_count -= count;
        if page.allocation_count > 0 {
            return None;
        }
        page.used = 0;
        if self.total_bytes <= self.keep_bytes {
            return None;
        }
        self.remove_page(number);
        Some(number)
    }

    /// Returns the bytes of all pages.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn total_bytes(&self) -> u64 {
        self.total_bytes
    }
}

impl Page {
    fn fit(&self, bytes: u64, align: u64) -> Option<u64> {
        let offset = self.used.checked_next_multiple_of(align.max(1))?;
        offset.checked_add(bytes).filter(|end| *end <= self.bytes).map(|_| offset)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;

    #[derive(Debug, Clone)]
    enum PageOp {
        Take {
            bytes: u64,
            align: u32,
        },
        Hold {
            which: prop::sample::Index,
            sequence: u64,
        },
        GiveBack(prop::sample::Index),
        Release(u64),
        /// A requested page is created, or its creation failed.
        Made {
            which: prop::sample::Index,
            succeeds: bool,
        },
    }

    fn page_op() -> impl Strategy<Value = PageOp> {
        prop_oneof![
            5 => (prop_oneof![9 => 0..70_u64, 1 => 100..300_u64], 0..5_u32)
                .prop_map(|(bytes, align)| PageOp::Take { bytes, align }),
            3 => (any::<prop::sample::Index>(), 0..4_u64)
                .prop_map(|(which, sequence)| PageOp::Hold { which, sequence }),
            1 => any::<prop::sample::Index>().prop_map(PageOp::GiveBack),
            1 => (0..4_u64).prop_map(PageOp::Release),
            2 => (any::<prop::sample::Index>(), prop::bool::weighted(0.8))
                .prop_map(|(which, succeeds)| PageOp::Made { which, succeeds }),
        ]
    }

    /// An allocated range, and its command buffer if it has one.
    #[derive(Debug, Clone, Copy)]
    struct AllocatedRange {
        place: PageRange,
        bytes: u64,
        by: Option<u64>,
    }

    /// An allocator, and the ranges that its users hold.
    struct Model {
        pages: PageAllocator,
        sizes: BTreeMap<usize, u64>,
        taken: Vec<AllocatedRange>,
        /// Ranges of pages that are not created yet. They are not used until then.
        unmade: Vec<AllocatedRange>,
    }

    impl Model {
        fn new(pages: PageAllocator) -> Self {
            Self { pages, sizes: BTreeMap::new(), taken: Vec::new(), unmade: Vec::new() }
        }

        fn forget(&mut self, gone: impl IntoIterator<Item = usize>) {
            gone.into_iter()
                .for_each(|page| assert!(self.sizes.remove(&page).is_some(), "a page gone twice"));
        }

        fn apply(&mut self, op: PageOp) {
            match op {
                PageOp::Take { bytes, align } => self.allocate(bytes, 1 << align),
                PageOp::Hold { which, sequence } => self.mark_used(&which, sequence),
                PageOp::GiveBack(which) => self.release_one(&which),
                PageOp::Made { which, succeeds } => self.end_creation(&which, succeeds),
                PageOp::Release(sequence) => self.release(sequence),
            }
            assert_eq!(self.pages.total_bytes(), self.sizes.values().sum::<u64>());
            assert!(self.taken.iter().all(|taken| self.sizes.contains_key(&taken.place.page)));
        }

        fn allocate(&mut self, bytes: u64, align: u64) {
            let (place, list) = match self.pages.allocate(bytes, align) {
                PageAllocation::Existing(place) => (place, &mut self.taken),
                PageAllocation::NewPage(place, size) => {
                    assert!(self.sizes.insert(place.page, size).is_none(), "two pages of one number");
                    (place, &mut self.unmade)
                }
            };
            assert_eq!(place.offset % align, 0);
            assert!(place.offset + bytes <= self.sizes[&place.page]);
            let apart = |other: &AllocatedRange| {
                other.place.page != place.page
                    || other.place.offset + other.bytes <= place.offset
                    || place.offset + bytes <= other.place.offset
            };
            assert!(list.iter().all(apart));
            list.push(AllocatedRange { place, bytes, by: None });
            let is_unmade =
                |used: &AllocatedRange| self.unmade.iter().any(|page| page.place.page == used.place.page);
            assert!(!self.taken.iter().any(is_unmade), "a page is used before it is made");
        }

        fn mark_used(&mut self, which: &prop::sample::Index, sequence: u64) {
            let mut free: Vec<_> = self.taken.iter_mut().filter(|taken| taken.by.is_none()).collect();
            if !free.is_empty() {
                let place = which.index(free.len());
                free[place].by = Some(sequence);
                self.pages.mark_used(free[place].place.page, 1, sequence);
            }
        }

        fn release_one(&mut self, which: &prop::sample::Index) {
            let free: Vec<_> =
                (0..self.taken.len()).filter(|place| self.taken[*place].by.is_none()).collect();
            if !free.is_empty() {
                let gone = self.taken.remove(*which.get(&free));
                let page = self.pages.release_ranges(gone.place.page, 1);
                self.forget(page);
            }
        }

        fn end_creation(&mut self, which: &prop::sample::Index, succeeds: bool) {
            if !self.unmade.is_empty() {
                let page = self.unmade.swap_remove(which.index(self.unmade.len()));
                if succeeds {
                    self.pages.page_created(page.place.page);
                    self.taken.push(page);
                } else {
                    self.pages.remove_page(page.place.page);
                    self.forget([page.place.page]);
                }
            }
        }

        fn release(&mut self, sequence: u64) {
            self.taken.retain(|taken| taken.by != Some(sequence));
            let gone = self.pages.release(sequence);
            self.forget(gone);
        }

        /// Releases everything, and returns the bytes that the allocator keeps.
        fn release_all(mut self) -> u64 {
            for page in std::mem::take(&mut self.unmade) {
                self.pages.remove_page(page.place.page);
                self.forget([page.place.page]);
            }
            (0..4).for_each(|sequence| {
                let gone = self.pages.release(sequence);
                self.forget(gone);
            });
            for left in std::mem::take(&mut self.taken).iter().filter(|taken| taken.by.is_none()) {
                let gone = self.pages.release_ranges(left.place.page, 1);
                self.forget(gone);
            }
            self.pages.total_bytes()
        }
    }

    proptest! {
        #[test]
        fn ranges_are_aligned_inside_and_apart_until_they_are_released(ops in prop::collection::vec(page_op(), 0..120)) {
            let mut model = Model::new(PageAllocator::new(100, 250));
            ops.into_iter().for_each(|op| model.apply(op));
            let bytes = model.release_all();
            prop_assert!(bytes <= 250, "{bytes} bytes are kept");
        }

        /// Repeated filling and clearing takes no more pages than two rounds need.
        #[test]
        fn steady_use_takes_no_more_pages(bytes in 1..100_u64, count in 1..20_u64, rounds in 3..60_u64) {
            let mut pages = PageAllocator::new(100, 0);
            let mut most = 0;
            for round in 0..rounds {
                for _ in 0..count {
                    let found = pages.allocate(bytes, 4);
                    let (PageAllocation::Existing(place) | PageAllocation::NewPage(place, _)) = found;
                    if matches!(found, PageAllocation::NewPage(..)) {
                        pages.page_created(place.page);
                    }
                    pages.mark_used(place.page, 1, round);
                }
                if round == 1 {
                    most = pages.total_bytes() + 100;
                }
                if round > 0 {
                    prop_assert!(round == 1 || pages.total_bytes() <= most);
                    pages.release(round - 1);
                }
            }
        }
    }
}
