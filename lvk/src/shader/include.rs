//! Resolves `#include` directives.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use glslang::include::{IncludeHandler, IncludeResult, IncludeType};

use super::disk_file::{Fingerprint, Included};
use super::preamble;
use super::{MAX_GLSL_BYTES, sanitize};
use crate::error::readable::readable_name;
use crate::regular_file;

/// Maximum nesting of includes. The compiler recurses on them, so deeper nesting is an error.
const MAX_DEPTH: usize = 64;
/// Maximum directives that one compilation resolves, and maximum of those that fail. Files that include the next one twice multiply
/// with each level.
const MAX_DIRECTIVES: usize = 4096;
/// Maximum bytes of a name in a directive. Each directive is recorded with its name.
const MAX_NAME_BYTES: usize = 1024;
/// Maximum bytes of all texts that one compilation includes, counted each time.
const MAX_INCLUDED_BYTES: u64 = 4 * MAX_GLSL_BYTES;
/// Number of failed directives with a full reason. Reasons name files and places, so their text can be far longer than the
/// directive.
const MAX_FULL_REASONS: usize = 16;
/// Number of listed includes that a reason names.
const MAX_NAMES: usize = 32;

/// Resolves the compiler's `#include` directives from the caller's list, folders, and the library's own files.
pub(super) struct Includes<'a> {
    listed: &'a [(&'a str, &'a str)],
    /// The listed texts by their normalized names; the first of a name counts.
    by_name: HashMap<String, &'a str>,
    dirs: &'a [&'a Path],
    open: Vec<IncludeOrigin>,
    once: HashSet<IncludeOrigin>,
    /// The error of each failed directive, in the order of the compiler's requests; of the first [`MAX_DIRECTIVES`].
    failures: Vec<String>,
    /// The resolved directives in order, and the included texts with their names, each once.
    included: Vec<Included>,
    texts: Vec<(String, String)>,
    /// Depth and name of the directive that failed last, if it has quotes.
    refused: Option<(usize, String)>,
    /// Bytes of all included texts, counted each time.
    bytes: u64,
    /// Called with each path at which an include is searched, before the search.
    on_search: Option<&'a dyn Fn(&Path)>,
}

/// The source of an included text; equal for equal files.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum IncludeOrigin {
    Library(&'static str),
    Listed(String),
    File(PathBuf),
}

