//! A reader for the little JSON that driver manifests consist of. A crate for it would be the library's largest dependency.

/// Deepest nesting that is read.
const MAX_DEPTH: usize = 32;

/// A JSON value, reduced to objects and strings.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Json {
    /// An object: names and values in order.
    Object(Vec<(String, Json)>),
    /// A string.
    Text(String),
    /// An array, a number, or a word.
    Other,
}

impl Json {
    /// Parses the first value of `text`. What follows it is ignored, as the Vulkan loader does.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let mut reader = Reader { text: text.strip_prefix('\u{feff}').unwrap_or(text), at: 0 };
        reader.value(0).map_err(|problem| {
            let read = reader.text.get(..reader.at).unwrap_or(reader.text);
            format!("line {}: {problem}", read.matches('\n').count() + 1)
        })
    }

    /// Returns the value of this name, if this is an object that has it.
    pub(super) fn get(&self, name: &str) -> Option<&Self> {
        match self {
            Self::Object(members) => members.iter().find(|(key, _)| key == name).map(|(_, value)| value),
            _ => None,
        }
    }

    /// Returns the text, if this is a string.
    pub(super) fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }
}

/// A position in the text.
struct Reader<'a> {
    text: &'a str,
    at: usize,
}

impl Reader<'_> {
    fn value(&mut self, depth: usize) -> Result<Json, &'static str> {
        if depth > MAX_DEPTH {
            return Err("the values are nested too deeply");
        }
        match self.peek() {
            Some('{') => self.object(depth),
            Some('[') => self.array(depth),
            Some('"') => self.string().map(Json::Text),
            Some(other) if other.is_ascii_alphanumeric() || other == '-' => {
                while self.rest().starts_with(|c: char| c.is_ascii_alphanumeric() || "+-.".contains(c)) {
                    self.at += 1;
                }
                Ok(Json::Other)
            }
            _ => Err("a JSON value is expected"),
        }
    }

    fn object(&mut self, depth: usize) -> Result<Json, &'static str> {
        let mut members = Vec::new();
        self.list('}', |reader| {
            if reader.peek() != Some('"') {
                return Err("a name in quotes is expected");
            }
            let name = reader.string()?;
            reader.expect(':', "a colon is expected")?;
            members.push((name, reader.value(depth + 1)?));
            Ok(())
        })?;
        Ok(Json::Object(members))
    }

    fn array(&mut self, depth: usize) -> Result<Json, &'static str> {
        self.list(']', |reader| reader.value(depth + 1).map(drop))?;
        Ok(Json::Other)
    }

    /// Reads items between commas, from the opening bracket to `end`.
    fn list(
        &mut self,
        end: char,
        mut item: impl FnMut(&mut Self) -> Result<(), &'static str>,
    ) -> Result<(), &'static str> {
        self.at += 1;
        if self.peek() == Some(end) {
            self.at += 1;
            return Ok(());
        }
        loop {
            item(self)?;
            match self.peek() {
                Some(',') => self.at += 1,
                Some(found) if found == end => break,
                _ => return Err("a comma or a closing bracket is expected"),
            }
        }
        self.at += 1;
        Ok(())
    }

    fn string(&mut self) -> Result<String, &'static str> {
        const OPEN: &str = "a string has no end";
        let mut text = String::new();
        self.at += 1;
        loop {
            match self.next().ok_or(OPEN)? {
                '"' => return Ok(text),
                '\\' => text.push(self.escape()?),
                '\n' => return Err(OPEN),
                other => text.push(other),
            }
        }
    }

    /// Reads an escape behind its backslash. Halves of surrogate pairs become replacement characters.
    fn escape(&mut self) -> Result<char, &'static str> {
        const UNKNOWN: &str = "a string has an unknown escape";
        Ok(match self.next().ok_or(UNKNOWN)? {
            'n' => '\n',
            't' => '\t',
            'r' => '\r',
            'b' => '\u{8}',
            'f' => '\u{c}',
            same @ ('"' | '\\' | '/') => same,
            'u' => {
                let digits = self.rest().get(..4).ok_or(UNKNOWN)?;
                let code = u32::from_str_radix(digits, 16).map_err(|_| UNKNOWN)?;
                self.at += 4;
                char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER)
            }
            _ => return Err(UNKNOWN),
        })
    }

    fn expect(&mut self, wanted: char, problem: &'static str) -> Result<(), &'static str> {
        let found = self.peek() == Some(wanted);
        self.at += usize::from(found);
        found.then_some(()).ok_or(problem)
    }

    /// Skips white space and returns the character behind it.
    fn peek(&mut self) -> Option<char> {
        let rest = self.rest();
        let spaces = rest.len() - rest.trim_start_matches([' ', '\t', '\r', '\n']).len();
        self.at += spaces;
        self.rest().chars().next()
    }

    fn next(&mut self) -> Option<char> {
        let next = self.rest().chars().next()?;
        self.at += next.len_utf8();
        Some(next)
    }

    fn rest(&self) -> &str {
        self.text.get(self.at..).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const MANIFEST: &str = r#"{ "file_format_version": "1.0.1", "list": [1, -2.5e3, true, {"a": null}],
        "ICD": { "library_path": "..\/lib\u002fa \"b\".so", "api_version": "1.4.305" }, "empty": {}, "none": [] }"#;

    #[test]
    fn strings_of_nested_objects_are_read() {
        let json = Json::parse(MANIFEST).unwrap();
        let icd = json.get("ICD").unwrap();
        assert_eq!(icd.get("library_path").unwrap().text(), Some("../lib/a \"b\".so"));
        assert_eq!(icd.get("api_version").unwrap().text(), Some("1.4.305"));
        assert_eq!(json.get("list"), Some(&Json::Other));
        assert_eq!(json.get("absent"), None);
        assert_eq!(Json::parse("\u{feff}\"x\" and more").unwrap().text(), Some("x"));
    }

    #[test]
    fn broken_text_is_refused_with_its_line() {
        for (text, problem) in [
            ("", "line 1: a JSON value is expected"),
            ("{\n\n'a': 1}", "line 3: a name in quotes is expected"),
            ("{\"a\"\n 1}", "line 2: a colon is expected"),
            ("{\"a\": 1", "line 1: a comma or a closing bracket is expected"),
            ("{\"a", "line 1: a string has no end"),
            (r#""\x""#, "line 1: a string has an unknown escape"),
            (r#""\u12""#, "line 1: a string has an unknown escape"),
        ] {
            assert_eq!(Json::parse(text), Err(problem.to_owned()), "{text}");
        }
        assert!(Json::parse(&"[".repeat(100_000)).unwrap_err().contains("too deeply"));
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "\\PC*", pieces in "[{}\\[\\]\":,\\\\u0-9a \n\u{e4}]{0,40}") {
            let _ = (Json::parse(&text), Json::parse(&pieces));
        }

        #[test]
        fn damaged_manifests_are_read_or_refused(at in 0..MANIFEST.len(), with in any::<char>(), cut in 0..MANIFEST.len()) {
            let mut text: String = MANIFEST.chars().take(cut).collect();
            let _ = Json::parse(&text);
            text.insert(at.min(text.len()), with);
            let _ = Json::parse(&text);
        }

        #[test]
        fn every_string_is_read_as_written(text in "[^\u{0}-\u{1f}]*") {
            let quoted = format!("{{\"k\": \"{}\"}}", text.replace('\\', r"\\").replace('"', "\\\""));
            let json = Json::parse(&quoted).unwrap();
            prop_assert_eq!(json.get("k").and_then(Json::text), Some(text.as_str()));
        }
    }
}
