//! Rust source as words and marks, without comments, and without code that only tests compile.

/// One token, with the line that it begins in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Token<'a> {
    pub text: &'a str,
    pub line: usize,
    pub kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// An identifier or a keyword.
    Word,
    /// `::`, or one character.
    Mark,
    /// A number, a string with its quotes, a character or a lifetime.
    Literal,
}

impl Token<'_> {
    pub fn is_mark(&self, mark: &str) -> bool {
        self.kind == Kind::Mark && self.text == mark
    }

    pub fn is_word(&self, word: &str) -> bool {
        self.kind == Kind::Word && self.text == word
    }
}

/// Splits source text into tokens.
pub fn tokens(text: &str) -> Vec<Token<'_>> {
    let (mut found, mut rest, mut line) = (Vec::new(), text, 1);
    while !rest.is_empty() {
        let (length, kind) = token_length(rest);
        let (token, after) = rest.split_at(length);
        found.extend(kind.map(|kind| Token { text: token, line, kind }));
        line += token.matches('\n').count();
        rest = after;
    }
    found
}

/// Returns the length of what `rest` begins with, and its kind; `None` for spaces and comments.
fn token_length(rest: &str) -> (usize, Option<Kind>) {
    let first = rest.chars().next().unwrap_or(' ');
    if first.is_whitespace() {
        return (rest.len() - rest.trim_start().len(), None);
    }
    if rest.starts_with("//") {
        return (rest.find('\n').unwrap_or(rest.len()), None);
    }
    if rest.starts_with("/*") {
        return (block_comment_length(rest), None);
    }
    if let Some(length) = string_length(rest).or_else(|| quote_length(rest)) {
        return (length, Some(Kind::Literal));
    }
    let length_while = |is_part: fn(char) -> bool| rest.find(|c| !is_part(c)).unwrap_or(rest.len());
    if first.is_ascii_digit() {
        return (number_length(rest), Some(Kind::Literal));
    }
    if first.is_alphabetic() || first == '_' {
        return (length_while(|c| c.is_alphanumeric() || c == '_'), Some(Kind::Word));
    }
    (if rest.starts_with("::") { 2 } else { first.len_utf8() }, Some(Kind::Mark))
}

fn block_comment_length(rest: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < rest.len() {
        let step = &rest.as_bytes()[at..];
        match step {
            [b'/', b'*', ..] => (depth, at) = (depth + 1, at + 2),
            [b'*', b'/', ..] => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
        if depth == 0 {
            return at;
        }
    }
    rest.len()
}

/// Returns the length of a string literal of any kind at the beginning of `rest`.
fn string_length(rest: &str) -> Option<usize> {
    let prefix = rest.find(|c: char| !c.is_ascii_lowercase())?;
    let after_prefix = &rest[prefix..];
    match &rest[..prefix] {
        "" | "b" | "c" => {
            let inside = after_prefix.strip_prefix('"')?;
            let mut is_escaped = false;
            let end = inside.bytes().position(|byte| {
                let ends = byte == b'"' && !is_escaped;
                is_escaped = byte == b'\\' && !is_escaped;
                ends
            });
            Some(end.map_or(rest.len(), |end| prefix + 1 + end + 1))
        }
        "r" | "br" | "cr" => {
            let hashes = after_prefix.len() - after_prefix.trim_start_matches('#').len();
            let inside = after_prefix[hashes..].strip_prefix('"')?;
            let closing = format!("\"{}", "#".repeat(hashes));
            let end = inside.find(&closing);
            Some(end.map_or(rest.len(), |end| prefix + hashes + 1 + end + closing.len()))
        }
        _ => None,
    }
}

/// Returns the length of a character or a lifetime at the beginning of `rest`.
fn quote_length(rest: &str) -> Option<usize> {
    let prefix = usize::from(rest.starts_with("b'"));
    let inside = rest[prefix..].strip_prefix('\'')?;
    let mut chars = inside.chars();
    let first = chars.next()?;
    if first == '\\' {
        return Some(prefix + 1 + 2 + inside[2..].find('\'')? + 1);
    }
    if chars.next() == Some('\'') {
        return Some(prefix + 1 + first.len_utf8() + 1);
    }
    Some(1 + inside.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(inside.len()))
}

/// A range such as `0..4` is two numbers.
fn number_length(rest: &str) -> usize {
    let bytes = rest.as_bytes();
    let is_part = |at: usize| {
        let is_digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
        bytes[at].is_ascii_alphanumeric() || bytes[at] == b'_' || (bytes[at] == b'.' && is_digit(at + 1))
    };
    (0..bytes.len()).find(|&at| !is_part(at)).unwrap_or(bytes.len())
}

/// Returns the tokens without the items that only builds of tests contain, by the features `test` and `test-hooks`.
pub fn without_tests<'a>(tokens: &[Token<'a>]) -> Vec<Token<'a>> {
    let (mut kept, mut at) = (Vec::new(), 0);
    while at < tokens.len() {
        let attribute =
            attribute_start(&tokens[at..]).map(|inside| (at + inside, group_end(tokens, at + inside - 1)));
        let Some((inside, end)) = attribute else {
            kept.push(tokens[at]);
            at += 1;
            continue;
        };
        if !is_test_cfg(&tokens[inside..end - 1]) {
            kept.extend_from_slice(&tokens[at..end]);
            at = end;
        } else if tokens[at + 1].is_mark("!") {
            break;
        } else {
            at = item_end(tokens, end);
        }
    }
    kept
}

