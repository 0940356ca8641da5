//! Programs that draw the same triangle, each with another library.

/// A program that draws a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Program {
    /// The library, and how it is built if there is more than one way.
    pub label: &'static str,
    /// Lines of `[dependencies]`. `{root}` stands for the folder of the repository.
    pub dependencies: &'static str,
    /// Name and text of each source file; the first is the main file.
    pub files: &'static [(&'static str, &'static [u8])],
}

impl Program {
    /// Returns the lines of code in the files that a person has written: without empty lines, comments and SPIR-V.
    #[must_use]
    pub fn lines_of_code(&self) -> usize {
        let texts = self.files.iter().filter_map(|(_, bytes)| std::str::from_utf8(bytes).ok());
        texts.map(lines_of_code).sum()
    }
}

fn lines_of_code(text: &str) -> usize {
    let is_code = |line: &&str| !line.is_empty() && !line.starts_with("//");
    text.lines().map(str::trim).filter(is_code).count()
}

/// Returns the version of a package in a `Cargo.lock`; the first, if there are several.
pub(super) fn locked_version<'a>(lock: &'a str, package: &str) -> Option<&'a str> {
    let name = format!("name = \"{package}\"");
    let mut lines = lock.lines().skip_while(|line| *line != name).skip(1);
    lines.next()?.strip_prefix("version = \"")?.strip_suffix('"')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_empty_lines_are_no_code() {
        let text = "//! A program.\n\nfn main() {\n    // A reason.\n    run(); // now\n}\n";
        assert_eq!(lines_of_code(text), 3);
        let files: &[(&str, &[u8])] = &[("main.rs", b"fn main() {}\n"), ("a.spv", &[3, 2, 0x23, 0xff])];
        assert_eq!(Program { label: "a", dependencies: "", files }.lines_of_code(), 1);
    }

    #[test]
    fn versions_come_from_the_lock_file() {
        let lock = "[[package]]\nname = \"ash-window\"\nversion = \"0.13.0\"\n\n[[package]]\nname = \"ash\"\nversion = \"0.38.0\"\n";
        assert_eq!(locked_version(lock, "ash"), Some("0.38.0"));
        assert_eq!(locked_version(lock, "wgpu"), None);
    }
}