impl<'a> Includes<'a> {
    pub(super) fn new(
        listed: &'a [(&'a str, &'a str)],
        dirs: &'a [&'a Path],
        on_search: Option<&'a dyn Fn(&Path)>,
    ) -> Self {
        let mut by_name = HashMap::new();
        for (name, text) in listed {
            if let Some(name) = normalize_path(name) {
                by_name.entry(name).or_insert(*text);
            }
        }
        Self {
            listed,
            by_name,
            dirs,
            open: Vec::new(),
            once: HashSet::new(),
            failures: Vec::new(),
            included: Vec::new(),
            texts: Vec::new(),
            refused: None,
            bytes: 0,
            on_search,
        }
    }

    /// True if the directives of an earlier compilation still resolve to the same texts. With the same inputs, the
    /// compiler requests the same directives.
    pub(super) fn finds_unchanged(mut self, earlier: &[Included]) -> bool {
        earlier.iter().enumerate().all(|(index, earlier)| {
            let ty = if earlier.local { IncludeType::Local } else { IncludeType::System };
            self.include(ty, &earlier.name, "", earlier.depth as usize);
            self.included.get(index) == Some(earlier)
        })
    }

    /// Returns the resolved directives in order, and the texts with their names.
    pub(super) fn into_included(self) -> (Vec<Included>, Vec<(String, String)>) {
        (self.included, self.texts)
    }

    /// Returns the reasons for the compiler's "could not process include" messages, in order.
    pub(super) fn into_failures(self) -> Vec<String> {
        self.failures
    }

    fn include_text(&mut self, local: bool, name: &str) -> Result<IncludeResult, String> {
        if self.open.len() >= MAX_DEPTH {
            return Err(format!("includes are nested deeper than {MAX_DEPTH} files"));
        }
        if self.included.len() >= MAX_DIRECTIVES {
            return Err(format!("the module includes more than {MAX_DIRECTIVES} files; {REPEATED}"));
        }
        if name.len() > MAX_NAME_BYTES {
            return Err(format!("the name '{}' is longer than {MAX_NAME_BYTES} bytes", readable_name(name)));
        }
        let (place, text) = self.resolve(local, name)?;
        let shown = place.display_path();
        if self.once.contains(&place) {
            self.open.push(place);
            return Ok(IncludeResult { name: shown, data: String::new() });
        }
        let text = sanitize::to_ascii(&text)
            .map_err(|c| format!("{}:{}: {}", readable_name(&shown), c.line, c.message))?;
        let (data, once) = without_pragma_once(&text);
        if once {
            self.once.insert(place.clone());
        }
        self.bytes += data.len() as u64;
        if self.bytes > MAX_INCLUDED_BYTES {
            return Err(format!("the module includes more than {MAX_INCLUDED_BYTES} bytes; {REPEATED}"));
        }
        // A file may include itself once: its include guard makes the second text empty.
        if self.open.iter().filter(|open| **open == place).count() > 1 {
            return Err(format!("'{}' includes itself; put #pragma once into it", readable_name(&shown)));
        }
        self.open.push(place);
        Ok(IncludeResult { name: shown, data })
    }

    fn resolve(&self, local: bool, name: &str) -> Result<(IncludeOrigin, String), String> {
        if let Some((name, text)) = preamble::library().find(|(known, _)| *known == name) {
            return Ok((IncludeOrigin::Library(name), text.to_owned()));
        }
        if let Some(found) = self.resolve_listed(local, name) {
            return Ok(found);
        }
        let beside = match self.open.last() {
            Some(IncludeOrigin::File(path)) if local => path.parent(),
            _ => None,
        };
        for dir in beside.into_iter().chain(self.dirs.iter().copied()) {
            let path = dir.join(name);
            self.on_search.iter().for_each(|on_search| on_search(&path));
            if path.is_file() {
                return read_text(&path).map(|text| (IncludeOrigin::File(canonicalize(path)), text));
            }
        }
        Err(if self.wants_reason() { self.not_found(name, beside) } else { String::new() })
    }

    fn resolve_listed(&self, local: bool, name: &str) -> Option<(IncludeOrigin, String)> {
        let beside = match self.open.last() {
            Some(IncludeOrigin::Listed(includer)) if local => {
                normalize_path(&format!("{includer}/../{name}"))
            }
            _ => None,
        };
        [normalize_path(name), beside].into_iter().flatten().find_map(|wanted| {
            let text = (*self.by_name.get(&wanted)?).to_owned();
            Some((IncludeOrigin::Listed(wanted), text))
        })
    }

    /// True if the next failure gets its full reason.
    fn wants_reason(&self) -> bool {
        self.failures.len() < MAX_FULL_REASONS
    }

    fn not_found(&self, name: &str, beside: Option<&Path>) -> String {
        if name.starts_with("lvk/") {
            let mut known: Vec<_> = preamble::library().map(|(name, _)| format!("<{name}>")).collect();
            known.sort();
            return format!("the library has no <{name}>; it has {}", known.join(", "));
        }
        let mut places: Vec<String> = Vec::new();
        if !self.listed.is_empty() {
            let shown = self.listed.iter().take(MAX_NAMES).map(|(name, _)| readable_name(name));
            let mut names: Vec<String> = shown.collect();
            if self.listed.len() > MAX_NAMES {
                names.push("...".to_owned());
            }
            places.push(format!("the listed includes ({})", names.join(", ")));
        }
        places.extend(
            beside
                .into_iter()
                .chain(self.dirs.iter().copied())
                .map(|dir| format!("'{}'", readable_name(dir))),
        );
        let name = readable_name(name);
        if places.is_empty() {
            return format!("include '{name}' not found: the module lists no includes and no include_dirs");
        }
        format!("include '{name}' not found in {}", places.join(", "))
    }

    fn record_include(&mut self, local: bool, name: &str, depth: usize, found: &IncludeResult) {
        let text = Fingerprint::from_bytes(found.data.as_bytes());
        self.included.push(Included { local, depth: depth as u32, name: name.to_owned(), text });
        if !self.texts.iter().any(|(known, _)| *known == found.name) {
            self.texts.push((found.name.clone(), found.data.clone()));
        }
    }

    /// Returns ` (included by b.glsl, included by a.glsl)`, innermost first.
    fn include_chain(&self) -> String {
        if self.open.is_empty() {
            return String::new();
        }
        let chain: Vec<_> = self
            .open
            .iter()
            .rev()
            .map(|place| format!("included by {}", readable_name(place.display_path())))
            .collect();
        format!(" ({})", chain.join(", "))
    }
}

