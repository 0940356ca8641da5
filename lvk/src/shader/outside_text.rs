//! Entry point of a fuzz target: everything that handles GLSL texts except the compiler, which is C++.

use glslang::include::{IncludeHandler as _, IncludeType};

use super::include::Includes;
use super::{diagnostics, sanitize};

/// Prepares `text` for the compiler, requests its includes from `listed` and from the library as the compiler does, and
/// reads `log` as the compiler's log.
///
/// Directives count wherever they stand, also in comments and in branches that the preprocessor leaves out. Texts of the
/// library have guards against repetition, so their own directives are left out. True if the text gets to the compiler.
pub fn read_glsl(text: &str, listed: &[(&str, &str)], log: &str) -> bool {
    let mut includes = Includes::new(listed, &[], None);
    let prepared = sanitize::to_ascii(text).and_then(|text| sanitize::without_version(&text));
    if let Ok(text) = &prepared {
        request_includes(&mut includes, text, 1);
    }
    drop(diagnostics::warnings(log));
    drop(diagnostics::errors(log, includes.into_failures()));
    prepared.is_ok()
}

/// Requests the includes of a text at this depth, and theirs. A directive with quotes that fails is requested again with
/// angle brackets.
fn request_includes(includes: &mut Includes<'_>, text: &str, depth: usize) {
    for line in text.lines() {
        let directive = line.trim_start().strip_prefix('#').map(str::trim_start);
        let Some(name) = directive.and_then(|directive| directive.strip_prefix("include")) else { continue };
        let name = name.trim();
        let in_quotes = name.strip_prefix('"').and_then(|name| name.split_once('"'));
        let in_brackets = name.strip_prefix('<').and_then(|name| name.split_once('>'));
        let Some((name, _)) = in_quotes.or(in_brackets) else { continue };
        let local = in_quotes.and_then(|_| includes.include(IncludeType::Local, name, "", depth));
        let found = local.or_else(|| includes.include(IncludeType::System, name, "", depth));
        if let Some(found) = found.filter(|found| !found.name.starts_with("lvk/")) {
            request_includes(includes, &found.data, depth + 1);
        }
    }
}
