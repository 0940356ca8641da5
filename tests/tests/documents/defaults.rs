//! The docstring of each public field that callers fill in ends with the default of the field, and the default is true.
//!
//! A struct with `Default` is filled in by callers unless it is one of the [`RESULTS`], which the library returns:
//! their defaults are zeros and empty lists, and have no meaning of their own.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::HashMap;

use crate::glossary::files;

/// Structs with `Default` that the library returns.
const RESULTS: [&str; 17] = [
    "AccelStructSizes",
    "Capabilities",
    "DepthResolveLimits",
    "DeviceFault",
    "DeviceLossReport",
    "FormatSupport",
    "GpuProfile",
    "GpuScope",
    "Limits",
    "MeshLimits",
    "MicromapLimits",
    "PipelineStatistics",
    "QueueInfo",
    "ShaderCacheStats",
    "ShadingRateLimits",
    "SubgroupLimits",
    "TransientHeapMemory",
];

/// Beginning of the sentence that says a default.
const SENTENCE: &str = "Default: ";

/// A public field of a public struct.
struct Field {
    name: String,
    kind: String,
    docs: String,
}

/// A public struct with its public fields.
struct Struct {
    name: String,
    derives_default: bool,
    fields: Vec<Field>,
}

/// Returns the structs of a file that have public fields.
fn structs(text: &str) -> Vec<Struct> {
    let (mut found, mut derives, mut rest) = (Vec::new(), false, text.lines());
    while let Some(line) = rest.next() {
        if line.starts_with("#[derive(") {
            derives = words(line).any(|word| word == "Default");
        } else if let Some(name) = line.strip_prefix("pub struct ").filter(|_| line.ends_with('{')) {
            let name = words(name).next().unwrap().to_owned();
            let fields = fields(rest.by_ref().take_while(|line| *line != "}"));
            found.push(Struct { name, derives_default: derives, fields });
        } else if line == "}" {
            derives = false;
        }
    }
    found.retain(|item| !item.fields.is_empty());
    found
}

/// Returns the public fields among the lines of a struct, with the text of their docstrings.
fn fields<'a>(lines: impl Iterator<Item = &'a str>) -> Vec<Field> {
    let (mut found, mut docs) = (Vec::new(), String::new());
    for line in lines.map(str::trim) {
        if let Some(text) = line.strip_prefix("///") {
            docs += text;
        } else if let Some((name, kind)) = line.strip_prefix("pub ").and_then(|field| field.split_once(": "))
        {
            let kind = kind.trim_end_matches(',').to_owned();
            found.push(Field { name: name.to_owned(), kind, docs: std::mem::take(&mut docs) });
        } else if !line.starts_with("#[") {
            docs.clear();
        }
    }
    found
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '_').filter(|word| !word.is_empty())
}

/// Returns the values of an `impl Default` that are written as `field: value`; `None` without such an `impl`.
fn written_values(text: &str, name: &str) -> Option<HashMap<String, String>> {
    let head = format!("\nimpl Default for {name}");
    let mut starts = text.match_indices(&head).map(|(start, _)| start + head.len());
    let start = starts.find(|start| text[*start..].starts_with([' ', '<']))?;
    let body = text[start..].split("\n}").next()?;
    let Some(literal) = body.rfind("Self {").map(|at| &body[at + "Self {".len()..]) else {
        return Some(HashMap::new());
    };
    let mut depth = 0;
    let parts = literal.split(|letter| {
        depth += match letter {
            '[' | '(' | '{' => 1,
            ']' | ')' | '}' => -1,
            _ => 0,
        };
        letter == ',' && depth == 0
    });
    let last_line = |part: &str| part.trim_end_matches([' ', '\n', '}']).lines().last().map(str::to_owned);
    let pair =
        |line: String| line.trim().split_once(": ").map(|(name, value)| (name.to_owned(), value.to_owned()));
    Some(parts.filter_map(last_line).filter_map(pair).collect())
}

