//! Adds a check of every index of a bindless array before its use.

use std::collections::{HashMap, HashSet};

use ::spirv::{AddressingModel, Capability, Decoration, Op, StorageClass};

use crate::bindless::index_checks::{BindlessArray, CheckPlan};
use crate::bindless::layout;
use crate::shader::spirv::link::{LinkedFunction, ModuleSections, push_instruction};
use crate::shader::spirv::parsed::{ParsedModule, Type};
use crate::shader::spirv::words::{self, Instruction, instructions};

/// The words of `glsl/checked_index.glsl`.
const DONOR: &[u8] = include_bytes!("../../glsl/checked_index.spv");
const FUNCTION: &str = "lvkCheckedIndex(";
/// The first version that includes casts of addresses to pointers.
const VERSION_1_5: u32 = 0x0001_0500;

/// Returns the module with a check of every index of a bindless array, or the reason why that is impossible.
///
/// Arrays of Y'CbCr samplers accept only constant indices and are left unchanged.
pub(crate) fn with_checked_indices(words: &[u32], plan: &CheckPlan) -> Result<Vec<u32>, String> {
    let module = ParsedModule::parse(words)?;
    let arrays = find_bindless_arrays(&module);
    if arrays.is_empty() {
        return Ok(words.to_vec());
    }
    if words::version(words) < VERSION_1_5 {
        return Err("its SPIR-V is older than version 1.5".to_owned());
    }
    if module.has_capability(Capability::VulkanMemoryModel) {
        return Err("it uses Vulkan's own memory model".to_owned());
    }
    let mut sections = ModuleSections::parse(words)?;
    let body = std::mem::take(&mut sections.functions);
    let donor: Vec<u32> = DONOR.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    let imported = sections.link_function(&donor, FUNCTION)?;
    let helper = std::mem::take(&mut sections.functions);
    let checked = Checker::new(&mut sections, words, plan, &imported)?.rewrite_access(&arrays, &body)?;
    sections.functions = [checked, helper].concat();
    enable_buffer_addresses(&mut sections, &module);
    Ok(sections.words())
}

/// Returns the variables that are a bindless array or the table beside `kTLAS`. The value is the array and the position
/// of the index in an access.
fn find_bindless_arrays(module: &ParsedModule) -> HashMap<u32, (BindlessArray, usize)> {
    let found = |variable: &crate::shader::spirv::parsed::Variable| {
        let set = module.decoration(variable.id, Decoration::DescriptorSet)?;
        let binding = module.decoration(variable.id, Decoration::Binding)?;
        let Type::Pointer { target } = module.types.get(&variable.ty)? else { return None };
        let is_array = matches!(module.types.get(target)?, Type::Array { .. } | Type::RuntimeArray { .. });
        let array = match binding {
            _ if set != layout::SET => return None,
            layout::TLAS_TABLE if variable.storage == StorageClass::StorageBuffer as u32 => {
                return Some((variable.id, (BindlessArray::AccelStructs, 1)));
            }
            layout::SAMPLED_IMAGES => BindlessArray::Textures,
            layout::SAMPLERS => BindlessArray::Samplers,
            layout::STORAGE_IMAGES => BindlessArray::StorageImages,
            layout::ACCEL_STRUCTS => BindlessArray::AccelStructs,
            _ => return None,
        };
        is_array.then_some((variable.id, (array, 0)))
    };
    module.variables.iter().filter_map(found).collect()
}

/// Declares the capability and the extension for buffer addresses.
fn enable_buffer_addresses(sections: &mut ModuleSections, module: &ParsedModule) {
    if !module.has_capability(Capability::PhysicalStorageBufferAddresses) {
        let capability = Capability::PhysicalStorageBufferAddresses as u32;
        push_instruction(&mut sections.capabilities, Op::Capability, &[capability]);
    }
    let mut at = 0;
    while let Some(&first) = sections.annotations.get(at) {
        if first & 0xFFFF == Op::MemoryModel as u32
            && let Some(model) = sections.annotations.get_mut(at + 1)
        {
            *model = AddressingModel::PhysicalStorageBuffer64 as u32;
            return;
        }
        at += (first >> 16).max(1) as usize;
    }
}

/// Rewrites function bodies.
struct Checker<'a> {
    sections: &'a mut ModuleSections,
    imported: &'a LinkedFunction,
    address: u32,
    shader: u32,
    /// For each array: its number, the position of its first word, its length, and the position of its declarations.
    arrays: Vec<[u32; 4]>,
    /// The constants 0 and 1.
    no_yes: [u32; 2],
    /// Bits of integer types.
    integers: HashMap<u32, u32>,
    /// Types of constants and of the values so far.
    types: HashMap<u32, u32>,
    type_ids: HashSet<u32>,
    non_uniform: HashSet<u32>,
}