impl IncludeHandler for Includes<'_> {
    fn include(&mut self, ty: IncludeType, name: &str, _: &str, depth: usize) -> Option<IncludeResult> {
        let local = ty == IncludeType::Local;
        // If a "" directive fails, the compiler requests it again with <>, under the same message.
        if self.refused.take() == Some((depth, name.to_owned())) && !local {
            return None;
        }
        // Failures multiply as files do. The compiler's own text stands for the reason of each further one.
        if self.failures.len() >= MAX_DIRECTIVES {
            return None;
        }
        self.open.truncate(depth.saturating_sub(1));
        match self.include_text(local, name) {
            Ok(result) => {
                self.record_include(local, name, depth, &result);
                Some(result)
            }
            Err(reason) => {
                self.failures.push(match self.wants_reason() {
                    true => reason + &self.include_chain(),
                    false => format!("'{}' cannot be included either", readable_name(name)),
                });
                self.refused = local.then(|| (depth, name.to_owned()));
                None
            }
        }
    }
}

/// Remedy for a compilation that includes too much.
const REPEATED: &str = "put #pragma once into files that several others include";

impl IncludeOrigin {
    fn display_path(&self) -> String {
        match self {
            Self::Library(name) => (*name).to_owned(),
            Self::Listed(name) => name.clone(),
            // The compiler puts the name in quotes.
            Self::File(path) => path
                .display()
                .to_string()
                .chars()
                .map(|c| if c.is_ascii() && !c.is_ascii_control() && c != '"' { c } else { '?' })
                .collect(),
        }
    }
}

fn read_text(path: &Path) -> Result<String, String> {
    regular_file::read_text(path, MAX_GLSL_BYTES)
        .map_err(|error| format!("include '{}' cannot be read: {error}", readable_name(path)))
}

fn canonicalize(path: PathBuf) -> PathBuf {
    path.canonicalize().unwrap_or(path)
}

