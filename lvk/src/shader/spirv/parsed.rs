//! The declarations of a SPIR-V module, parsed once.

use std::collections::{HashMap, HashSet};

use ::spirv::{BuiltIn, Capability, Decoration, Dim, Op, StorageClass};

use super::const_eval::evaluate_spec_constant_op;
use super::words::{self, Instruction};
use crate::format::NumericFormat;

/// Bytes of a buffer address in a push-constant block.
const ADDRESS_BYTES: u64 = 8;
/// Maximum nesting of types. A module with deeper nesting is invalid.
pub(crate) const MAX_NESTING: u32 = 64;

/// Bytes of the types whose size is known, by id. One list for all questions about a module bounds their time.
pub(crate) type KnownSizes = HashMap<u32, u64>;

/// Declarations by id. An id may refer to anything, so every look-up can fail.
#[derive(Debug, Default)]
pub(crate) struct ParsedModule {
    version: u32,
    capabilities: HashSet<u32>,
    pub(crate) entries: Vec<EntryPoint>,
    pub(crate) modes: Vec<Mode>,
    pub(crate) names: HashMap<u32, String>,
    /// Names of members, by the id of the struct and the index of the member.
    pub(crate) member_names: HashMap<(u32, u32), String>,
    /// Structs that buffer references point to, in order, once for each pointer type.
    pub(crate) buffer_references: Vec<u32>,
    pub(crate) types: HashMap<u32, Type>,
    pub(crate) constants: HashMap<u32, Constant>,
    /// Values of operations on constants.
    folded: HashMap<u32, u32>,
    composites: HashMap<u32, [u32; 3]>,
    pub(crate) variables: Vec<Variable>,
    decorations: HashMap<(u32, u32), u32>,
    member_decorations: HashMap<(u32, u32, u32), u32>,
    /// Levels of each type: 1 for a scalar, 0 for one that is only mentioned.
    nesting: HashMap<u32, u32>,
}

/// An entry point.
#[derive(Debug)]
pub(crate) struct EntryPoint {
    pub(crate) model: u32,
    pub(crate) function: u32,
    pub(crate) name: String,
    interface: HashSet<u32>,
}

/// An execution mode with up to three operands.
#[derive(Debug)]
pub(crate) struct Mode {
    pub(crate) function: u32,
    pub(crate) mode: u32,
    pub(crate) operands: [u32; 3],
}

/// A type, with the data that sizes and descriptor kinds need.
#[derive(Debug)]
pub(crate) enum Type {
    Bool,
    Number {
        bytes: u32,
        numbers: NumericFormat,
    },
    Vector {
        element: u32,
        count: u32,
    },
    Matrix {
        column: u32,
        count: u32,
    },
    Array {
        element: u32,
        length: u32,
    },
    RuntimeArray {
        element: u32,
    },
    Struct {
        members: Vec<u32>,
    },
    Pointer {
        target: u32,
    },
    Image {
        storage: bool,
    },
    /// An input attachment with texels of this type.
    SubpassInput {
        texel: u32,
        multisampled: bool,
    },
    Opaque(Op),
}

/// A scalar constant: its low word.
#[derive(Debug)]
pub(crate) struct Constant {
    pub(crate) ty: u32,
    pub(crate) value: u32,
    pub(crate) is_spec: bool,
}

/// A variable at global scope.
#[derive(Debug)]
pub(crate) struct Variable {
    pub(crate) id: u32,
    pub(crate) ty: u32,
    pub(crate) storage: u32,
}

impl ParsedModule {
    pub(crate) fn parse(words: &[u32]) -> Result<Self, String> {
        Self::specialized(words, &HashMap::new())
    }

    /// Like [`parse`](Self::parse), with values of specialization constants by their ids.
    pub(crate) fn specialized(words: &[u32], values: &HashMap<u32, u32>) -> Result<Self, String> {
        let mut module = Self { version: words::version(words), ..Self::default() };
        for instruction in words::instructions(words) {
            let instruction = instruction?;
            match instruction.op {
                Some(Op::Function) => break,
                Some(op) => module.collect(op, &instruction, values)?,
                None => {}
            }
        }
        Ok(module)
    }

    pub(crate) fn has_capability(&self, capability: Capability) -> bool {
        self.capabilities.contains(&(capability as u32))
    }

