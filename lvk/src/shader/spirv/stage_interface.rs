//! Inputs and outputs that shader stages pass to each other by location.

use std::ops::Range;
use std::sync::Arc;

use ::spirv::{Decoration, StorageClass};

use super::parsed::{MAX_NESTING, ParsedModule, Type, Variable};
use crate::format::NumericFormat;
use crate::shader::ShaderStage;

/// Most locations of a stage. Modules with more are refused elsewhere, so further ones are ignored.
const MAX_LOCATIONS: usize = 1024;
/// Most types that are visited for the locations of a stage. Nested arrays and structs of values without a location multiply.
const MAX_VISITS: u32 = 1 << 16;

/// A scalar or vector at a location.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LocationValue {
    pub(crate) location: u32,
    /// First of the four components of the location, in 32-bit words.
    pub(crate) component: u32,
    /// Number of components of the value.
    pub(crate) count: u32,
    /// Bytes of a component.
    pub(crate) bytes: u32,
    pub(crate) numbers: NumericFormat,
    /// True for a value of a whole patch.
    pub(crate) is_patch: bool,
    /// True for a value of a primitive, which no vertex has.
    pub(crate) is_per_primitive: bool,
    /// Name of the variable; empty without debug names.
    pub(crate) name: Arc<str>,
}

/// The values that a stage takes from the stage before it, and those that it passes on.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct StageInterface {
    pub(crate) inputs: Vec<LocationValue>,
    pub(crate) outputs: Vec<LocationValue>,
}

impl StageInterface {
    pub(crate) fn from_module(stage: ShaderStage, module: &ParsedModule, entry: usize) -> Self {
        let mut found = Self::default();
        let mut visits = MAX_VISITS;
        for variable in module.variables.iter().filter(|variable| module.in_interface(entry, variable)) {
            if variable.storage == StorageClass::Input as u32 {
                collect(module, variable, has_array_inputs(stage), &mut visits, &mut found.inputs);
            } else if variable.storage == StorageClass::Output as u32 {
                collect(module, variable, has_array_outputs(stage), &mut visits, &mut found.outputs);
            }
        }
        found
    }
}

impl LocationValue {
    /// Returns the description in error messages, such as `a vec3 of 32-bit floats`.
    pub(crate) fn description(&self) -> String {
        let numbers = match self.numbers {
            NumericFormat::Float => "floats",
            NumericFormat::Uint | NumericFormat::Sint => "integers",
        };
        let of = if self.is_per_primitive { " of each primitive" } else { "" };
        format!("{} {}-bit {numbers}{of}", self.count, u64::from(self.bytes) * 8)
    }

    /// True if a component of an input may be one of the output: their types are the same, and both are values of vertices or of
    /// primitives. The sign of integers does not matter.
    pub(crate) fn is_like(&self, output: &Self) -> bool {
        let is_float = |value: &Self| value.numbers == NumericFormat::Float;
        is_float(self) == is_float(output)
            && self.bytes == output.bytes
            && self.is_per_primitive == output.is_per_primitive
    }

    /// Returns the 32-bit words of the value: each location has four, and a component takes whole words.
    pub(crate) fn words(&self) -> Range<u64> {
        let start = u64::from(self.location) * 4 + u64::from(self.component);
        start..start + u64::from(self.count) * u64::from(self.bytes.div_ceil(4))
    }
}

/// Stages whose inputs have an element for each vertex.
fn has_array_inputs(stage: ShaderStage) -> bool {
    matches!(stage, ShaderStage::TessControl | ShaderStage::TessEval | ShaderStage::Geometry)
}

/// Stages whose outputs have an element for each vertex or primitive.
fn has_array_outputs(stage: ShaderStage) -> bool {
    matches!(stage, ShaderStage::TessControl | ShaderStage::Mesh)
}

/// Adds the values of a variable. Built-ins have no locations.
fn collect(
    module: &ParsedModule,
    variable: &Variable,
    is_array: bool,
    visits: &mut u32,
    out: &mut Vec<LocationValue>,
) {
    let decoration = |of| module.decoration(variable.id, of);
    let Some(Type::Pointer { target }) = module.types.get(&variable.ty) else { return };
    if decoration(Decoration::BuiltIn).is_some() || decoration(Decoration::PerVertexKHR).is_some() {
        return;
    }
    let is_patch = decoration(Decoration::Patch).is_some();
    let is_per_primitive = decoration(Decoration::PerPrimitiveEXT).is_some();
    let ty = match module.types.get(target) {
        Some(Type::Array { element, .. }) if is_array && !is_patch => element,
        _ => target,
    };
    let name = module.names.get(&variable.id).map_or("", String::as_str).into();
    let component = decoration(Decoration::Component).unwrap_or(0);
    let mut collector = LocationCollector { module, out, visits, is_patch, is_per_primitive, name };
    match (module.types.get(ty), decoration(Decoration::Location)) {
        (Some(Type::Struct { members }), location) => collector.block(*ty, members, location),
        (_, Some(location)) => _ = collector.value(*ty, location, component, 0),
        _ => {}
    }
}