/// Returns the variants marked `#[default]`, by the name of their enum.
fn default_variants(text: &str) -> HashMap<String, String> {
    let (mut found, mut item, mut marked) = (HashMap::new(), None, false);
    for line in text.lines().map(str::trim) {
        if let Some(name) = line.strip_prefix("pub enum ") {
            item = words(name).next();
        }
        if let (true, Some(item), Some(variant)) = (marked, item, words(line).next()) {
            found.insert(item.to_owned(), variant.to_owned());
        }
        marked = line == "#[default]";
    }
    found
}

/// Returns the statement of the value of an expression; `None` if the expression is not a plain one.
fn stated_value(value: &str, variants: &HashMap<String, String>) -> Option<String> {
    if let Some(default) = value.strip_suffix("::default()") {
        return variants.get(default).map(|variant| format!("[`{default}::{variant}`]"));
    }
    if let Some(mebibytes) = value.strip_suffix(" << 20") {
        return Some(format!("{mebibytes} MiB"));
    }
    match value {
        "None" => return Some("none".to_owned()),
        "&[]" => return Some("empty".to_owned()),
        "true" | "false" => return Some(value.to_owned()),
        _ => {}
    }
    if value.starts_with('"') {
        return Some(format!("`{value}`"));
    }
    if value.starts_with(|first: char| first.is_ascii_digit()) {
        return Some(value.strip_suffix(".0").unwrap_or(value).replace('_', ","));
    }
    let path = value.trim_start_matches('&');
    let is_path =
        path.contains("::") && path.chars().all(|letter| letter.is_alphanumeric() || ":_".contains(letter));
    is_path.then(|| {
        if path.starts_with(char::is_uppercase) { format!("[`{path}`]") } else { format!("`{path}`") }
    })
}

/// Returns the statement of the value that a derived `Default` gives a field of a type; `None` for other structs.
fn derived_value(kind: &str, variants: &HashMap<String, String>) -> Option<String> {
    let value = match kind {
        "bool" => "false",
        "u8" | "u32" | "u64" | "f32" => "0",
        list if list.starts_with("&'a ") => "empty",
        option if option.starts_with("Option<") => "none",
        other => return stated_value(&format!("{other}::default()"), variants),
    };
    Some(value.to_owned())
}

/// Returns the default that a docstring ends with.
fn statement(docs: &str) -> Option<&str> {
    let start = docs.rfind(SENTENCE)?;
    let starts_sentence = docs[..start].trim_end().is_empty() || docs[..start].ends_with(". ");
    docs[start + SENTENCE.len()..].strip_suffix('.').filter(|_| starts_sentence)
}

/// Returns the fields of a file whose docstrings lack the default, or say another one.
fn complaints(file: &str, text: &str, variants: &HashMap<String, String>) -> Vec<String> {
    let mut found = Vec::new();
    for item in structs(text) {
        let written = written_values(text, &item.name);
        let has_default = item.derives_default || written.is_some();
        let filled_in = has_default && !RESULTS.contains(&item.name.as_str());
        for field in &item.fields {
            let place = format!("{file}: {}::{}", item.name, field.name);
            let said = statement(&field.docs);
            if !filled_in {
                found.extend(said.map(|_| format!("{place} says a default, but callers have none")));
                continue;
            }
            let Some(said) = said else {
                found.push(format!("{place} does not end with \"Default: ..\""));
                continue;
            };
            let expected = match &written {
                Some(values) => values.get(&field.name).and_then(|value| stated_value(value, variants)),
                None => derived_value(&field.kind, variants),
            };
            let says = |value: &String| {
                said.strip_prefix(value.as_str())
                    .is_some_and(|more| more.is_empty() || more.starts_with(", "))
            };
            if let Some(value) = expected.filter(|value| !says(value)) {
                found.push(format!("{place} says \"{said}\" in place of \"{value}\""));
            }
        }
    }
    found
}

