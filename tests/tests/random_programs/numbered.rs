//! Contents by number: those of a program's own objects, and of parts of objects that threads share.

use std::ops::{Index, IndexMut};

/// First number of what is shared.
const SHARED: usize = 1 << 32;

/// Contents, the own ones numbered from 0 on and the shared ones from [`SHARED`] on.
#[derive(Debug)]
pub struct Numbered<T> {
    own: Vec<T>,
    shared: Vec<T>,
}

impl<T> Default for Numbered<T> {
    fn default() -> Self {
        Self { own: Vec::new(), shared: Vec::new() }
    }
}

impl<T> Numbered<T> {
    /// Number of own contents, which is the number of the next.
    pub fn len(&self) -> usize {
        self.own.len()
    }

    /// Adds contents of an own object.
    pub fn push(&mut self, contents: T) {
        self.own.push(contents);
    }

    /// Adds contents of a shared object. Returns the number.
    pub fn push_shared(&mut self, contents: T) -> usize {
        self.shared.push(contents);
        SHARED + self.shared.len() - 1
    }
}

impl<T> Index<usize> for Numbered<T> {
    type Output = T;

    fn index(&self, number: usize) -> &T {
        number.checked_sub(SHARED).map_or_else(|| &self.own[number], |shared| &self.shared[shared])
    }
}

impl<T> IndexMut<usize> for Numbered<T> {
    fn index_mut(&mut self, number: usize) -> &mut T {
        match number.checked_sub(SHARED) {
            Some(shared) => &mut self.shared[shared],
            None => &mut self.own[number],
        }
    }
}

#[test]
fn own_and_shared_contents_have_numbers_of_their_own() {
    let mut contents = Numbered::default();
    contents.push('a');
    let shared = contents.push_shared('b');
    contents.push('c');
    contents[shared] = 'd';
    assert_eq!((contents.len(), contents[0], contents[1], contents[shared]), (2, 'a', 'c', 'd'));
}
