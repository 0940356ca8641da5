//! A list that grows without being moved, and whose front can be given back early.

use std::ops::{Index, Range};

/// A list in blocks of the same length. A vector that grows holds its elements twice for a moment, and in the end up to half of its
/// memory is unused; a list of blocks does neither.
#[derive(Debug, Clone)]
pub(super) struct Segments<T> {
    blocks: Vec<Vec<T>>,
    length: usize,
}

impl<T> Default for Segments<T> {
    fn default() -> Self {
        Self { blocks: Vec::new(), length: 0 }
    }
}

impl<T> Segments<T> {
    /// Elements of a block.
    const BLOCK: usize = 1 << 16;

    pub fn len(&self) -> usize {
        self.length
    }

    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    pub fn push(&mut self, element: T) {
        let number = self.length / Self::BLOCK;
        if number == self.blocks.len() {
            // Most files are small: the first block grows.
            let capacity = if number == 0 { 0 } else { Self::BLOCK };
            self.blocks.push(Vec::with_capacity(capacity));
        }
        self.blocks[number].push(element);
        self.length += 1;
    }

    /// Removes all elements from `length` on.
    pub fn truncate(&mut self, length: usize) {
        if length < self.length {
            self.blocks.truncate(length.div_ceil(Self::BLOCK));
            if let Some(last) = self.blocks.last_mut() {
                last.truncate(length - (length - 1) / Self::BLOCK * Self::BLOCK);
            }
            self.length = length;
        }
    }

    /// Returns the element of this number; `None` behind the end and for one that was released.
    pub fn get(&self, number: usize) -> Option<&T> {
        self.blocks.get(number / Self::BLOCK)?.get(number % Self::BLOCK)
    }

    /// Returns the elements of these numbers, none of which was released.
    pub fn range(&self, range: Range<usize>) -> impl Iterator<Item = &T> + Clone {
        range.map(|number| &self[number])
    }

    /// Gives back the memory of full blocks that have only elements before `number`. The others keep their numbers.
    pub fn release_before(&mut self, number: usize) {
        let is_held = |block: &&mut Vec<T>| block.capacity() > 0;
        let before = number.min(self.length) / Self::BLOCK;
        self.blocks[..before].iter_mut().rev().take_while(is_held).for_each(|block| *block = Vec::new());
    }
}

impl<T> Index<usize> for Segments<T> {
    type Output = T;

    fn index(&self, number: usize) -> &T {
        &self.blocks[number / Self::BLOCK][number % Self::BLOCK]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BLOCK: usize = Segments::<u32>::BLOCK;

    fn counted(count: usize) -> Segments<u32> {
        let mut list = Segments::default();
        (0..count as u32).for_each(|number| list.push(number));
        list
    }

    #[test]
    fn released_elements_are_gone_and_the_others_keep_their_numbers() {
        let mut list = counted(3 * BLOCK + 5);
        list.release_before(BLOCK - 1);
        assert_eq!(list.get(0), Some(&0));
        list.release_before(2 * BLOCK + 7);
        assert_eq!((list.get(0), list.get(2 * BLOCK - 1)), (None, None));
        let rest: Vec<u32> = list.range(2 * BLOCK..list.len()).copied().collect();
        assert!(rest.into_iter().eq(2 * BLOCK as u32..3 * BLOCK as u32 + 5));
        list.release_before(usize::MAX);
        list.push(7);
        assert_eq!((list.len(), list[3 * BLOCK + 5]), (3 * BLOCK + 6, 7));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        #[test]
        fn it_is_a_list(count in 0..3 * BLOCK, kept in 0..3 * BLOCK, more in 0..BLOCK) {
            let (mut list, mut expected) = (counted(count), (0..count as u32).collect::<Vec<_>>());
            list.truncate(kept);
            expected.truncate(kept);
            for number in 0..more as u32 {
                list.push(number);
                expected.push(number);
            }
            prop_assert_eq!((list.len(), list.is_empty()), (expected.len(), expected.is_empty()));
            prop_assert!(list.range(0..list.len()).eq(expected.iter()));
            prop_assert_eq!(list.get(expected.len()), None);
        }
    }
}