/// Returns the sources of the documented interface.
fn sources() -> Vec<(String, String)> {
    let mut sources = files("lvk/src", ".rs");
    sources.retain(|(file, _)| !file.starts_with("lvk/src/test_support/"));
    sources
}

#[test]
fn docstrings_of_fields_end_with_the_default() {
    let sources = sources();
    let variants: HashMap<_, _> = sources.iter().flat_map(|(_, text)| default_variants(text)).collect();
    let complaints: Vec<_> =
        sources.iter().flat_map(|(file, text)| complaints(file, text, &variants)).collect();
    assert!(complaints.is_empty(), "{} complaints:\n{}", complaints.len(), complaints.join("\n"));
}

#[test]
fn results_are_structs_with_a_derived_default() {
    let known: Vec<_> = sources().iter().flat_map(|(_, text)| structs(text)).collect();
    for result in RESULTS {
        assert!(known.iter().any(|item| item.name == result && item.derives_default), "{result}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complaints_about(text: &str) -> Vec<String> {
        complaints("a.rs", text, &HashMap::from([("Filter".to_owned(), "Linear".to_owned())]))
    }

    fn derived(field: &str) -> Vec<String> {
        complaints_about(&format!("#[derive(Debug, Default)]\npub struct A {{\n{field}\n}}\n"))
    }

    #[test]
    fn missing_and_wrong_defaults_of_derives_are_refused() {
        assert_eq!(derived("    /// Width. Default: 0.\n    pub a: u32,"), Vec::<String>::new());
        assert_eq!(
            derived("    /// Name. Default: empty, no name.\n    pub a: &'a str,"),
            Vec::<String>::new()
        );
        let filter = "    /// Filter.\n    /// Default: [`Filter::Linear`].\n    #[x]\n    pub a: Filter,";
        assert_eq!(derived(filter), Vec::<String>::new());
        for wrong in [
            "    /// Width.\n    pub a: u32,",
            "    /// Width. Default: 1.\n    pub a: u32,",
            "    /// Width. Default: 0. In pixels.\n    pub a: u32,",
            "    /// Width Default: 0.\n    pub a: u32,",
            "    /// Width. Default: 0\n    pub a: u32,",
            "    /// Width. Default: 0.\n    pub a: Option<u32>,",
            "    pub a: u32,",
        ] {
            assert_eq!(derived(wrong).len(), 1, "{wrong}");
        }
    }

    #[test]
    fn written_values_are_compared() {
        let head = "pub struct A<'a> {\n    /// Side. Default: 2.\n    pub a: f32,\n}\n";
        let with = |value: &str| {
            complaints_about(&format!(
                "{head}\nimpl Default for A<'_> {{\n Self {{ b: [1, 2], a: {value} }}\n}}\n"
            ))
        };
        assert_eq!(with("2.0"), Vec::<String>::new());
        assert_eq!(with("side()"), Vec::<String>::new());
        assert_eq!(with("3.0"), ["a.rs: A::a says \"2\" in place of \"3\""]);
        assert_eq!(complaints_about(head), ["a.rs: A::a says a default, but callers have none"]);
    }

    #[test]
    fn plain_values_have_one_statement() {
        let variants = default_variants("pub enum Filter {\n    Nearest,\n    #[default]\n    Linear,\n}");
        let stated = |value| stated_value(value, &variants);
        for (value, expected) in [
            ("None", "none"),
            ("&[]", "empty"),
            ("16_384", "16,384"),
            ("16 << 20", "16 MiB"),
            ("\"blas\"", "`\"blas\"`"),
            ("Filter::default()", "[`Filter::Linear`]"),
            ("&Yuv::DEFAULT", "[`Yuv::DEFAULT`]"),
            ("u64::MAX", "`u64::MAX`"),
        ] {
            assert_eq!(stated(value).as_deref(), Some(expected));
        }
        assert_eq!(stated("Other::default()"), None);
        assert_eq!(stated("[0.0; 3]"), None);
    }
}