impl<'a> Checker<'a> {
    fn new(
        sections: &'a mut ModuleSections,
        words: &[u32],
        plan: &CheckPlan,
        imported: &'a LinkedFunction,
    ) -> Result<Self, String> {
        let word = imported.word;
        let halves =
            [plan.address as u32, (plan.address >> 32) as u32].map(|half| sections.add_constant(word, half));
        let address = sections.new_id();
        push_instruction(
            &mut sections.globals,
            Op::ConstantComposite,
            &[imported.address, address, halves[0], halves[1]],
        );
        let shader = sections.add_constant(word, plan.shader);
        let arrays = (0..).zip(plan.arrays);
        let arrays = arrays
            .map(|(number, range)| {
                let declarations = plan.declarations_of(number as usize);
                [number, range.first, range.count, declarations]
                    .map(|value| sections.add_constant(word, value))
            })
            .collect();
        let no_yes = [0, 1].map(|value| sections.add_constant(word, value));
        let mut checker = Self {
            sections,
            imported,
            address,
            shader,
            arrays,
            no_yes,
            integers: HashMap::new(),
            types: HashMap::new(),
            type_ids: HashSet::new(),
            non_uniform: HashSet::new(),
        };
        for instruction in instructions(words) {
            let instruction = instruction?;
            match instruction.op {
                Some(Op::Function) => break,
                _ => checker.collect(&instruction),
            }
        }
        Ok(checker)
    }

    fn collect(&mut self, i: &Instruction<'_>) {
        match i.op {
            Some(Op::TypeInt) => _ = self.integers.insert(i.operand(0), i.operand(1)),
            Some(Op::Decorate) if i.operand(1) == Decoration::NonUniform as u32 => {
                self.non_uniform.insert(i.operand(0));
            }
            _ => {}
        }
        if is_type(i) {
            self.type_ids.insert(i.operand(0));
        } else if self.type_ids.contains(&i.operand(0)) {
            // Only a result type can be the first operand and a type.
            self.types.insert(i.operand(1), i.operand(0));
        }
    }

    fn rewrite_access(
        mut self,
        arrays: &HashMap<u32, (BindlessArray, usize)>,
        body: &[u32],
    ) -> Result<Vec<u32>, String> {
        let body = [&self.sections.header, body].concat();
        let written = find_written_accesses(&body)?;
        let mut out = Vec::with_capacity(body.len());
        for instruction in instructions(&body) {
            let instruction = instruction?;
            self.collect(&instruction);
            let is_access = matches!(instruction.op, Some(Op::AccessChain | Op::InBoundsAccessChain));
            let array = arrays.get(&instruction.operand(2)).filter(|_| is_access);
            // The indices follow type, result and base.
            let index = array.map(|(_, position)| 3 + position);
            match (array, index.filter(|index| *index < instruction.operands().len())) {
                (Some((array, _)), Some(index)) => {
                    let checked = self.emit_check_call(&mut out, *array, &instruction, index, &written)?;
                    let at = out.len();
                    out.extend(instruction.words);
                    out[at + 1 + index] = checked;
                }
                _ => out.extend(instruction.words),
            }
        }
        Ok(out)
    }

    /// Emits a call of the check for one index. Returns the id of the result.
    fn emit_check_call(
        &mut self,
        out: &mut Vec<u32>,
        array: BindlessArray,
        access: &Instruction<'_>,
        index: usize,
        written: &HashSet<u32>,
    ) -> Result<u32, String> {
        let (word, result) = (self.imported.word, self.imported.result);
        let index = access.operand(index);
        let ty = self.types.get(&index).copied().ok_or("the type of an index is unknown")?;
        let bits = self.integers.get(&ty).copied().ok_or("an index is no integer")?;
        let marked = self.non_uniform.contains(&index) || self.non_uniform.contains(&access.operand(1));
        let plain = match ty == word {
            true => index,
            false => {
                let id = self.sections.new_id();
                let op = if bits == 32 { Op::Bitcast } else { Op::UConvert };
                push_instruction(out, op, &[word, id, index]);
                id
            }
        };
        let checked = self.sections.new_id();
        let [number, first, count, declarations] = self.arrays[array as usize];
        let writes = self.no_yes[usize::from(written.contains(&access.operand(1)))];
        let (function, address, shader) = (self.imported.function, self.address, self.shader);
        let arguments = [address, shader, number, first, count, declarations, writes, plain];
        let call = [&[result, checked, function][..], &arguments].concat();
        push_instruction(out, Op::FunctionCall, &call);
        if marked {
            push_instruction(
                &mut self.sections.annotations,
                Op::Decorate,
                &[checked, Decoration::NonUniform as u32],
            );
        }
        Ok(checked)
    }
}

