//! Reads the manual's page `shader_interface`.

use super::glsl_names::{Declared, split_list};
use crate::shader::ShaderStage;

/// A part of a page between `generated` marks.
const BLOCK_START: &str = "<!-- generated: ";
const BLOCK_END: &str = "<!-- end -->";

/// A row of a table with the head `GLSL`.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    /// The declaration as it stands in the page.
    pub(super) text: String,
    pub(super) name: String,
    pub(super) places: Vec<Place>,
}

/// Modules in which a name exists: an alternative of a `Where:` line.
#[derive(Debug, Clone, Default)]
pub(super) struct Place {
    /// `None` in every stage.
    stages: Option<Vec<ShaderStage>>,
    file: Option<String>,
    condition: Option<String>,
}

/// A module's stage, device and include.
#[derive(Debug, Clone, Copy)]
pub(super) struct Module {
    pub(super) stage: ShaderStage,
    pub(super) software: bool,
    pub(super) position_fetch: bool,
    pub(super) formatless: bool,
    pub(super) file: Option<&'static str>,
}

impl Place {
    fn parse(text: &str) -> Self {
        let mut place = Self::default();
        for part in text.split(", ").map(str::trim) {
            if let Some(condition) = part.strip_prefix("if ") {
                place.condition = Some(condition.to_owned());
            } else if let Some(file) = part.strip_prefix("`<").and_then(|part| part.strip_suffix(">`")) {
                place.file = Some(file.to_owned());
            } else if part == "ray tracing stages" {
                place.add(ShaderStage::ALL.into_iter().filter(|stage| stage.is_ray_tracing()));
            } else if part != "every stage" {
                let stage = ShaderStage::ALL.into_iter().find(|stage| stage.name() == part);
                place.add([stage.unwrap_or_else(|| panic!("no place: {part}"))].into_iter());
            }
        }
        place
    }

    fn add(&mut self, stages: impl Iterator<Item = ShaderStage>) {
        self.stages.get_or_insert_default().extend(stages);
    }

    fn covers(&self, module: &Module) -> bool {
        let condition = match self.condition.as_deref() {
            None => true,
            Some("software") => module.software,
            Some("hardware") => !module.software,
            Some("position fetch") => module.position_fetch,
            Some("formatless") => module.formatless,
            Some(other) => panic!("no condition: {other}"),
        };
        let stage = self.stages.as_ref().is_none_or(|stages| stages.contains(&module.stage));
        condition && stage && self.file.as_deref().is_none_or(|file| module.file == Some(file))
    }
}

impl Entry {
    fn parse(text: &str, places: &[Place]) -> Self {
        let head = text.split(['(', '=', '[']).next().unwrap_or_default().trim();
        let name = head.rsplit(' ').next().unwrap_or_default().to_owned();
        Self { text: text.to_owned(), name, places: places.to_vec() }
    }

    /// True if the name exists in `module`.
    pub(super) fn is_in(&self, module: &Module) -> bool {
        self.places.iter().any(|place| place.covers(module))
    }

    /// Returns the parameters, of a function or of a macro.
    pub(super) fn parameters(&self) -> Option<Vec<String>> {
        let (_, rest) = self.text.split_once('(')?;
        Some(split_list(rest.strip_suffix(')')?))
    }

    /// Returns the type of the result, if the page declares one.
    pub(super) fn result(&self) -> Option<&str> {
        let head = self.text.split('(').next()?;
        head.strip_suffix(self.name.as_str()).map(str::trim).filter(|ty| !ty.is_empty())
    }

    /// True if the page declares what GLSL does.
    pub(super) fn agrees(&self, declared: &Declared) -> bool {
        match declared {
            Declared::Exactly(text) => *text == self.text,
            Declared::Function(names) => {
                let parameters = self.parameters().unwrap_or_default();
                parameters.iter().map(|text| parameter_name(text)).eq(names.iter().map(String::as_str))
            }
            Declared::Value(value) => {
                self.text == self.name || self.text == format!("{} = {value}", self.name)
            }
            Declared::Other => self.text == self.name,
        }
    }
}

/// Returns the name of a parameter: of `out vec3 positions[3]`, `positions`.
pub(super) fn parameter_name(parameter: &str) -> &str {
    let last = parameter.rsplit(' ').next().unwrap_or_default();
    last.split('[').next().unwrap_or_default()
}

/// Returns the rows of the tables with the head `GLSL`.
pub(super) fn entries(page: &str) -> Vec<Entry> {
    let (mut found, mut places, mut is_table) = (Vec::new(), Vec::new(), false);
    for line in page.lines() {
        if let Some(text) = line.strip_prefix("Where: ") {
            places = text.split("; ").map(Place::parse).collect();
        }
        if !line.starts_with('|') {
            is_table = false;
        } else if line.starts_with("| GLSL |") {
            is_table = true;
        } else if is_table && let Some(text) = first_cell(line) {
            found.push(Entry::parse(text, &places));
        }
    }
    found
}

/// Returns the names in the table with this head.
pub(super) fn column<'a>(page: &'a str, head: &str) -> Vec<&'a str> {
    let rows = page.lines().skip_while(|line| !line.starts_with(head)).skip(2);
    rows.map_while(first_cell).collect()
}

fn first_cell(line: &str) -> Option<&str> {
    line.strip_prefix("| `")?.split_once("` |").map(|(text, _)| text)
}

/// Returns the page with the generated blocks of these names and texts.
pub(super) fn with_blocks(page: &str, blocks: &[(&str, String)]) -> String {
    let mut page = page.to_owned();
    for (name, text) in blocks {
        let start = format!("{BLOCK_START}{name} -->\n");
        let (before, rest) = page.split_once(&start).unwrap_or_else(|| panic!("no block {name}"));
        let (_, after) = rest.split_once(BLOCK_END).unwrap_or_else(|| panic!("block {name} has no end"));
        page = format!("{before}{start}{text}{BLOCK_END}{after}");
    }
    page
}