    /// Returns the numbers of all capabilities, sorted.
    pub(crate) fn capabilities(&self) -> Vec<u32> {
        let mut all: Vec<u32> = self.capabilities.iter().copied().collect();
        all.sort_unstable();
        all
    }

    pub(crate) fn decoration(&self, id: u32, decoration: Decoration) -> Option<u32> {
        self.decorations.get(&(id, decoration as u32)).copied()
    }

    pub(crate) fn member_decoration(&self, ty: u32, member: u32, decoration: Decoration) -> Option<u32> {
        self.member_decorations.get(&(ty, member, decoration as u32)).copied()
    }

    /// True if the entry point uses `variable`. Before SPIR-V 1.4, interfaces do not list resources.
    pub(crate) fn in_interface(&self, entry: usize, variable: &Variable) -> bool {
        self.version < words::VERSION_1_4
            || self.entries.get(entry).is_some_and(|entry| entry.interface.contains(&variable.id))
    }

    /// True if an output of the entry point, or a member of one, is the built-in `Layer`.
    pub(crate) fn writes_layer(&self, entry: usize) -> bool {
        let (builtin, layer) = (Decoration::BuiltIn as u32, BuiltIn::Layer as u32);
        let members: HashSet<u32> = self
            .member_decorations
            .iter()
            .filter(|((_, _, decoration), value)| *decoration == builtin && **value == layer)
            .map(|((ty, ..), _)| *ty)
            .collect();
        let outputs = self.variables.iter().filter(|variable| {
            variable.storage == StorageClass::Output as u32 && self.in_interface(entry, variable)
        });
        outputs.into_iter().any(|variable| {
            let own = self.decoration(variable.id, Decoration::BuiltIn) == Some(layer);
            own || self.block_of(variable.ty).is_some_and(|block| members.contains(&block))
        })
    }

    /// Returns the struct that a pointer refers to, directly or as the element of an array.
    fn block_of(&self, pointer: u32) -> Option<u32> {
        let Type::Pointer { target } = self.types.get(&pointer)? else { return None };
        match self.types.get(target)? {
            Type::Array { element, .. } | Type::RuntimeArray { element } => Some(*element),
            _ => Some(*target),
        }
    }

    /// Returns the three constants of the `WorkgroupSize` built-in.
    pub(crate) fn workgroup_size(&self) -> Option<[u32; 3]> {
        let is_size =
            |id: &u32| self.decoration(*id, Decoration::BuiltIn) == Some(BuiltIn::WorkgroupSize as u32);
        self.composites.iter().find(|(id, _)| is_size(id)).map(|(_, parts)| *parts)
    }

    /// Returns the bytes of a type that its offset and stride decorations lay out.
    pub(crate) fn size_of(&self, ty: u32, known: &mut KnownSizes) -> Result<u64, String> {
        self.size(ty, None, MAX_NESTING, known)
    }

    /// Returns the bytes of a member of a struct.
    pub(crate) fn member_size(
        &self,
        ty: u32,
        index: u32,
        member: u32,
        known: &mut KnownSizes,
    ) -> Result<u64, String> {
        self.size(member, self.matrix_layout(ty, index), MAX_NESTING, known)
    }

    /// Returns the matrix stride of a member, and true if the member is row-major.
    fn matrix_layout(&self, ty: u32, index: u32) -> Option<(u32, bool)> {
        let get = |decoration| self.member_decoration(ty, index, decoration);
        get(Decoration::MatrixStride).map(|stride| (stride, get(Decoration::RowMajor).is_some()))
    }

