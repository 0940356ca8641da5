//! A writer of small glTF files.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::ops::ControlFlow;

use lvk_gltf::{LoadOptions, MemoryLimit, Model, Primitive, Problem, Progress, Warning};
use serde_json::{Value, json};

pub const BYTE: u32 = 5120;
pub const UNSIGNED_BYTE: u32 = 5121;
pub const SHORT: u32 = 5122;
pub const UNSIGNED_SHORT: u32 = 5123;
pub const UNSIGNED_INT: u32 = 5125;
pub const FLOAT: u32 = 5126;

/// A file in the making: its JSON, and one buffer.
#[derive(Debug, Clone)]
pub struct Glb {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl Glb {
    pub fn new() -> Self {
        Self { json: json!({ "asset": { "version": "2.0" } }), bin: Vec::new() }
    }

    /// Returns a file with one mesh of one primitive, a node and a scene.
    pub fn with_primitive(primitive: impl FnOnce(&mut Self) -> Value) -> Self {
        let mut glb = Self::new();
        let primitive = primitive(&mut glb);
        glb.push("meshes", json!({ "name": "Body", "primitives": [primitive] }));
        glb.push("nodes", json!({ "mesh": 0 }));
        glb.push("scenes", json!({ "nodes": [0] }));
        glb
    }

    /// Returns a file with a triangle.
    pub fn triangle() -> Self {
        Self::with_primitive(|glb| json!({ "attributes": { "POSITION": glb.triangle_positions() } }))
    }

    /// Adds an object to a list of the file, and returns its index.
    pub fn push(&mut self, list: &str, object: Value) -> usize {
        let lists = self.json.as_object_mut().unwrap();
        let list = lists.entry(list).or_insert_with(|| json!([])).as_array_mut().unwrap();
        list.push(object);
        list.len() - 1
    }

    /// Marks an extension as used.
    pub fn uses(&mut self, extension: &str) -> &mut Self {
        self.push("extensionsUsed", json!(extension));
        self
    }

    /// Adds a buffer view with these bytes.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let start = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() }))
    }

    /// Adds an accessor of `count` elements with these bytes.
    pub fn accessor(&mut self, bytes: &[u8], component: u32, shape: &str, count: usize) -> usize {
        let view = self.view(bytes);
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": component, "type": shape, "count": count }),
        )
    }

    /// Adds an accessor of floats.
    pub fn floats<const N: usize>(&mut self, elements: &[[f32; N]]) -> usize {
        let shape = ["", "SCALAR", "VEC2", "VEC3", "VEC4"].get(N).copied().unwrap_or("MAT4");
        self.accessor(bytemuck::cast_slice(elements.as_flattened()), FLOAT, shape, elements.len())
    }

    /// Adds an accessor of 16-bit indices.
    pub fn indices(&mut self, indices: &[u16]) -> usize {
        self.accessor(bytemuck::cast_slice(indices), UNSIGNED_SHORT, "SCALAR", indices.len())
    }

    pub fn triangle_positions(&mut self) -> usize {
        self.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    }

    /// Returns a property of the JSON, to change it.
    pub fn at(&mut self, pointer: &str) -> &mut Value {
        self.json.pointer_mut(pointer).unwrap_or_else(|| panic!("no {pointer}"))
    }

    /// Returns the JSON with its buffer described.
    fn whole_json(&self) -> Value {
        let mut json = self.json.clone();
        if !self.bin.is_empty() && json.get("buffers").is_none() {
            json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        }
        json
    }

    /// Returns the bytes of a `.glb`.
    pub fn to_glb(&self) -> Vec<u8> {
        let mut json = self.whole_json().to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let length = 12 + 8 + json.len() + if bin.is_empty() { 0 } else { 8 + bin.len() };
        let mut bytes = b"glTF\x02\0\0\0".to_vec();
        bytes.extend((length as u32).to_le_bytes());
        for (kind, chunk) in
            [(b"JSON", &json), (b"BIN\0", &bin)].into_iter().filter(|(_, chunk)| !chunk.is_empty())
        {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
        bytes
    }

    /// Returns the text of a `.gltf` whose buffer has this URI.
    pub fn to_gltf(&self, uri: &str) -> String {
        let mut json = self.whole_json();
        json["buffers"][0]["uri"] = json!(uri);
        json.to_string()
    }

    pub fn load(&self) -> Model {
        load(&self.to_glb()).unwrap_or_else(|problem| panic!("{problem}"))
    }

    /// Loads a model that gives no warnings.
    pub fn load_cleanly(&self) -> Model {
        let model = self.load();
        assert_eq!(model.warnings, []);
        model
    }

    /// Returns the first primitive of a model that gives no warnings.
    pub fn primitive(&self) -> Primitive {
        self.load_cleanly().meshes.remove(0).primitives.remove(0)
    }

    pub fn problem(&self) -> Problem {
        match load(&self.to_glb()) {
            Ok(_) => panic!("the file is loaded"),
            Err(problem) => problem,
        }
    }

    /// Asserts that the message has these parts.
    pub fn expect_problem(&self, parts: &[&str]) -> Problem {
        let problem = self.problem();
        let message = problem.to_string();
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
        problem
    }

    /// Returns the warnings as text.
    pub fn warnings(&self) -> Vec<String> {
        self.load().warnings.iter().map(Warning::to_string).collect()
    }
}

/// Loads bytes within 64 MiB and 64 bytes for each byte.
pub fn load(bytes: &[u8]) -> Result<Model, Problem> {
    let go_on = |_: Progress| ControlFlow::Continue(());
    let memory = MemoryLimit { fixed_bytes: 64 << 20, multiple: 64 };
    let options = LoadOptions { memory, on_progress: Some(&go_on), ..LoadOptions::default() };
    Model::from_bytes(bytes, None, &options).map_err(|error| error.problem)
}

/// Asserts that two lists of numbers differ by at most `tolerance`.
pub fn assert_close(found: &[f32], wanted: &[f64], tolerance: f64) {
    assert_eq!(found.len(), wanted.len(), "{found:?} {wanted:?}");
    for (found_number, wanted_number) in found.iter().zip(wanted) {
        let difference = (f64::from(*found_number) - wanted_number).abs();
        assert!(difference <= tolerance, "{found:?} is not {wanted:?}");
    }
}