struct LocationCollector<'a> {
    module: &'a ParsedModule,
    out: &'a mut Vec<LocationValue>,
    /// Types that may still be visited.
    visits: &'a mut u32,
    is_patch: bool,
    is_per_primitive: bool,
    name: Arc<str>,
}

impl LocationCollector<'_> {
    /// Adds the members of a block that starts at `first`, or whose members have locations of their own.
    fn block(&mut self, ty: u32, members: &[u32], first: Option<u32>) {
        let mut next = first;
        for (index, member) in (0..).zip(members) {
            let decoration = |of| self.module.member_decoration(ty, index, of);
            let own = decoration(Decoration::Location).or(next);
            let component = decoration(Decoration::Component).unwrap_or(0);
            let is_builtin = decoration(Decoration::BuiltIn).is_some();
            let Some(location) = own.filter(|_| !is_builtin) else { continue };
            self.is_patch |= decoration(Decoration::Patch).is_some();
            self.is_per_primitive |= decoration(Decoration::PerPrimitiveEXT).is_some();
            next = Some(self.value(*member, location, component, 0));
        }
    }

    /// Adds the values of a type from `location` on. Returns the location that follows.
    fn value(&mut self, ty: u32, location: u32, component: u32, depth: u32) -> u32 {
        if depth > MAX_NESTING || self.out.len() > MAX_LOCATIONS || *self.visits == 0 {
            return location;
        }
        *self.visits -= 1;
        match self.module.types.get(&ty) {
            Some(Type::Number { bytes, numbers }) => self.leaf(location, component, 1, *bytes, *numbers),
            Some(Type::Vector { element, count }) => match self.module.types.get(element) {
                Some(Type::Number { bytes, numbers }) => {
                    self.leaf(location, component, *count, *bytes, *numbers)
                }
                _ => location,
            },
            Some(Type::Matrix { column, count }) => {
                let count = (*count).min(MAX_LOCATIONS as u32);
                (0..count).fold(location, |next, _| self.value(*column, next, component, depth + 1))
            }
            Some(Type::Array { element, length }) => {
                let length = self.module.array_length(*length).unwrap_or(0).min(MAX_LOCATIONS as u64);
                (0..length).fold(location, |next, _| self.value(*element, next, component, depth + 1))
            }
            Some(Type::Struct { members }) => {
                members.iter().fold(location, |next, member| self.value(*member, next, 0, depth + 1))
            }
            _ => location,
        }
    }

    fn leaf(&mut self, location: u32, component: u32, count: u32, bytes: u32, numbers: NumericFormat) -> u32 {
        self.out.push(LocationValue {
            location,
            component,
            count,
            bytes,
            numbers,
            is_patch: self.is_patch,
            is_per_primitive: self.is_per_primitive,
            name: Arc::clone(&self.name),
        });
        // Vectors of more than two 64-bit numbers take two locations.
        location.saturating_add(if bytes == 8 && count > 2 { 2 } else { 1 })
    }
}