    /// Returns the bytes of a type. `matrix` is the matrix stride of the current member, and true if the member is
    /// row-major.
    fn size(
        &self,
        ty: u32,
        matrix: Option<(u32, bool)>,
        nesting: u32,
        known: &mut KnownSizes,
    ) -> Result<u64, String> {
        let nesting = nesting.checked_sub(1).ok_or("the types are nested too deeply")?;
        let found = self.types.get(&ty).ok_or("a type is missing")?;
        // Other types have no matrix layout, so their size is computed once, whatever decorates the member.
        let matrix = matrix.filter(|_| matches!(found, Type::Matrix { .. } | Type::Array { .. }));
        if let (Some(bytes), None) = (known.get(&ty), matrix) {
            return Ok(*bytes);
        }
        let bytes = match found {
            Type::Number { bytes, .. } => u64::from(*bytes),
            Type::Pointer { .. } => ADDRESS_BYTES,
            Type::Vector { element, count } => {
                self.size(*element, None, nesting, known)?.saturating_mul(u64::from(*count))
            }
            Type::Matrix { column, count } => self.matrix_size(*column, *count, matrix, nesting, known)?,
            Type::Array { element, length } => {
                let stride = match self.decoration(ty, Decoration::ArrayStride) {
                    Some(stride) => u64::from(stride),
                    None => self.size(*element, matrix, nesting, known)?,
                };
                stride.saturating_mul(self.array_length(*length)?)
            }
            Type::Struct { members } => self.struct_size(ty, members, nesting, known)?,
            Type::RuntimeArray { .. } => return Err("an array has no length".to_owned()),
            Type::Bool | Type::Image { .. } | Type::SubpassInput { .. } | Type::Opaque(_) => {
                return Err("a member has no size".to_owned());
            }
        };
        if matrix.is_none() {
            known.insert(ty, bytes);
        }
        Ok(bytes)
    }

    fn matrix_size(
        &self,
        column: u32,
        columns: u32,
        layout: Option<(u32, bool)>,
        nesting: u32,
        known: &mut KnownSizes,
    ) -> Result<u64, String> {
        let rows = match self.types.get(&column) {
            Some(Type::Vector { count, .. }) => *count,
            _ => return Err("a matrix has no vectors".to_owned()),
        };
        let Some((stride, row_major)) = layout else {
            return Ok(self.size(column, None, nesting, known)?.saturating_mul(u64::from(columns)));
        };
        Ok(u64::from(stride) * u64::from(if row_major { rows } else { columns }))
    }

    /// Returns the highest end of all members.
    fn struct_size(
        &self,
        ty: u32,
        members: &[u32],
        nesting: u32,
        known: &mut KnownSizes,
    ) -> Result<u64, String> {
        let mut end = 0;
        for (index, member) in (0..).zip(members) {
            let offset =
                self.member_decoration(ty, index, Decoration::Offset).ok_or("a member has no offset")?;
            let bytes = self.size(*member, self.matrix_layout(ty, index), nesting, known)?;
            end = bytes.saturating_add(u64::from(offset)).max(end);
        }
        Ok(end)
    }

    pub(crate) fn array_length(&self, id: u32) -> Result<u64, String> {
        let constant = self.constants.get(&id).ok_or("an array's length is not a plain constant")?;
        Ok(u64::from(constant.value))
    }

    fn collect(&mut self, op: Op, i: &Instruction<'_>, values: &HashMap<u32, u32>) -> Result<(), String> {
        match op {
            Op::Capability => _ = self.capabilities.insert(i.operand(0)),
            Op::EntryPoint => self.entries.push(parse_entry_point(i)),
            Op::ExecutionMode | Op::ExecutionModeId => self.modes.push(Mode {
                function: i.operand(0),
                mode: i.operand(1),
                operands: [i.operand(2), i.operand(3), i.operand(4)],
            }),
            Op::Name => _ = self.names.insert(i.operand(0), i.string(1).0),
            Op::MemberName => {
                self.member_names.insert((i.operand(0), i.operand(1)), i.string(2).0);
            }
            Op::Decorate => _ = self.decorations.insert((i.operand(0), i.operand(1)), i.operand(2)),
            Op::MemberDecorate => {
                let key = (i.operand(0), i.operand(1), i.operand(2));
                self.member_decorations.insert(key, i.operand(3));
            }
            Op::Variable => {
                self.variables.push(Variable { ty: i.operand(0), id: i.operand(1), storage: i.operand(2) });
            }
            Op::Constant => self.add_constant(i, i.operand(2), false),
            Op::ConstantTrue => self.add_constant(i, 1, false),
            Op::ConstantFalse => self.add_constant(i, 0, false),
            Op::SpecConstant | Op::SpecConstantTrue | Op::SpecConstantFalse => {
                let own =
                    if op == Op::SpecConstant { i.operand(2) } else { (op == Op::SpecConstantTrue).into() };
                let given = self.decoration(i.operand(1), Decoration::SpecId).and_then(|id| values.get(&id));
                self.add_constant(i, given.copied().unwrap_or(own), true);
            }
            Op::SpecConstantOp => self.evaluate_spec_op(i),
            Op::ConstantComposite | Op::SpecConstantComposite => {
                self.composites.insert(i.operand(1), [i.operand(2), i.operand(3), i.operand(4)]);
            }
            _ => self.collect_type(op, i)?,
        }
        Ok(())
    }