/// Returns the accesses whose images are written, or changed by atomic operations, by functions that they are passed to as well.
fn find_written_accesses(body: &[u32]) -> Result<HashSet<u32>, String> {
    // Of values and parameters: those that they come from.
    let mut sources: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut parameters: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut calls = Vec::new();
    let (mut function, mut open) = (0, Vec::new());
    for instruction in instructions(body) {
        let i = instruction?;
        match i.op {
            Some(Op::Load | Op::CopyObject) => sources.entry(i.operand(1)).or_default().push(i.operand(2)),
            Some(Op::Function) => function = i.operand(1),
            Some(Op::FunctionParameter) => parameters.entry(function).or_default().push(i.operand(1)),
            Some(Op::FunctionCall) => calls.push(i.operands()),
            Some(Op::ImageWrite) => open.push(i.operand(0)),
            Some(Op::ImageTexelPointer) => open.push(i.operand(2)),
            _ => {}
        }
    }
    for call in calls {
        let [_, _, callee, arguments @ ..] = call else { continue };
        let of_callee = parameters.get(callee).map_or(&[][..], Vec::as_slice);
        for (parameter, argument) in of_callee.iter().zip(arguments) {
            sources.entry(*parameter).or_default().push(*argument);
        }
    }
    let mut written = HashSet::new();
    while let Some(id) = open.pop() {
        if written.insert(id) {
            open.extend(sources.get(&id).into_iter().flatten());
        }
    }
    Ok(written)
}

/// True for types. Their first operand is their own id.
fn is_type(i: &Instruction<'_>) -> bool {
    let number = i.words.first().map_or(0, |word| word & 0xFFFF);
    (Op::TypeVoid as u32..=Op::TypePipe as u32).contains(&number)
        || matches!(i.op, Some(Op::TypeAccelerationStructureKHR | Op::TypeRayQueryKHR))
}

#[cfg(all(test, feature = "glsl"))]
mod tests {
    #![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]
    use super::*;
    use crate::bindless::index_checks::{self, WordRange};
    use crate::shader::spirv::reflect::reflect;
    use crate::shader::{CompileFiles, CompileOptions, ShaderModuleDesc, ShaderSource, ShaderStage, compile};

    fn compiled(stage: ShaderStage, text: &str) -> Vec<u32> {
        let desc = ShaderModuleDesc { stage, source: ShaderSource::Glsl(text), ..Default::default() };
        compile(&desc, &CompileOptions::default(), CompileFiles::default()).unwrap()
    }

    fn plan() -> CheckPlan {
        let arrays = [7, 17, 27, 37].map(|first| WordRange { first, count: 5 });
        CheckPlan { address: 0x1234_5678_9abc_def0, shader: 3, arrays, declarations: 90 }
    }

    /// Returns the array of each call of the check, and 1 for an access that writes.
    fn calls(words: &[u32]) -> Vec<[u32; 2]> {
        let code: Vec<_> = instructions(words).map(Result::unwrap).collect();
        let value = |id: u32| {
            code.iter().find(|i| i.op == Some(Op::Constant) && i.operand(1) == id).unwrap().operand(2)
        };
        let calls = code.iter().filter(|i| i.op == Some(Op::FunctionCall) && i.operands().len() == 11);
        calls
            .map(|call| {
                assert_eq!(value(call.operand(4)), 3);
                let array = value(call.operand(5));
                assert_eq!(value(call.operand(6)), 7 + 10 * array);
                assert_eq!(value(call.operand(8)), if array % 2 == 0 { 90 } else { 0 });
                [array, value(call.operand(9))]
            })
            .collect()
    }

