//! The JSON of a file, read and checked.

use gltf::json::validation::Validate as _;
use gltf::json::{self, mesh::Semantic, validation::Checked, validation::Error as Broken};

use super::budget::Budget;
use super::extensions;
use super::place::{place, shortened, shortened_to};
use super::scan::scan;
use crate::{Problem, Warning};

/// Names of the extensions that the loader reads, in alphabetical order. A file that requires another one is refused; one that
/// only uses another one gives a warning.
pub const SUPPORTED_EXTENSIONS: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// The JSON of a file. All references of objects to other objects are in range.
#[derive(Debug)]
pub(super) struct Document {
    /// What the `gltf` crate reads.
    pub(super) root: json::Root,
    /// Extensions that it does not read.
    pub(super) extensions: extensions::Root,
    /// What was left out of the JSON.
    warnings: Vec<Warning>,
}

impl Document {
    /// Reads and checks the JSON.
    pub(super) fn parse(text: &[u8], budget: &Budget) -> Result<Self, Problem> {
        let end = text.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1); // some tools pad by zeros
        let text = &text[..end];
        scan(text, budget)?;
        let not_gltf =
            |error: serde_json::Error| Problem::Json { what: shortened_to(&error.to_string(), 200) };
        check_version(&serde_json::from_slice(text).map_err(not_gltf)?)?;
        let mut warnings = Vec::new();
        let root = match serde_json::from_slice(text) {
            Ok(root) => root,
            Err(error) => repaired(text, error, budget, &mut warnings)?,
        };
        let extensions = serde_json::from_slice(text).map_err(not_gltf)?;
        let document = Self { root, extensions, warnings };
        document.check_required()?;
        document.check_positions()?;
        document.validate()?;
        Ok(document)
    }

    /// Returns a warning for each extension that the file uses and the loader does not read.
    pub(super) fn warnings(&self) -> Vec<Warning> {
        let unknown =
            self.root.extensions_used.iter().filter(|name| !SUPPORTED_EXTENSIONS.contains(&name.as_str()));
        let ignored = unknown.map(|name| Warning::ExtensionIgnored { extension: shortened(name) });
        ignored.chain(self.warnings.iter().cloned()).collect()
    }

    /// Says whether the file uses an extension.
    pub(super) fn uses(&self, extension: &str) -> bool {
        let mut names = self.root.extensions_used.iter().chain(&self.root.extensions_required);
        names.any(|name| name == extension)
    }

    fn check_required(&self) -> Result<(), Problem> {
        let unknown =
            self.root.extensions_required.iter().find(|name| !SUPPORTED_EXTENSIONS.contains(&name.as_str()));
        unknown.map_or(Ok(()), |name| {
            let remedy = match name.as_str() {
                "KHR_draco_mesh_compression" => ", or with EXT_meshopt_compression",
                "KHR_materials_pbrSpecularGlossiness" => ", as metallic and roughness",
                _ => "",
            };
            Err(Problem::RequiredExtension { extension: shortened(name), remedy })
        })
    }

    /// The checks of the `gltf` crate index the accessors by that of the positions, whether it is in range or not.
    fn check_positions(&self) -> Result<(), Problem> {
        let count = self.root.accessors.len();
        for (index, mesh) in self.root.meshes.iter().enumerate() {
            for (number, primitive) in mesh.primitives.iter().enumerate() {
                let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
                if let Some(accessor) = positions.filter(|accessor| accessor.value() >= count) {
                    return Err(Problem::OutOfRange {
                        place: format!("{}, primitive {number}", place("mesh", index, mesh.name.as_deref())),
                        what: "accessor",
                        index: accessor.value() as u64,
                        count: count as u64,
                    });
                }
            }
        }
        Ok(())
    }

    /// Runs the checks of the `gltf` crate and returns the first rule that is broken. Positions may lack their bounds, which
    /// this loader does not use, and a primitive may lack positions. Required extensions are checked by another list.
    fn validate(&self) -> Result<(), Problem> {
        let mut first = None;
        self.root.validate(&self.root, json::Path::new, &mut |path, broken| {
            if first.is_none() && broken != Broken::Unsupported {
                let path = path();
                let of_positions = ["[\"POSITION\"]", "[\"POSITION\"].min", "[\"POSITION\"].max"];
                let bounds = broken != Broken::IndexOutOfBounds;
                if !(bounds && of_positions.iter().any(|end| path.as_str().ends_with(end))) {
                    first = Some((path, broken));
                }
            }
        });
        first.map_or(Ok(()), |(path, broken)| {
            let rule = match broken {
                Broken::IndexOutOfBounds => "the reference is out of range",
                Broken::Invalid => "the value is not allowed",
                Broken::Missing => "the property is missing",
                _ => "the size is too large for this machine",
            };
            Err(Problem::Rule { place: self.name_path(path.as_str()), rule: rule.into() })
        })
    }

    /// Adds the name of the object to a path of the JSON, such as `meshes[3].primitives[1].material`.
    fn name_path(&self, path: &str) -> String {
        let path = shortened(path);
        let first = path.split_once(']').and_then(|(start, _)| start.split_once('['));
        let Some((list, Ok(index))) = first.map(|(list, index)| (list, index.parse::<usize>())) else {
            return path;
        };
        let root = &self.root;
        let name = match list {
            "meshes" => root.meshes.get(index).and_then(|mesh| mesh.name.as_deref()),
            "nodes" => root.nodes.get(index).and_then(|node| node.name.as_deref()),
            "materials" => root.materials.get(index).and_then(|material| material.name.as_deref()),
            "animations" => root.animations.get(index).and_then(|animation| animation.name.as_deref()),
            "skins" => root.skins.get(index).and_then(|skin| skin.name.as_deref()),
            _ => None,
        };
        name.map_or(path.clone(), |name| format!("{path} of '{}'", shortened(name)))
    }
}

