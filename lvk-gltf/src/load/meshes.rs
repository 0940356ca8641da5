//! Meshes and their primitives.

use gltf::json::mesh::{self as json, Mode, Semantic};
use gltf::json::validation::Checked;

use super::accessors::{Accessor, Accessors};
use super::place::place;
use super::{attributes, topology, vertices};
use crate::{Material, Mesh, MorphTarget, Primitive, Problem, Warning};

/// Most sets of an attribute.
const MOST_SETS: u32 = 8;

/// Reads a mesh. `materials` are those of the model.
pub(super) fn read_mesh(
    accessors: Accessors<'_>,
    materials: &[Material],
    index: usize,
) -> Result<(Mesh, Vec<Warning>), Problem> {
    let json = &accessors.document.root.meshes[index];
    let name = place("mesh", index, json.name.as_deref());
    let mut mesh = Mesh { name: json.name.clone(), ..Mesh::default() };
    let mut warnings = Vec::new();
    let mut target_count = None;
    for (number, primitive) in json.primitives.iter().enumerate() {
        let place = format!("{name}, primitive {number}");
        let targets = primitive.targets.as_ref().map_or(0, Vec::len);
        if *target_count.get_or_insert(targets) != targets {
            let wanted = target_count.unwrap_or(0) as u64;
            let place = format!("the list of morph targets of {place}");
            return Err(Problem::Count { place, found: targets as u64, wanted });
        }
        let reader = Reader { accessors, materials, json: primitive, place: &place, warnings: &mut warnings };
        mesh.primitives.extend(reader.read()?);
        warn_of_extensions(accessors, index, number, &place, &mut warnings);
    }
    let target_count = target_count.unwrap_or(0);
    mesh.weights = json.weights.clone().unwrap_or_else(|| vec![0.0; target_count]);
    check_weights(&mesh.weights, target_count, &name)?;
    Ok((mesh, warnings))
}

/// Checks weights of morph targets: their number, and that they are finite.
pub(super) fn check_weights(weights: &[f32], target_count: usize, place: &str) -> Result<(), Problem> {
    if weights.len() != target_count {
        let place = format!("the list of weights of {place}");
        return Err(Problem::Count { place, found: weights.len() as u64, wanted: target_count as u64 });
    }
    if weights.iter().any(|weight| !weight.is_finite()) {
        return Err(Problem::NotFinite { place: place.into(), what: "a weight of a morph target".into() });
    }
    Ok(())
}

fn warn_of_extensions(
    accessors: Accessors<'_>,
    mesh: usize,
    number: usize,
    place: &str,
    warnings: &mut Vec<Warning>,
) {
    let meshes = &accessors.document.extensions.meshes;
    let Some(primitive) = meshes.get(mesh).and_then(|mesh| mesh.primitives.get(number)) else { return };
    let mut warn = |feature: &str| {
        warnings.push(Warning::FeatureIgnored { place: place.into(), feature: feature.into() });
    };
    if primitive.extensions.variants.is_some() {
        warn("KHR_materials_variants");
    }
    if primitive.targets.iter().any(|target| target.tex_coords.is_some()) {
        warn("attribute TEXCOORD_0 of a morph target");
    }
    if primitive.targets.iter().any(|target| target.colors.is_some()) {
        warn("attribute COLOR_0 of a morph target");
    }
}

struct Reader<'a> {
    accessors: Accessors<'a>,
    materials: &'a [Material],
    json: &'a json::Primitive,
    place: &'a str,
    warnings: &'a mut Vec<Warning>,
}

