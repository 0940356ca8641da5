//! A first pass over the JSON: bounds the memory of its objects, and refuses numbers that are too large for an index.

use std::fmt;

use gltf::json;
use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};

use super::budget::Budget;
use super::extensions;
use crate::{Animation, Camera, Light, Material, Mesh, Node, Primitive, Problem, Scene, Skin};

/// Charges the memory that the objects of the JSON will take.
///
/// # Errors
/// [`Problem::Memory`], before any object is made; [`Problem::Json`] for damaged JSON, and for an integer beyond 32 bits
/// where a reference may stand, as the `gltf` crate would cut it off.
pub(super) fn scan(text: &[u8], budget: &Budget) -> Result<(), Problem> {
    let mut cost = Cost::default();
    let mut reader = serde_json::Deserializer::from_slice(text);
    let scanned = Scan { cost: &mut cost, object: 0, level: Level::Root }.deserialize(&mut reader);
    scanned.and_then(|()| reader.end()).map_err(|error| Problem::Json { what: error.to_string() })?;
    budget.charge(cost.bytes, || "its JSON".into())
}

#[derive(Debug, Default)]
struct Cost {
    bytes: u64,
}

/// Where a value stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Level {
    /// The whole file.
    Root,
    /// Below a property of the file.
    Object,
    /// The number of bytes, or of elements: may have more than 32 bits.
    Length,
    /// Below `extensions`, whose keys are names of extensions.
    Extensions,
    /// Below an extension of a vendor, which may mean anything.
    Foreign,
}

/// Counts a value and all inside of it.
#[derive(Debug)]
struct Scan<'a> {
    cost: &'a mut Cost,
    /// Bytes of one object.
    object: u64,
    level: Level,
}

impl Scan<'_> {
    fn inner(&mut self, object: u64, level: Level) -> Scan<'_> {
        Scan { cost: self.cost, object, level }
    }

    /// Returns the cost of objects, and the level, of a property's value.
    fn of_property(&self, key: &str) -> (u64, Level) {
        match (self.level, key) {
            (Level::Root, _) => {
                (object_bytes(key), if key == "extensions" { Level::Extensions } else { Level::Object })
            }
            (Level::Extensions, _) if !key.starts_with("KHR_") && !key.starts_with("EXT_") => {
                (self.object, Level::Foreign)
            }
            (Level::Foreign, _) => (self.object, Level::Foreign),
            (_, "byteLength" | "byteOffset" | "count") => (self.object, Level::Length),
            (_, "extensions") => (self.object, Level::Extensions),
            _ => (self.object, Level::Object),
        }
    }
}

/// Returns a bound for the bytes that an object takes at most, in the types of the `gltf` crate, in those of this crate and
/// in the model. Lists grow by doubling.
fn object_bytes(property: &str) -> u64 {
    let bytes = match property {
        "accessors" => size_of::<json::Accessor>(),
        "animations" => size_of::<json::animation::Animation>() + size_of::<Animation>(),
        "buffers" => size_of::<json::Buffer>() + size_of::<extensions::Buffer>() + 64,
        "bufferViews" => size_of::<json::buffer::View>() + size_of::<extensions::View>() + 64,
        "cameras" => size_of::<json::Camera>() + size_of::<Camera>(),
        "extensions" => size_of::<json::extensions::scene::khr_lights_punctual::Light>() + size_of::<Light>(),
        "images" => size_of::<json::Image>() + 256,
        "materials" => {
            size_of::<json::Material>() + size_of::<extensions::Material>() + size_of::<Material>()
        }
        // A map of attributes takes a node of eleven entries.
        "meshes" => {
            let primitive = size_of::<json::mesh::Primitive>() + size_of::<Primitive>() + 11 * 24;
            primitive.max(size_of::<json::Mesh>() + size_of::<Mesh>())
                + size_of::<extensions::Primitive>()
                + 512
        }
        "nodes" => size_of::<json::Node>() + size_of::<extensions::Node>() + size_of::<Node>() + 256,
        "scenes" => size_of::<json::Scene>() + size_of::<Scene>(),
        "skins" => size_of::<json::Skin>() + size_of::<Skin>() + 64,
        "textures" => size_of::<json::Texture>() + size_of::<extensions::Texture>(),
        _ => size_of::<json::texture::Sampler>(),
    };
    2 * bytes as u64
}

