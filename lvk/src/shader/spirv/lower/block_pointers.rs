//! Rewrites accesses of shader records and push constants, which lowered shaders read by address.

use std::collections::{HashMap, HashSet};

use ::spirv::{Decoration, MemoryAccess, Op, StorageClass};

use super::emit::Emitter;
use super::instruction::{Inst, used_ids};
use super::linker::Linker;

/// Alignment of a block in bytes, which is also the largest that an access claims.
const BLOCK_ALIGNMENT: u32 = 16;

/// Makes `functions` read the block of `variable` at the address that the variable `address` holds. The error is a
/// message.
pub(super) fn read_block_by_address(
    linker: &mut Linker,
    functions: &[u32],
    variable: u32,
    address: u32,
) -> Result<(), String> {
    let layout = Layout::collect(linker);
    let block = linker.variable_type(variable).unwrap_or(0);
    let pointer = linker.pointer_to(StorageClass::PhysicalStorageBuffer, block);
    for id in functions {
        let Some(mut function) = linker.take_function(*id) else { continue };
        let mut alignments = HashMap::new();
        for block in &mut function.blocks {
            let mut code = Vec::with_capacity(block.code.len());
            for mut inst in std::mem::take(&mut block.code) {
                if used_ids(&inst, &linker.module.wide).contains(&variable) {
                    let mut emitter = Emitter::new(linker, &mut code);
                    let words = emitter.load(address);
                    let base = emitter.value(Op::Bitcast, pointer, &[words]);
                    alignments.insert(base, (BLOCK_ALIGNMENT, pointer));
                    inst.operands.iter_mut().filter(|id| **id == variable).for_each(|id| *id = base);
                }
                convert_pointer(linker, &mut inst, &alignments)?;
                layout.follow(linker, &inst, &mut alignments);
                add_alignment(&mut inst, &alignments);
                code.push(inst);
            }
            block.code = code;
        }
        linker.module.functions.push(function);
    }
    Ok(())
}

/// Gives a pointer that is made from a pointer to a block its storage class.
fn convert_pointer(
    linker: &mut Linker,
    inst: &mut Inst,
    pointers: &HashMap<u32, (u32, u32)>,
) -> Result<(), String> {
    if !used_ids(inst, &linker.module.wide).iter().any(|id| pointers.contains_key(id)) {
        return Ok(());
    }
    match inst.op {
        Op::AccessChain | Op::InBoundsAccessChain => {
            let target = linker.pointer(inst.operand(0)).map_or(0, |(_, target)| target);
            inst.operands[0] = linker.pointer_to(StorageClass::PhysicalStorageBuffer, target);
            Ok(())
        }
        Op::Load | Op::ArrayLength => Ok(()),
        op => Err(format!("Op{op:?} of a block of push constants or of a shader record cannot be lowered")),
    }
}

/// States the alignment of a read, which may state other properties.
fn add_alignment(inst: &mut Inst, alignments: &HashMap<u32, (u32, u32)>) {
    let aligned = MemoryAccess::ALIGNED.bits();
    let found = alignments.get(&inst.operand(2)).filter(|_| inst.op == Op::Load);
    let Some((alignment, _)) = found else { return };
    match inst.operands.get_mut(3) {
        None => inst.operands.extend([aligned, *alignment]),
        Some(properties) if *properties & aligned == 0 => {
            *properties |= aligned;
            inst.operands.insert(4, *alignment);
        }
        Some(_) => {}
    }
}

/// Offsets and strides of types in bytes.
struct Layout {
    offsets: HashMap<(u32, u32), u32>,
    matrix_strides: HashMap<(u32, u32), u32>,
    /// Members whose matrices lie row by row.
    row_major: HashSet<(u32, u32)>,
    array_strides: HashMap<u32, u32>,
}