impl<'a> Reader<'a> {
    /// Reads the primitive, or leaves it out with a warning.
    fn read(mut self) -> Result<Option<Primitive>, Problem> {
        let place = self.place;
        let Checked::Valid(mode) = self.json.mode else { return Ok(None) };
        if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            let mode = topology::mode_name(mode);
            self.warnings.push(Warning::NoTriangles { place: place.into(), mode });
            return Ok(None);
        }
        let mut primitive =
            Primitive { material: self.json.material.map(|it| it.value()), ..Primitive::default() };
        let Some(positions) = self.json.attributes.get(&Checked::Valid(Semantic::Positions)) else {
            self.warnings.push(Warning::NoPositions { place: place.into() });
            return Ok(None);
        };
        let positions = self.open(positions.value())?;
        primitive.positions = attributes::positions(&positions, self.is_quantized())?;
        for (semantic, accessor) in &self.json.attributes {
            if let Checked::Valid(semantic) = semantic {
                self.read_attribute(&mut primitive, semantic, accessor.value())?;
            }
        }
        self.check_joints(&mut primitive)?;
        self.read_indices(&mut primitive, mode)?;
        self.read_targets(&mut primitive)?;
        self.complete(&mut primitive)?;
        Ok(Some(primitive))
    }

    fn open(&self, accessor: usize) -> Result<Accessor<'a>, Problem> {
        self.accessors.open(accessor, self.place)
    }

    fn is_quantized(&self) -> bool {
        self.accessors.document.uses("KHR_mesh_quantization")
    }

    fn read_attribute(
        &mut self,
        primitive: &mut Primitive,
        semantic: &Semantic,
        index: usize,
    ) -> Result<(), Problem> {
        let (vertices, quantized) = (primitive.vertex_count() as u64, self.is_quantized());
        let (Semantic::TexCoords(set)
        | Semantic::Joints(set)
        | Semantic::Weights(set)
        | Semantic::Colors(set)) = *semantic
        else {
            return match semantic {
                Semantic::Normals => {
                    let accessor = self.open_for(vertices, index)?;
                    primitive.normals = attributes::unit_vectors(&accessor, quantized)?;
                    Ok(())
                }
                Semantic::Tangents => {
                    let accessor = self.open_for(vertices, index)?;
                    primitive.tangents = attributes::unit_vectors(&accessor, quantized)?;
                    Ok(())
                }
                Semantic::Extras(name) => {
                    self.ignore(&format!("attribute _{}", super::place::shortened(name)));
                    Ok(())
                }
                _ => Ok(()),
            };
        };
        if set >= MOST_SETS || set > 0 && matches!(semantic, Semantic::Colors(_)) {
            self.ignore(&format!("attribute {}", semantic.to_string()));
            return Ok(());
        }
        let (set, accessor) = (set as usize, self.open_for(vertices, index)?);
        match semantic {
            Semantic::Colors(_) => primitive.colors = attributes::colors(&accessor)?,
            Semantic::TexCoords(_) => {
                put(&mut primitive.tex_coords, set, attributes::tex_coords(&accessor, quantized)?)
            }
            Semantic::Joints(_) => put(&mut primitive.joints, set, attributes::joints(&accessor)?),
            _ => put(&mut primitive.weights, set, attributes::weights(&accessor)?),
        }
        Ok(())
    }

    fn open_for(&self, vertices: u64, accessor: usize) -> Result<Accessor<'a>, Problem> {
        let accessor = self.open(accessor)?;
        accessor.check_count(vertices)?;
        Ok(accessor)
    }

    fn ignore(&mut self, feature: &str) {
        self.warnings.push(Warning::FeatureIgnored { place: self.place.into(), feature: feature.into() });
    }

    /// Checks that sets of joints and of weights belong together, and makes the sum of the weights 1.
    fn check_joints(&mut self, primitive: &mut Primitive) -> Result<(), Problem> {
        let (joints, weights) = (&mut primitive.joints, &mut primitive.weights);
        let is_complete = joints.iter().zip(&*weights).all(|(joints, weights)| joints.len() == weights.len());
        if joints.len() != weights.len() || !is_complete || joints.iter().any(Vec::is_empty) {
            let sets = |count: usize| format!("{count} {}", if count == 1 { "set" } else { "sets" });
            let rule =
                format!("it has {} of joints and {} of weights", sets(joints.len()), sets(weights.len()));
            let vertices = primitive.positions.is_empty();
            return if vertices { Ok(()) } else { Err(Problem::Rule { place: self.place.into(), rule }) };
        }
        let mut corrected = false;
        for vertex in 0..weights.first().map_or(0, Vec::len) {
            corrected |= normalize_weights(joints, weights, vertex);
        }
        if corrected {
            let what = "weights of joints that are negative, or whose sum is not 1".into();
            self.warnings.push(Warning::Corrected { place: self.place.into(), what });
        }
        Ok(())
    }

    fn read_indices(&mut self, primitive: &mut Primitive, mode: Mode) -> Result<(), Problem> {
        let vertices = primitive.vertex_count();
        let budget = self.accessors.budget;
        let indices = match self.json.indices {
            Some(accessor) => {
                let accessor = self.open(accessor.value())?;
                let indices = accessor.read_indices()?;
                if let Some(index) = indices.iter().find(|index| **index as usize >= vertices) {
                    let (index, count) = (u64::from(*index), vertices as u64);
                    return Err(Problem::OutOfRange {
                        place: accessor.place,
                        what: "the vertex",
                        index,
                        count,
                    });
                }
                indices
            }
            None => {
                let mut indices = budget.list(vertices as u64, || self.place.into())?;
                indices.extend(0..vertices as u32);
                indices
            }
        };
        let list = topology::triangle_list(mode, indices, budget, &|| self.place.into())?;
        if list.has_rest {
            self.warnings.push(Warning::IncompleteTriangle { place: self.place.into() });
        }
        primitive.indices = list.indices;
        Ok(())
    }

    fn read_targets(&self, primitive: &mut Primitive) -> Result<(), Problem> {
        let vertices = primitive.vertex_count() as u64;
        let quantized = self.is_quantized();
        for (number, target) in self.json.targets.iter().flatten().enumerate() {
            let place = format!("{}, morph target {number}", self.place);
            let read = |accessor: Option<gltf::json::Index<gltf::json::Accessor>>| {
                let Some(accessor) = accessor else { return Ok(Vec::new()) };
                let accessor = self.accessors.open(accessor.value(), &place)?;
                accessor.check_count(vertices)?;
                attributes::differences(&accessor, quantized)
            };
            let (positions, normals) = (read(target.positions)?, read(target.normals)?);
            primitive.morph_targets.push(MorphTarget {
                positions,
                normals,
                tangents: read(target.tangents)?,
            });
        }
        Ok(())
    }

    /// Adds normals and tangents that the file lacks.
    fn complete(&mut self, primitive: &mut Primitive) -> Result<(), Problem> {
        let (budget, place) = (self.accessors.budget, self.place);
        if primitive.normals.is_empty() {
            vertices::make_flat(primitive, budget, &|| format!("{place} with flat normals"))?;
        }
        let Some(material) = primitive.material.and_then(|material| self.materials.get(material)) else {
            return Ok(());
        };
        let has = |set: usize| primitive.tex_coords.get(set).is_some_and(|set| !set.is_empty());
        for (texture, reference) in material.textures().filter(|(_, texture)| !has(texture.tex_coord)) {
            let (place, set) = (place.into(), reference.tex_coord);
            self.warnings.push(Warning::NoTexCoords { place, texture, set });
        }
        match material.tangent_tex_coord() {
            Some(set) if primitive.tangents.is_empty() && has(set) => {
                vertices::make_tangents(primitive, set, budget, &|| format!("{place} with tangents"))
            }
            _ => Ok(()),
        }
    }
}