/// Returns where the content of an attribute begins, if `tokens` begin with one.
fn attribute_start(tokens: &[Token<'_>]) -> Option<usize> {
    match tokens {
        [hash, bracket, ..] if hash.is_mark("#") && bracket.is_mark("[") => Some(2),
        [hash, not, bracket, ..] if hash.is_mark("#") && not.is_mark("!") && bracket.is_mark("[") => Some(3),
        _ => None,
    }
}

/// True for `cfg(...)` with a predicate that only holds in builds of tests.
fn is_test_cfg(attribute: &[Token<'_>]) -> bool {
    matches!(attribute, [cfg, open, predicate @ .., _close]
        if cfg.is_word("cfg") && open.is_mark("(") && holds(predicate) == Some(false))
}

/// Returns what a predicate of `cfg` is in builds without tests; `None` where that depends on other features.
fn holds(predicate: &[Token<'_>]) -> Option<bool> {
    let (first, rest) = predicate.split_first()?;
    let parts = || split_at_commas(&rest[1..rest.len() - 1]).into_iter().map(holds);
    match first.text {
        "test" => Some(false),
        "feature" => (rest.get(1)?.text == "\"test-hooks\"").then_some(false),
        "not" => parts().next()?.map(|inside| !inside),
        "all" if parts().any(|part| part == Some(false)) => Some(false),
        "any" if parts().all(|part| part == Some(false)) => Some(false),
        _ => None,
    }
}

fn split_at_commas<'t, 'a>(tokens: &'t [Token<'a>]) -> Vec<&'t [Token<'a>]> {
    let mut depth = 0;
    let parts = tokens.split(|token| {
        depth += i32::from(token.is_mark("(")) - i32::from(token.is_mark(")"));
        depth == 0 && token.is_mark(",")
    });
    parts.filter(|part| !part.is_empty()).collect()
}

/// Returns the position behind the bracket that closes the one at `open`.
pub fn group_end(tokens: &[Token<'_>], open: usize) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate().skip(open) {
        depth += nesting(token);
        if depth == 0 {
            return at + 1;
        }
    }
    tokens.len()
}

/// Returns 1 for an opening bracket, -1 for a closing one.
pub fn nesting(token: &Token<'_>) -> i32 {
    match token.text {
        "(" | "[" | "{" if token.kind == Kind::Mark => 1,
        ")" | "]" | "}" if token.kind == Kind::Mark => -1,
        _ => 0,
    }
}

/// Returns the position behind the item, field, statement or match arm that begins at `start`.
fn item_end(tokens: &[Token<'_>], start: usize) -> usize {
    let mut first = start;
    while let Some(inside) = tokens.get(first..).and_then(attribute_start) {
        first = group_end(tokens, first + inside - 1);
    }
    let mut ends_at_brace = is_braced(&tokens[first..]);
    let is_list_element = !ends_at_brace;
    let (mut depth, mut angles) = (0, 0);
    for at in first..tokens.len() {
        let token = &tokens[at];
        let is_arrow = at > first && (tokens[at - 1].is_mark("=") || tokens[at - 1].is_mark("-"));
        ends_at_brace |=
            token.is_mark("{") && depth == 0 && at > first && tokens[at - 1].is_mark(">") && is_list_element;
        depth += nesting(token);
        angles += i32::from(token.is_mark("<")) - i32::from(token.is_mark(">") && !is_arrow);
        let is_over = token.is_mark(";")
            || (token.is_mark("}") && ends_at_brace)
            || (token.is_mark(",") && is_list_element && angles <= 0);
        if depth < 0 {
            return at;
        }
        if depth == 0 && is_over {
            return at + 1;
        }
    }
    tokens.len()
}

/// True for what ends with its block: functions, types with fields, modules and control flow.
fn is_braced(item: &[Token<'_>]) -> bool {
    let mut words = item;
    if words.first().is_some_and(|token| token.is_word("pub")) {
        let skipped =
            if words.get(1).is_some_and(|token| token.is_mark("(")) { group_end(words, 1) } else { 1 };
        words = &words[skipped..];
    }
    let text = |at: usize| words.get(at).map_or("", |token| token.text);
    match text(0) {
        "const" => ["fn", "unsafe", "async", "extern"].contains(&text(1)),
        "fn" | "impl" | "struct" | "enum" | "union" | "mod" | "trait" | "unsafe" | "extern" | "async" => true,
        "macro_rules" | "if" | "match" | "for" | "while" | "loop" | "{" => true,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(source: &str) -> Vec<&str> {
        tokens(source).into_iter().map(|token| token.text).collect()
    }

    fn kept(source: &str) -> String {
        without_tests(&tokens(source)).iter().map(|token| token.text).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn comments_and_strings_hold_no_words() {
        let source = "// use crate::a;\n/* b /* c */ d */ x r#\"\" crate::e \"#; 'f' '\\'' b'g' &'h i \"\\\"j\" 1.5 0..2";
        let words: Vec<_> = tokens(source).into_iter().filter(|token| token.kind == Kind::Word).collect();
        assert_eq!(words.iter().map(|token| token.text).collect::<Vec<_>>(), ["x", "i"]);
        assert_eq!(words[0].line, 2);
        assert_eq!(texts("a::b 1.5 0..2"), ["a", "::", "b", "1.5", "0", ".", ".", "2"]);
    }

    #[test]
    fn code_for_tests_alone_is_left_out() {
        assert_eq!(kept("#[cfg(test)] mod tests { fn a() {} } b"), "b");
        assert_eq!(kept("#[cfg(all(test, feature = \"x\"))] use a::{b, c}; d"), "d");
        assert_eq!(
            kept("#[cfg(any(test, feature = \"test-hooks\"))] #[doc(hidden)] pub fn a<B, C>() { d } e"),
            "e"
        );
        assert_eq!(kept("{ a: A, #[cfg(test)] pub(crate) b: B<C, D>, e: E }"), "{ a : A , e : E }");
        assert_eq!(kept("{ a(); #[cfg(test)] b(c, { d }); e }"), "{ a ( ) ; e }");
        assert_eq!(kept("{ #[cfg(test)] A => { b } C => d }"), "{ C = > d }");
        assert_eq!(kept("f(a, #[cfg(test)] b) c"), "f ( a , ) c");
        assert_eq!(kept("#![cfg(test)] a"), "");
    }

    #[test]
    fn other_conditions_are_kept() {
        for source in [
            "#[cfg(not(test))] a",
            "#[cfg(feature = \"glsl\")] a",
            "#[cfg(any(test, unix))] a",
            "#[inline] a",
        ] {
            assert!(kept(source).ends_with(" a"), "{source}");
        }
    }
}