    /// `LVK_UPDATE_KERNELS=1 cargo test -p lvk kernel` rewrites the words.
    #[test]
    fn the_kernel_of_checks_is_that_of_its_source() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/shader/glsl");
        let text = std::fs::read_to_string(folder.join("checked_index.glsl")).unwrap();
        let words = compiled(ShaderStage::Compute, &text);
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        if std::env::var("LVK_UPDATE_KERNELS").is_ok() {
            std::fs::write(folder.join("checked_index.spv"), bytes).unwrap();
        } else {
            assert!(bytes == DONOR, "set LVK_UPDATE_KERNELS=1 once");
        }
        assert!(text.contains(&format!("ENTRY_COUNT = {}u", index_checks::ENTRY_COUNT)));
    }

    #[test]
    fn every_access_of_every_array_is_checked() {
        let text = "
            layout(local_size_x = 1) in;
            layout(push_constant, scalar) uniform Push { uint a; int b; uint64_t c; };
            LVK_STORAGE_IMAGES_U2D(r32ui, kCounts);
            void main() {
                vec4 c = textureBindless2D(a, uint(b), vec2(0.5));
                imageStore(kImages2D[b], ivec2(0), c + texelFetch(kTextures2D[uint(c.x)], ivec2(0), 0));
                imageAtomicAdd(kCounts[nonuniformEXT(a + 1)], ivec2(0), 1u);
            }";
        let words = compiled(ShaderStage::Compute, text);
        let checked = with_checked_indices(&words, &plan()).unwrap();
        let mut found = calls(&checked);
        found.sort_unstable();
        assert_eq!(found, [[0, 0], [0, 0], [1, 0], [2, 1], [2, 1]]);
        let before = reflect("", ShaderStage::Compute, &words).unwrap();
        let after = reflect("", ShaderStage::Compute, &checked).unwrap();
        assert_eq!(
            (before.bindings, before.push_constant_bytes),
            (after.bindings, after.push_constant_bytes)
        );
    }

    /// An image that a function writes counts as written by the callers of the function, through further functions too.
    #[test]
    fn images_that_functions_write_are_written() {
        let text = "
            layout(local_size_x = 1) in;
            layout(push_constant, scalar) uniform Push { uint a; uint b; uint c; };
            void put(writeonly image2D image, vec4 color) { imageStore(image, ivec2(0), color); }
            void putTwice(writeonly image2D image) { put(image, vec4(1)); put(image, vec4(2)); }
            ivec2 sizeOf(writeonly image2D image) { return imageSize(image); }
            void main() {
                putTwice(kImages2D[a]);
                if (sizeOf(kImages2D[b]).x > 1) put(kImages2D[c], vec4(0));
            }";
        let words = compiled(ShaderStage::Compute, text);
        let mut found = calls(&with_checked_indices(&words, &plan()).unwrap());
        found.sort_unstable();
        assert_eq!(found, [[2, 0], [2, 1], [2, 1]]);
    }

    #[test]
    fn types_are_declared_once_and_ids_are_below_the_bound() {
        let text = "void main() { gl_Position = textureBindless2D(gl_VertexIndex, 0, vec2(0)); }";
        let words = compiled(ShaderStage::Vertex, text);
        let checked = with_checked_indices(&words, &plan()).unwrap();
        let mut shapes = HashSet::new();
        let mut results = HashSet::new();
        for i in instructions(&checked).map(Result::unwrap) {
            if matches!(
                i.op,
                Some(Op::TypeInt | Op::TypeVoid | Op::TypeVector | Op::TypePointer | Op::TypeFunction)
            ) {
                assert!(results.insert(i.operand(0)) && i.operand(0) < checked[3]);
                let mut shape = i.words.to_vec();
                shape[1] = 0;
                assert!(shapes.insert(shape), "{i:?} is declared twice");
            }
        }
        assert_eq!(instructions(&checked).flatten().filter(|i| i.op == Some(Op::MemoryModel)).count(), 1);
    }

    #[test]
    fn modules_without_arrays_stay_as_they_are() {
        let words = compiled(ShaderStage::Vertex, "void main() { gl_Position = vec4(0); }");
        assert_eq!(with_checked_indices(&words, &plan()).unwrap(), words);
        let mut old =
            compiled(ShaderStage::Vertex, "void main() { gl_Position = textureBindless2D(1, 0, vec2(0)); }");
        old[1] = 0x0001_0300;
        assert!(with_checked_indices(&old, &plan()).unwrap_err().contains("1.5"));
    }

    proptest::proptest! {
        #[test]
        fn damaged_modules_never_panic(
            at in proptest::prelude::any::<proptest::sample::Index>(), bit in 0u32..32, cut in 0usize..400
        ) {
            let mut words = compiled(ShaderStage::Vertex, "void main() { gl_Position = textureBindless2D(1, 0, vec2(0)); }");
            let at = at.index(words.len());
            words[at] ^= 1 << bit;
            words.truncate(words.len().saturating_sub(cut / 8));
            let _ = with_checked_indices(&words, &plan());
        }
    }
}