    fn add_constant(&mut self, i: &Instruction<'_>, value: u32, is_spec: bool) {
        self.constants.insert(i.operand(1), Constant { ty: i.operand(0), value, is_spec });
    }

    /// Evaluates an `OpSpecConstantOp`. Its operands precede it.
    fn evaluate_spec_op(&mut self, i: &Instruction<'_>) {
        let operands = i.operands().get(3..).unwrap_or(&[]);
        let value = match Op::from_u32(i.operand(2)) {
            Some(Op::CompositeExtract) => self.constituent(i.operand(3), i.operand(4)),
            Some(op) => {
                let values: Option<Vec<u32>> = operands.iter().map(|id| self.constant_value(*id)).collect();
                values.and_then(|values| evaluate_spec_constant_op(op, &values))
            }
            None => None,
        };
        if let Some(value) = value {
            self.folded.insert(i.operand(1), value);
        }
    }

    /// Returns one of the first three constituents of a composite constant.
    fn constituent(&self, composite: u32, index: u32) -> Option<u32> {
        let part = self.composites.get(&composite)?.get(index as usize)?;
        self.constant_value(*part)
    }

    /// Returns the low word of a constant, or the value of an operation on constants.
    pub(crate) fn constant_value(&self, id: u32) -> Option<u32> {
        let plain = self.constants.get(&id).map(|constant| constant.value);
        plain.or_else(|| self.folded.get(&id).copied())
    }

    fn collect_type(&mut self, op: Op, i: &Instruction<'_>) -> Result<(), String> {
        let ty = match op {
            Op::TypeBool => Type::Bool,
            Op::TypeFloat => Type::Number { bytes: i.operand(1).div_ceil(8), numbers: NumericFormat::Float },
            Op::TypeInt => Type::Number {
                bytes: i.operand(1).div_ceil(8),
                numbers: if i.operand(2) == 0 { NumericFormat::Uint } else { NumericFormat::Sint },
            },
            Op::TypeVector => Type::Vector { element: i.operand(1), count: i.operand(2) },
            Op::TypeMatrix => Type::Matrix { column: i.operand(1), count: i.operand(2) },
            Op::TypeArray => Type::Array { element: i.operand(1), length: i.operand(2) },
            Op::TypeRuntimeArray => Type::RuntimeArray { element: i.operand(1) },
            Op::TypeStruct => Type::Struct { members: i.operands().get(1..).unwrap_or(&[]).to_vec() },
            Op::TypePointer => {
                self.add_buffer_reference(i.operand(1), i.operand(2));
                Type::Pointer { target: i.operand(2) }
            }
            Op::TypeImage => parse_image_type(i),
            Op::TypeSampler | Op::TypeSampledImage | Op::TypeAccelerationStructureKHR => Type::Opaque(op),
            _ => return Ok(()),
        };
        self.count_nesting(i.operand(0), &ty)?;
        self.types.insert(i.operand(0), ty);
        Ok(())
    }

    /// Fails for a type that contains itself, or that is nested deeper than [`MAX_NESTING`]: code that follows types into
    /// their parts ends.
    fn count_nesting(&mut self, id: u32, ty: &Type) -> Result<(), String> {
        let parts = match ty {
            Type::Vector { element: part, .. }
            | Type::Matrix { column: part, .. }
            | Type::Array { element: part, .. }
            | Type::RuntimeArray { element: part } => std::slice::from_ref(part),
            Type::Struct { members } => members.as_slice(),
            _ => &[],
        };
        let deepest = parts.iter().map(|part| *self.nesting.entry(*part).or_insert(0)).max().unwrap_or(0);
        if deepest >= MAX_NESTING {
            return Err(format!("type {id} is nested deeper than {MAX_NESTING} types"));
        }
        // A pointer may be declared behind the structs that hold it.
        let is_late = self.nesting.insert(id, deepest + 1).is_some();
        if is_late && !matches!(ty, Type::Pointer { .. }) {
            return Err(format!("type {id} is declared twice, or behind a type that contains it"));
        }
        Ok(())
    }

