//! Finds the names that GLSL text declares at global scope, after its conditions and includes.

use std::collections::{BTreeMap, HashMap};

use crate::shader::preamble;

/// A name that GLSL text declares.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Declared {
    /// A function, with its whole head, or an array of descriptors: `vec4 name(uint tex)`, `texture2D name[]`.
    Exactly(String),
    /// A macro with these parameters.
    Function(Vec<String>),
    /// A macro with this replacement.
    Value(String),
    /// A type, a block or a variable.
    Other,
}

/// Returns the names that `text` declares.
pub(super) fn declared_names(text: &str) -> BTreeMap<String, Declared> {
    let mut reader = Reader::default();
    reader.read(text);
    let mut names: BTreeMap<_, _> =
        reader.macros.into_iter().map(|(name, (declared, _))| (name, declared)).collect();
    for declaration in global_declarations(&reader.text) {
        names.extend(declare(&declaration));
    }
    names
}

/// Returns the macros that decide conditions of `text`.
pub(super) fn tested_macros(text: &str) -> impl Iterator<Item = &str> {
    let directives = text.lines().filter(|line| line.starts_with("#if"));
    directives.flat_map(|line| line.split(|c: char| !is_word(c))).filter(|word| word.starts_with("LVK_"))
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// Evaluates directives. `text` collects the code between them.
#[derive(Default)]
struct Reader {
    /// Macros: how they are declared, and their replacement.
    macros: HashMap<String, (Declared, String)>,
    text: String,
    /// For each open condition: true if its current part is read.
    conditions: Vec<bool>,
}

impl Reader {
    fn read(&mut self, text: &str) {
        for line in text.replace("\\\n", " ").lines() {
            let line = line.split("//").next().unwrap_or_default().trim();
            match line.strip_prefix('#') {
                Some(directive) => self.direct(directive.trim()),
                None if self.is_read() => {
                    self.text.push_str(line);
                    self.text.push('\n');
                }
                None => {}
            }
        }
    }

    fn is_read(&self) -> bool {
        self.conditions.iter().all(|holds| *holds)
    }

    fn direct(&mut self, directive: &str) {
        let (word, rest) = directive.split_once(char::is_whitespace).unwrap_or((directive, ""));
        match word {
            "ifdef" => self.conditions.push(self.macros.contains_key(rest.trim())),
            "ifndef" => self.conditions.push(!self.macros.contains_key(rest.trim())),
            "if" => self.conditions.push(self.holds(rest)),
            "else" => {
                let last = self.conditions.last_mut().expect("an #else has its #if");
                *last = !*last;
            }
            "endif" => _ = self.conditions.pop().expect("an #endif has its #if"),
            _ if !self.is_read() => {}
            "define" => self.define(rest),
            "include" => self.include(rest),
            "version" | "extension" | "line" => {}
            other => panic!("unknown directive #{other}"),
        }
    }

    /// Evaluates `defined(A) || defined(B) && defined(C)`.
    fn holds(&self, condition: &str) -> bool {
        let is_defined = |term: &str| {
            let name = term.trim().strip_prefix("defined(").and_then(|rest| rest.strip_suffix(')'));
            self.macros.contains_key(name.unwrap_or_else(|| panic!("not understood: {condition}")))
        };
        condition.split("||").any(|all| all.split("&&").all(is_defined))
    }

    fn define(&mut self, rest: &str) {
        let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
        let (name, rest) = rest.split_at(end);
        let declared = match rest.strip_prefix('(').and_then(|rest| rest.split_once(')')) {
            Some((parameters, _)) => Declared::Function(split_list(parameters)),
            None => Declared::Value(rest.trim().to_owned()),
        };
        self.macros.insert(name.to_owned(), (declared, rest.trim().to_owned()));
    }

    fn include(&mut self, name: &str) {
        let name = name.trim_matches(['<', '>', '"']);
        let file = preamble::library().find(|(known, _)| *known == name);
        let (_, text) = file.unwrap_or_else(|| panic!("no file {name}"));
        self.read(text);
    }
}

/// Splits at commas.
pub(super) fn split_list(text: &str) -> Vec<String> {
    text.split(',').map(|part| part.trim().to_owned()).filter(|part| !part.is_empty()).collect()
}

/// Returns the declarations at global scope, without the bodies of functions.
fn global_declarations(text: &str) -> Vec<String> {
    let (mut found, mut current, mut depth) = (Vec::new(), String::new(), 0_u32);
    for c in text.chars() {
        match c {
            '{' => {
                depth += 1;
                if depth == 1 {
                    current.push('{');
                }
            }
            '}' => {
                depth -= 1;
                // A function ends here. The name of a block or the semicolon of a struct follows.
                if depth == 0 && current.trim_end_matches('{').trim_end().ends_with(')') {
                    found.push(std::mem::take(&mut current));
                }
            }
            ';' if depth == 0 => found.push(std::mem::take(&mut current)),
            _ if depth == 0 => current.push(c),
            _ => {}
        }
    }
    found.into_iter().map(|text| text.split_whitespace().collect::<Vec<_>>().join(" ")).collect()
}

/// Returns the names of a declaration: of a block, its type and its instance.
fn declare(declaration: &str) -> Vec<(String, Declared)> {
    let plain = without_layout(declaration);
    if let Some((head, tail)) = plain.split_once('{') {
        let head = head.trim();
        if head.ends_with(')') {
            return vec![(name_before(head, '('), Declared::Exactly(head.to_owned()))];
        }
        let instance = tail.trim_matches(|c| !is_word(c));
        let names = [head.rsplit(' ').next().unwrap_or_default(), instance];
        return names
            .into_iter()
            .filter(|name| !name.is_empty())
            .map(|n| (n.to_owned(), Declared::Other))
            .collect();
    }
    let qualifiers = ["uniform", "writeonly", "LVK_IMAGE_ACCESS", "const", "shared", "precise"];
    let words: Vec<_> = plain.split(' ').filter(|word| !qualifiers.contains(word)).collect();
    let [ty, name, ..] = words.as_slice() else { return Vec::new() };
    let is_descriptor = plain.starts_with("uniform ");
    let declared = if is_descriptor { Declared::Exactly(format!("{ty} {name}")) } else { Declared::Other };
    vec![(name_before(name, '['), declared)]
}

fn without_layout(declaration: &str) -> &str {
    let Some(rest) = declaration.strip_prefix("layout(") else { return declaration };
    rest.split_once(')').map_or("", |(_, rest)| rest.trim())
}

/// Returns the word before the first `end`.
fn name_before(text: &str, end: char) -> String {
    let before = text.split(end).next().unwrap_or_default();
    before.rsplit(' ').next().unwrap_or_default().to_owned()
}

#[test]
fn declarations_of_every_kind_are_listed() {
    let text = "
        #define TWO(a, \\
            b) a + b
        #define ONE 1u
        #ifdef ONE
        layout(set = 0, binding = 1) uniform texture2D textures[]; // a comment; int no;
        #else
        uint hidden;
        #endif
        #if defined(NO) || defined(ONE) && defined(TWO)
        layout(buffer_reference, scalar) readonly buffer Words { uint at[]; };
        layout(set = 0, binding = 5) readonly buffer Table { uint at[]; } table;
        #endif
        struct Pair { uint a; uint b; };
        vec4 sum(uint a,
                 vec2 b) { if (a > 0u) { return vec4(1); } return vec4(0); }
        const bool flag = true;
        uvec2 stack[4];";
    let names = declared_names(text);
    let exactly = |text: &str| Some(Declared::Exactly(text.to_owned()));
    let strings = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    assert_eq!(
        names.keys().cloned().collect::<Vec<_>>(),
        ["ONE", "Pair", "TWO", "Table", "Words", "flag", "stack", "sum", "table", "textures"]
    );
    assert_eq!(names.get("textures").cloned(), exactly("texture2D textures[]"));
    assert_eq!(names.get("sum").cloned(), exactly("vec4 sum(uint a, vec2 b)"));
    assert_eq!(names["ONE"], Declared::Value("1u".to_owned()));
    assert_eq!(names["TWO"], Declared::Function(strings(&["a", "b"])));
}