/// Puts a set of an attribute in its place. Sets before it that the file lacks are empty.
fn put<T>(sets: &mut Vec<Vec<T>>, set: usize, list: Vec<T>) {
    if sets.len() <= set {
        sets.resize_with(set + 1, Vec::new);
    }
    sets[set] = list;
}

/// Makes the sum of a vertex' weights 1, and joints without weight joint 0. Says whether the weights were wrong. Without
/// any weight, the first joint has it all.
fn normalize_weights(joints: &mut [Vec<[u16; 4]>], weights: &mut [Vec<[f32; 4]>], vertex: usize) -> bool {
    let mut negative = false;
    let mut sum = 0.0_f64;
    for weight in weights.iter_mut().flat_map(|set| &mut set[vertex]) {
        negative |= *weight < 0.0;
        *weight = weight.max(0.0);
        sum += f64::from(*weight);
    }
    if sum <= 0.0 {
        weights[0][vertex][0] = 1.0;
    } else {
        weights
            .iter_mut()
            .for_each(|set| set[vertex] = set[vertex].map(|weight| (f64::from(weight) / sum) as f32));
    }
    for (joints, weights) in joints.iter_mut().zip(&*weights) {
        for (joint, weight) in joints[vertex].iter_mut().zip(weights[vertex]) {
            *joint = if weight > 0.0 { *joint } else { 0 };
        }
    }
    // Weights of 8 bits sum up to 1 within a few of their steps.
    negative || (sum - 1.0).abs() > 0.02
}