/// Normalizes `a/./b/../c` to `a/c`. Returns `None` if the path leaves the root.
fn normalize_path(path: &str) -> Option<String> {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." => _ = parts.pop()?,
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

/// Returns the text with its `#pragma once` line emptied, and true if it has such a line. The compiler does not
/// support the pragma.
fn without_pragma_once(text: &str) -> (String, bool) {
    let is_once = |line: &str| {
        let directive = line.trim_start().strip_prefix('#').unwrap_or_default();
        directive.split_whitespace().take(2).eq(["pragma", "once"])
    };
    let mut once = false;
    let mut out = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let here = is_once(line);
        once |= here;
        out.push_str(if !here {
            line
        } else if line.ends_with('\n') {
            "\n"
        } else {
            ""
        });
    }
    (out, once)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]
    use super::*;

    /// Requests a name and, of each text, the names in its lines, as the compiler does. Returns the failures.
    fn requested(listed: &[(&str, &str)], name: &str) -> Vec<String> {
        fn request(includes: &mut Includes<'_>, name: &str, depth: usize) {
            let found = includes.include(IncludeType::System, name, "", depth);
            let text = found.map(|found| found.data).unwrap_or_default();
            text.lines().for_each(|name| request(includes, name, depth + 1));
        }
        let mut includes = Includes::new(listed, &[], None);
        request(&mut includes, name, 1);
        includes.into_failures()
    }

    #[test]
    fn texts_that_include_the_next_twice_end_with_a_remedy() {
        let texts: Vec<_> =
            (1..60).map(|next| (format!("{}", next - 1), format!("{next}\n{next}"))).collect();
        let mut listed: Vec<_> = texts.iter().map(|(name, text)| (&**name, &**text)).collect();
        listed.push(("59", ""));
        let failures = requested(&listed, "0");
        let told =
            failures.iter().filter(|text| text.contains("more than 4096 files; put #pragma once")).count();
        assert!(told > 0 && failures.len() <= MAX_DIRECTIVES, "{told} of {}", failures.len());
    }

    #[test]
    fn included_bytes_are_counted_each_time() {
        let long = "// a comment\n".repeat(MAX_GLSL_BYTES as usize / 13);
        let listed = [("long", &*long)];
        let mut includes = Includes::new(&listed, &[], None);
        let given = (0..6).filter(|_| includes.include(IncludeType::System, "long", "", 1).is_some()).count();
        assert_eq!(given, 4);
        assert!(includes.into_failures()[0].starts_with("the module includes more than 67108864 bytes; put"));
    }

    /// Texts that multiply, the last of which names a file that is missing: no more memory than for the first few thousand.
    #[test]
    fn failures_that_multiply_are_few_and_short() {
        let long = "n".repeat(MAX_NAME_BYTES);
        let (again, missing) = ("missing\n".repeat(60), format!("{long}\n").repeat(60));
        let listed = [("start", &*again), ("missing", &*missing)];
        let failures = requested(&listed, "start");
        assert_eq!(failures.len(), 60 * 60);
        assert!(failures.iter().all(|reason| reason.len() < 500), "{}", failures[0]);
        let (again, missing) = ("missing\n".repeat(100), "m\n".repeat(100));
        let listed = [("start", &*again), ("missing", &*missing)];
        assert_eq!(requested(&listed, "start").len(), MAX_DIRECTIVES);
    }

    #[test]
    fn names_are_bounded() {
        let (fits, long) = ("n".repeat(MAX_NAME_BYTES), "n".repeat(MAX_NAME_BYTES + 1));
        let listed = [(&*fits, ""), (&*long, "")];
        assert_eq!(requested(&listed, &fits), [""; 0]);
        let [failure] = &requested(&listed, &long)[..] else { panic!("one failure") };
        assert!(
            failure.starts_with("the name 'nnn") && failure.ends_with("' is longer than 1024 bytes"),
            "{failure}"
        );
    }

    #[test]
    fn many_failures_have_short_reasons() {
        let names: Vec<String> = (0..1_000).map(|number| format!("name-{number}")).collect();
        let missing: String = (0..1_000).map(|number| format!("m{number}\n")).collect();
        let mut listed: Vec<_> = names.iter().map(|name| (&**name, "")).collect();
        listed.push(("start", &missing));
        let failures = requested(&listed, "start");
        assert_eq!(failures.len(), 1_000);
        assert!(failures[0].contains("name-31, ...)") && !failures[0].contains("name-32"), "{}", failures[0]);
        assert!(failures[0].ends_with("(included by start)"), "{}", failures[0]);
        assert_eq!(failures[999], "'m999' cannot be included either");
    }
}
