//! Names of the pictures of a sequence: `frame_####.png` is `frame_0007.png` for frame 7.

use std::path::{Path, PathBuf};

/// A path whose file name may hold a place for the frame's number, written as `#` for each digit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrameName {
    path: PathBuf,
    place: Option<Place>,
}

/// The file name around the number.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Place {
    before: String,
    digits: usize,
    after: String,
}

impl FrameName {
    /// Reads a path. The last run of `#` in the file name is the place of the number.
    #[must_use]
    pub fn new(path: &Path) -> Self {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("");
        let place = name.rfind('#').map(|last| {
            let before = name[..last].trim_end_matches('#');
            Place {
                before: before.to_owned(),
                digits: last + 1 - before.len(),
                after: name[last + 1..].to_owned(),
            }
        });
        Self { path: path.to_owned(), place }
    }

    /// True if frames have names of their own.
    #[must_use]
    pub fn has_number(&self) -> bool {
        self.place.is_some()
    }

    /// The path as given.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The path of `frame`, with leading zeros; a number with more digits than there are `#` is written in full.
    #[must_use]
    pub fn path_for(&self, frame: u32) -> PathBuf {
        match &self.place {
            None => self.path.clone(),
            Some(Place { before, digits, after }) => {
                self.path.with_file_name(format!("{before}{frame:0digits$}{after}"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(path: &str, frame: u32) -> String {
        let path = FrameName::new(Path::new(path)).path_for(frame);
        path.display().to_string().replace(std::path::MAIN_SEPARATOR, "/")
    }

    #[test]
    fn the_number_stands_where_the_signs_are() {
        assert_eq!(name("dir/frame_####.png", 7), "dir/frame_0007.png");
        assert_eq!(name("#.png", 12), "12.png");
        assert_eq!(name("a#b##c.png", 3), "a#b03c.png");
        assert_eq!(name("f_##.png", 1234), "f_1234.png");
        assert_eq!(name("dir#/plain.png", 5), "dir#/plain.png");
        assert_eq!(name("grün_###.png", 5), "grün_005.png");
    }

    #[test]
    fn only_the_file_name_counts() {
        assert!(FrameName::new(Path::new("x/#.png")).has_number());
        assert!(!FrameName::new(Path::new("x#/y.png")).has_number());
    }
}
