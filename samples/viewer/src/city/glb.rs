//! Puts together a `.glb` file: its JSON, and one buffer.

use glam::Vec3;
use serde_json::{Map, Value, json};

/// Component types of accessors.
pub(super) const BYTE: u32 = 5120;
pub(super) const SHORT: u32 = 5122;
pub(super) const UNSIGNED_SHORT: u32 = 5123;
pub(super) const UNSIGNED_INT: u32 = 5125;
pub(super) const FLOAT: u32 = 5126;

/// A file in the making.
#[derive(Debug, Default)]
pub(super) struct Glb {
    json: Map<String, Value>,
    bin: Vec<u8>,
}

/// Elements of an accessor.
pub(super) struct Elements<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) component: u32,
    pub(super) shape: &'static str,
    pub(super) count: usize,
    pub(super) is_normalized: bool,
    /// Bytes from one element to the next, if others are between them.
    pub(super) stride: Option<usize>,
    /// Least and greatest components, which positions need.
    pub(super) range: Option<[Vec3; 2]>,
}

impl Glb {
    /// Sets a property of the file.
    pub(super) fn set(&mut self, name: &str, value: Value) {
        self.json.insert(name.into(), value);
    }

    /// Adds an object to a list of the file, and returns its index.
    pub(super) fn push(&mut self, list: &str, object: Value) -> usize {
        match self.json.get_mut(list) {
            Some(Value::Array(list)) => {
                list.push(object);
                list.len() - 1
            }
            _ => {
                self.json.insert(list.into(), Value::Array(vec![object]));
                0
            }
        }
    }

    /// Adds a buffer view of its own for some bytes, such as an image.
    pub(super) fn view(&mut self, bytes: &[u8], stride: Option<usize>) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() });
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    /// Adds an accessor with a buffer view of its own.
    pub(super) fn accessor(&mut self, elements: &Elements<'_>) -> usize {
        let Elements { bytes, component, shape, count, is_normalized, stride, range } = elements;
        let view = self.view(bytes, *stride);
        let mut accessor =
            json!({ "bufferView": view, "componentType": component, "type": shape, "count": count });
        if *is_normalized {
            accessor["normalized"] = json!(true);
        }
        if let Some([least, greatest]) = range {
            accessor["min"] = json!(least.to_array());
            accessor["max"] = json!(greatest.to_array());
        }
        self.push("accessors", accessor)
    }

    /// The bytes of the file, or `None` if it is larger than the format allows, 4 GiB.
    pub(super) fn into_bytes(mut self) -> Option<Vec<u8>> {
        let length = self.bin.len();
        self.set("buffers", json!([{ "byteLength": length }]));
        let mut json = Value::Object(self.json).to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let bin_bytes = length.next_multiple_of(4);
        let total = u32::try_from(12 + 8 + json.len() + 8 + bin_bytes).ok()?;
        let mut bytes = Vec::with_capacity(total as usize);
        for word in [*b"glTF", 2_u32.to_le_bytes(), total.to_le_bytes()] {
            bytes.extend(word);
        }
        for word in [(json.len() as u32).to_le_bytes(), *b"JSON"] {
            bytes.extend(word);
        }
        bytes.extend(json);
        for word in [(bin_bytes as u32).to_le_bytes(), *b"BIN\0"] {
            bytes.extend(word);
        }
        bytes.extend(self.bin);
        bytes.resize(total as usize, 0);
        Some(bytes)
    }
}