    /// Records the target of a pointer type if it is the block of a buffer reference.
    fn add_buffer_reference(&mut self, storage: u32, target: u32) {
        let is_block = storage == StorageClass::PhysicalStorageBuffer as u32
            && self.decoration(target, Decoration::Block).is_some();
        if is_block {
            self.buffer_references.push(target);
        }
    }
}

fn parse_entry_point(i: &Instruction<'_>) -> EntryPoint {
    let (name, name_words) = i.string(2);
    let interface = i.operands().get(2 + name_words..).unwrap_or(&[]).iter().copied().collect();
    EntryPoint { model: i.operand(0), function: i.operand(1), name, interface }
}

/// Parses an image type. Texel buffers become opaque: the library has no binding for them.
fn parse_image_type(i: &Instruction<'_>) -> Type {
    const SAMPLED: u32 = 1;
    const STORAGE: u32 = 2;
    let dim = i.operand(2);
    match i.operand(6) {
        _ if dim == Dim::DimSubpassData as u32 => {
            Type::SubpassInput { texel: i.operand(1), multisampled: i.operand(5) == 1 }
        }
        _ if dim == Dim::DimBuffer as u32 => Type::Opaque(Op::TypeImage),
        SAMPLED => Type::Image { storage: false },
        STORAGE => Type::Image { storage: true },
        _ => Type::Opaque(Op::TypeImage),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A module of type declarations: opcode and operands of each.
    fn types(declared: &[(Op, &[u32])]) -> Result<ParsedModule, String> {
        let mut words = vec![::spirv::MAGIC_NUMBER, words::VERSION_1_4, 0, 1000, 0];
        for (op, operands) in declared {
            words.push((operands.len() as u32 + 1) << 16 | *op as u32);
            words.extend_from_slice(operands);
        }
        ParsedModule::parse(&words)
    }

    #[test]
    fn types_that_contain_themselves_are_refused() {
        const FLOAT: (Op, &[u32]) = (Op::TypeFloat, &[1, 32]);
        let circles: [&[(Op, &[u32])]; 4] = [
            &[(Op::TypeStruct, &[2, 2])],
            &[FLOAT, (Op::TypeVector, &[2, 2, 3])],
            &[FLOAT, (Op::TypeStruct, &[2, 3]), (Op::TypeStruct, &[3, 2])],
            &[FLOAT, (Op::TypeStruct, &[2, 1]), (Op::TypeArray, &[3, 2, 9]), (Op::TypeStruct, &[2, 3])],
        ];
        for declared in circles {
            assert!(types(declared).unwrap_err().contains("is declared twice, or behind"), "{declared:?}");
        }
        let list: &[(Op, &[u32])] = &[
            (Op::TypeForwardPointer, &[3, StorageClass::PhysicalStorageBuffer as u32]),
            FLOAT,
            (Op::TypeStruct, &[2, 1, 3]),
            (Op::TypePointer, &[3, StorageClass::PhysicalStorageBuffer as u32, 2]),
        ];
        assert!(types(list).is_ok(), "structs may lead to themselves by pointers");
    }

    #[test]
    fn types_nested_too_deeply_are_refused() {
        let operands: Vec<[u32; 2]> = (2..=MAX_NESTING).map(|id| [id, id - 1]).collect();
        let mut nested: Vec<(Op, &[u32])> = vec![(Op::TypeFloat, &[1, 32])];
        nested.extend(operands.iter().map(|operands| (Op::TypeStruct, &operands[..])));
        assert!(types(&nested).is_ok());
        nested.push((Op::TypeStruct, &[MAX_NESTING + 1, MAX_NESTING]));
        assert_eq!(types(&nested).unwrap_err(), "type 65 is nested deeper than 64 types");
    }

    #[test]
    fn nested_structs_with_matrix_layouts_are_sized_once_each() {
        let mut module = ParsedModule::default();
        module.types.insert(1, Type::Number { bytes: 4, numbers: NumericFormat::Float });
        for id in 2..60 {
            module.types.insert(id, Type::Struct { members: vec![id - 1; 3] });
            for index in 0..3 {
                module.member_decorations.insert((id, index, Decoration::Offset as u32), 0);
                module.member_decorations.insert((id, index, Decoration::MatrixStride as u32), 16);
            }
        }
        let mut known = KnownSizes::new();
        assert_eq!(module.size_of(59, &mut known), Ok(4));
        assert_eq!(known.len(), 59);
    }
}