#[cfg(all(test, feature = "glsl"))]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]
    use super::*;
    use crate::shader::spirv::reflect::reflect;
    use crate::shader::{CompileFiles, CompileOptions, ShaderModuleDesc, ShaderSource, compile};

    fn interface(stage: ShaderStage, text: &str) -> StageInterface {
        let desc = ShaderModuleDesc { stage, source: ShaderSource::Glsl(text), ..Default::default() };
        let words = compile(&desc, &CompileOptions::default(), CompileFiles::default()).unwrap();
        reflect("", stage, &words).unwrap().interface
    }

    /// Location, component, count and patch of each value, sorted.
    fn places(values: &[LocationValue]) -> Vec<(u32, u32, u32, bool)> {
        let place = |value: &LocationValue| (value.location, value.component, value.count, value.is_patch);
        let mut places: Vec<_> = values.iter().map(place).collect();
        places.sort_unstable();
        places
    }

    #[test]
    fn vectors_matrices_arrays_and_blocks_take_their_locations() {
        let found = interface(
            ShaderStage::Vertex,
            "layout(location = 0) out vec3 a;
             layout(location = 1, component = 2) out vec2 b;
             layout(location = 2) out mat3x2 c;
             layout(location = 5) out float d[2];
             layout(location = 7) out Block { vec4 e; flat uvec2 f; } block;
             void main() { a = vec3(0); b = vec2(0); c = mat3x2(0); d[1] = 1; block.f = uvec2(1);
                 gl_Position = vec4(0); }",
        );
        let plain = |location, count| (location, 0, count, false);
        assert_eq!(
            places(&found.outputs),
            [
                plain(0, 3),
                (1, 2, 2, false),
                plain(2, 2),
                plain(3, 2),
                plain(4, 2),
                plain(5, 1),
                plain(6, 1),
                plain(7, 4),
                plain(8, 2)
            ]
        );
        assert_eq!(found.inputs, []);
    }

    #[test]
    fn arrays_of_vertices_count_as_one_vertex() {
        let found = interface(
            ShaderStage::Geometry,
            "layout(triangles) in; layout(points, max_vertices = 1) out;
             layout(location = 0) in vec2 a[];
             layout(location = 3) out vec2 b;
             void main() { b = a[1]; EmitVertex(); }",
        );
        assert_eq!(places(&found.inputs), [(0, 0, 2, false)]);
        assert_eq!(places(&found.outputs), [(3, 0, 2, false)]);
        let found = interface(
            ShaderStage::TessEval,
            "layout(triangles) in; layout(location = 0) in vec2 a[]; layout(location = 1) patch in vec4 b;
             void main() { gl_Position = b + vec4(a[0], a[1]); }",
        );
        assert_eq!(places(&found.inputs), [(0, 0, 2, false), (1, 0, 4, true)]);
    }

    #[test]
    fn values_of_primitives_are_told_from_values_of_vertices() {
        let found = interface(
            ShaderStage::Fragment,
            "#extension GL_EXT_mesh_shader : require
             layout(location = 0) in vec2 a;
             layout(location = 1) perprimitiveEXT in vec2 b;
             layout(location = 2) perprimitiveEXT in Block { vec2 c; } block;
             layout(location = 0) out vec4 color;
             void main() { color = vec4(a + block.c, b); }",
        );
        let mut of_primitives: Vec<_> =
            found.inputs.iter().map(|value| (value.location, value.is_per_primitive)).collect();
        of_primitives.sort_unstable();
        assert_eq!(of_primitives, [(0, false), (1, true), (2, true)]);
        let of_primitive = found.inputs.iter().find(|value| value.is_per_primitive).unwrap();
        assert_eq!(of_primitive.description(), "2 32-bit floats of each primitive");
    }

    /// Returns the words of an instruction.
    fn code(op: ::spirv::Op, operands: &[u32]) -> Vec<u32> {
        [&[(operands.len() as u32 + 1) << 16 | op as u32], operands].concat()
    }

    #[test]
    fn nested_values_without_locations_end() {
        use ::spirv::Op;
        let output = StorageClass::Output as u32;
        let start = [
            vec![::spirv::MAGIC_NUMBER, 0x0001_0000, 0, 200, 0],
            code(Op::Decorate, &[100, Decoration::Location as u32, 0]),
            code(Op::TypeBool, &[1]),
            code(Op::TypeInt, &[2, 32, 0]),
            code(Op::Constant, &[2, 3, u32::MAX]),
        ];
        let arrays = (10..60).map(|id| code(Op::TypeArray, &[id, if id == 10 { 1 } else { id - 1 }, 3]));
        let matrices =
            (10..60).map(|id| code(Op::TypeMatrix, &[id, if id == 10 { 1 } else { id - 1 }, u32::MAX]));
        let structs =
            (10..60).map(|id| code(Op::TypeStruct, &[id, if id == 10 { 1 } else { id - 1 }, 1, id - 1]));
        let end = [code(Op::TypePointer, &[99, output, 59]), code(Op::Variable, &[99, 100, output])].concat();
        for nested in [arrays.collect::<Vec<_>>(), matrices.collect(), structs.collect()] {
            let words = [start.concat(), nested.concat(), end.clone()].concat();
            let module = ParsedModule::parse(&words).unwrap();
            let found = StageInterface::from_module(ShaderStage::Vertex, &module, 0);
            assert_eq!(found, StageInterface::default());
        }
    }

    #[test]
    fn values_of_any_size_are_compared_and_described() {
        let value = LocationValue {
            location: 0,
            component: u32::MAX,
            count: u32::MAX,
            bytes: u32::MAX.div_ceil(8),
            numbers: NumericFormat::Uint,
            is_patch: false,
            is_per_primitive: false,
            name: "".into(),
        };
        let words = value.words();
        assert_eq!(words.end - words.start, u64::from(u32::MAX) << 27);
        assert_eq!(value.description(), "4294967295 4294967296-bit integers");
    }

    #[test]
    fn values_have_types_and_words() {
        let value = |count, numbers, bytes| LocationValue {
            location: 2,
            component: 1,
            count,
            bytes,
            numbers,
            is_patch: false,
            is_per_primitive: false,
            name: "".into(),
        };
        let (float, sint, uint) = (NumericFormat::Float, NumericFormat::Sint, NumericFormat::Uint);
        assert!(value(1, sint, 4).is_like(&value(3, uint, 4)));
        assert!(!value(1, float, 4).is_like(&value(1, uint, 4)));
        assert!(!value(1, float, 2).is_like(&value(1, float, 4)));
        assert_eq!(value(3, float, 4).words(), 9..12);
        assert_eq!(value(3, float, 2).words(), 9..12);
        assert_eq!(value(3, float, 8).words(), 9..15);
        assert_eq!(value(3, float, 4).description(), "3 32-bit floats");
    }
}