/// A number takes 32 bytes as a JSON value; a string has a header of 24 bytes. Lists grow by doubling.
const VALUE_BYTES: u64 = 64;

impl<'de> DeserializeSeed<'de> for Scan<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Scan<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON of glTF")
    }

    fn visit_bool<E>(self, _: bool) -> Result<(), E> {
        Ok(())
    }

    fn visit_i64<E>(self, _: i64) -> Result<(), E> {
        self.cost.bytes += VALUE_BYTES;
        Ok(())
    }

    fn visit_u64<E: serde::de::Error>(self, number: u64) -> Result<(), E> {
        self.cost.bytes += VALUE_BYTES;
        if number > u64::from(u32::MAX) && matches!(self.level, Level::Root | Level::Object) {
            return Err(E::custom(format_args!("the number {number} is too large for an index")));
        }
        Ok(())
    }

    fn visit_f64<E>(self, _: f64) -> Result<(), E> {
        self.cost.bytes += VALUE_BYTES;
        Ok(())
    }

    fn visit_str<E>(self, text: &str) -> Result<(), E> {
        self.cost.bytes += VALUE_BYTES + 2 * text.len() as u64;
        Ok(())
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(mut self, mut list: A) -> Result<(), A::Error> {
        self.cost.bytes += VALUE_BYTES;
        while list.next_element_seed(self.inner(self.object, self.level))?.is_some() {}
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut map: A) -> Result<(), A::Error> {
        self.cost.bytes += self.object;
        while let Some(key) = map.next_key::<String>()? {
            self.cost.bytes += VALUE_BYTES;
            if key == "extras" {
                map.next_value::<IgnoredAny>()?;
                continue;
            }
            let (object, level) = self.of_property(&key);
            map.next_value_seed(self.inner(object, level))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::MemoryLimit;
    use super::*;

    fn scan_within(text: &str, fixed_bytes: u64) -> Result<(), Problem> {
        scan(text.as_bytes(), &Budget::new(MemoryLimit { fixed_bytes, multiple: 0 }))
    }

    #[test]
    fn many_small_objects_are_charged_as_the_structures_that_they_become() {
        let text = format!("{{\"materials\":[{}{{}}]}}", "{},".repeat(999));
        let least = 1000 * size_of::<json::Material>() as u64;
        assert!(matches!(scan_within(&text, least), Err(Problem::Memory { .. })));
        scan_within(&text, 10 * least).unwrap();
    }

    #[test]
    fn numbers_beyond_32_bits_are_refused_where_a_reference_may_stand() {
        for (text, right) in [
            (r#"{"nodes":[{"mesh":4294967295}]}"#, true),
            (r#"{"nodes":[{"mesh":4294967296}]}"#, false),
            (r#"{"scene":4294967296}"#, false),
            (r#"{"buffers":[{"byteLength":4294967296}]}"#, true),
            (r#"{"nodes":[{"extras":{"id":4294967296}}]}"#, true),
            (r#"{"nodes":[{"extensions":{"VENDOR_x":{"id":4294967296}}}]}"#, true),
            (r#"{"nodes":[{"extensions":{"KHR_lights_punctual":{"light":4294967296}}}]}"#, false),
            (r#"{"nodes":[{"mesh":1}]"#, false),
            (r#"{} x"#, false),
        ] {
            assert_eq!(scan_within(text, 1 << 20).is_ok(), right, "{text}");
        }
    }

    #[test]
    fn deep_nesting_is_an_error() {
        let text = format!("{{\"nodes\":{}", "[".repeat(1_000_000));
        assert!(matches!(scan_within(&text, u64::MAX), Err(Problem::Json { .. })));
    }
}