/// Bytes that a JSON value takes for each byte of its text, at most.
const VALUE_BYTES: u64 = 256;

/// Reads JSON that the `gltf` crate refuses although the specification allows it: scenes without nodes, and channels without a
/// node, as `KHR_animation_pointer` has them. Such channels are left out, with a warning. `error` is what the crate said.
fn repaired(
    text: &[u8],
    error: serde_json::Error,
    budget: &Budget,
    warnings: &mut Vec<Warning>,
) -> Result<json::Root, Problem> {
    if !error.to_string().starts_with("missing field `node") {
        return Err(not_gltf(error));
    }
    budget.charge(VALUE_BYTES.saturating_mul(text.len() as u64), || "its JSON".into())?;
    let mut value: serde_json::Value = serde_json::from_slice(text).map_err(not_gltf)?;
    for scene in objects(&mut value, "scenes").filter_map(|scene| scene.as_object_mut()) {
        scene.entry("nodes").or_insert_with(|| serde_json::Value::Array(Vec::new()));
    }
    for (index, animation) in objects(&mut value, "animations").enumerate() {
        let Some(channels) = animation.get_mut("channels").and_then(|channels| channels.as_array_mut())
        else {
            continue;
        };
        let before = channels.len();
        channels.retain(|channel| channel.get("target").is_none_or(|target| target.get("node").is_some()));
        if channels.len() < before {
            let count = before - channels.len();
            let feature = format!("KHR_animation_pointer of {count} of its channels, which have no node,");
            warnings.push(Warning::FeatureIgnored { place: place("animation", index, None), feature });
        }
    }
    serde_json::from_value(value).map_err(not_gltf)
}

fn not_gltf(error: serde_json::Error) -> Problem {
    Problem::Json { what: shortened_to(&error.to_string(), 200) }
}

fn objects<'a>(
    value: &'a mut serde_json::Value,
    list: &str,
) -> impl Iterator<Item = &'a mut serde_json::Value> {
    value.get_mut(list).and_then(|list| list.as_array_mut()).into_iter().flatten()
}

/// The version of a file, read before all else, as other versions have other objects.
#[derive(Debug, Default, serde::Deserialize)]
#[serde(default)]
struct Versions {
    asset: Asset,
}

#[derive(Debug, Default, serde::Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Asset {
    version: String,
    min_version: Option<String>,
}

fn check_version(versions: &Versions) -> Result<(), Problem> {
    let Asset { version, min_version } = &versions.asset;
    let minor_is_known = min_version.as_ref().is_none_or(|least| least == "2.0");
    if (version == "2" || version.starts_with("2.")) && minor_is_known {
        return Ok(());
    }
    let version = min_version.as_ref().filter(|_| !minor_is_known).unwrap_or(version);
    Err(Problem::Version { version: if version.is_empty() { "no".into() } else { shortened(version) } })
}