impl Layout {
    fn collect(linker: &Linker) -> Self {
        let mut found = Self {
            offsets: HashMap::new(),
            matrix_strides: HashMap::new(),
            row_major: HashSet::new(),
            array_strides: HashMap::new(),
        };
        for inst in &linker.module.decorations {
            let (id, second, third) = (inst.operand(0), inst.operand(1), inst.operand(2));
            let is = |word: u32, decoration: Decoration| word == decoration as u32;
            match inst.op {
                Op::Decorate if is(second, Decoration::ArrayStride) => {
                    found.array_strides.insert(id, third);
                }
                Op::MemberDecorate if is(third, Decoration::Offset) => {
                    found.offsets.insert((id, second), inst.operand(3));
                }
                Op::MemberDecorate if is(third, Decoration::RowMajor) => {
                    found.row_major.insert((id, second));
                }
                Op::MemberDecorate if is(third, Decoration::MatrixStride) => {
                    found.matrix_strides.insert((id, second), inst.operand(3));
                }
                _ => {}
            }
        }
        found
    }

    /// Records the alignment of the pointer that an instruction makes from another pointer to a block.
    fn follow(&self, linker: &Linker, inst: &Inst, alignments: &mut HashMap<u32, (u32, u32)>) {
        if !matches!(inst.op, Op::AccessChain | Op::InBoundsAccessChain) {
            return;
        }
        let Some((base, pointer)) = alignments.get(&inst.operand(2)).copied() else { return };
        let mut alignment = base;
        let mut ty = linker.pointer(pointer).map_or(0, |(_, target)| target);
        // Distances of the columns of a matrix, and of the rows if they are not side by side.
        let (mut stride, mut is_row_major, mut row_stride) = (0, false, None);
        for index in &inst.operands[3..] {
            let Some(found) = linker.global(ty) else { break };
            let step = match found.op {
                Op::TypeStruct => {
                    let member = linker.global(*index).map_or(0, |constant| constant.operand(2));
                    stride = self.matrix_strides.get(&(ty, member)).copied().unwrap_or(0);
                    is_row_major = self.row_major.contains(&(ty, member));
                    let offset = self.offsets.get(&(ty, member)).copied().unwrap_or(0);
                    ty = found.operand(1 + member as usize);
                    offset
                }
                Op::TypeArray | Op::TypeRuntimeArray => {
                    let stride = self.array_strides.get(&ty).copied().unwrap_or(0);
                    ty = found.operand(1);
                    stride
                }
                Op::TypeMatrix => {
                    ty = found.operand(1);
                    row_stride = is_row_major.then_some(stride);
                    if is_row_major { scalar_bytes(linker, ty) } else { stride }
                }
                _ => {
                    let scalar = scalar_bytes(linker, ty);
                    ty = found.operand(1);
                    row_stride.take().unwrap_or(scalar)
                }
            };
            alignment = alignment_behind(alignment, step);
        }
        if let Some(result) = inst.result() {
            alignments.insert(result, (alignment, inst.operand(0)));
        }
    }
}

/// Returns the bytes of a component of a vector.
fn scalar_bytes(linker: &Linker, vector: u32) -> u32 {
    let scalar = linker.global(vector).and_then(|vector| linker.global(vector.operand(1)));
    scalar.map_or(4, |scalar| scalar.operand(1) / 8)
}

/// Returns the alignment of an address `step` bytes behind an aligned one.
fn alignment_behind(alignment: u32, step: u32) -> u32 {
    if step == 0 { alignment } else { alignment.min(1 << step.trailing_zeros()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_read_by_address_states_an_alignment() {
        let pointers = HashMap::from([(7, (8, 0))]);
        let read = |operands: &[u32]| {
            let mut inst = Inst::new(Op::Load, operands);
            add_alignment(&mut inst, &pointers);
            inst.operands.to_vec()
        };
        let (volatile, aligned) = (MemoryAccess::VOLATILE.bits(), MemoryAccess::ALIGNED.bits());
        assert_eq!(read(&[1, 2, 7]), [1, 2, 7, aligned, 8]);
        assert_eq!(read(&[1, 2, 7, volatile]), [1, 2, 7, volatile | aligned, 8]);
        assert_eq!(read(&[1, 2, 7, aligned, 4]), [1, 2, 7, aligned, 4]);
        assert_eq!(read(&[1, 2, 6]), [1, 2, 6], "a pointer to something else");
    }
}
