//! Finds the atomic operations of a module, by type and storage of their target.

use std::collections::{BTreeSet, HashMap};

use ::spirv::{Op, StorageClass};

use super::words::{Instruction, instructions};

/// A kind of atomic operations that needs a device feature of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Atomic {
    pub(crate) is_float: bool,
    pub(crate) bits: u32,
    /// True for additions, false for exchanges, loads and stores. Integers have only one feature for both.
    pub(crate) is_add: bool,
    pub(crate) place: AtomicStorage,
}

/// The storage of the target of an atomic operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum AtomicStorage {
    Buffer,
    Shared,
    Image,
}

/// Returns the atomic operations on floats and on integers of a size other than 32 bits, each kind once.
pub(crate) fn find_atomics(words: &[u32]) -> Result<Vec<Atomic>, String> {
    let mut ids = AtomicIds::default();
    let mut found = BTreeSet::new();
    for instruction in instructions(words) {
        let instruction = instruction?;
        ids.collect(&instruction);
        found.extend(ids.find_atomic(&instruction));
    }
    Ok(found.into_iter().collect())
}

/// The types of the ids so far. All definitions that matter here precede their uses.
#[derive(Default)]
struct AtomicIds {
    /// Scalar types: true for floats, and their bits.
    scalars: HashMap<u32, (bool, u32)>,
    /// Pointer types: storage class and target type.
    pointer_types: HashMap<u32, (u32, u32)>,
    /// Values: their pointer types.
    pointers: HashMap<u32, u32>,
}

impl AtomicIds {
    fn collect(&mut self, i: &Instruction<'_>) {
        match i.op {
            Some(Op::TypeInt) => _ = self.scalars.insert(i.operand(0), (false, i.operand(1))),
            Some(Op::TypeFloat) => _ = self.scalars.insert(i.operand(0), (true, i.operand(1))),
            Some(Op::TypePointer) => {
                self.pointer_types.insert(i.operand(0), (i.operand(1), i.operand(2)));
            }
            Some(op) if makes_pointers(op) && self.pointer_types.contains_key(&i.operand(0)) => {
                self.pointers.insert(i.operand(1), i.operand(0));
            }
            _ => {}
        }
    }

    fn find_atomic(&self, i: &Instruction<'_>) -> Option<Atomic> {
        let op = i.op.filter(|op| is_atomic(*op))?;
        let pointer = if op == Op::AtomicStore { i.operand(0) } else { i.operand(2) };
        let (storage, target) = self.pointer_types.get(self.pointers.get(&pointer)?)?;
        let (is_float, bits) = *self.scalars.get(target)?;
        let is_add = is_float && !matches!(op, Op::AtomicLoad | Op::AtomicStore | Op::AtomicExchange);
        let place = atomic_storage(*storage)?;
        (is_float || bits != 32).then_some(Atomic { is_float, bits, is_add, place })
    }
}

fn atomic_storage(storage: u32) -> Option<AtomicStorage> {
    use StorageClass::{Image, PhysicalStorageBuffer, StorageBuffer, Workgroup};
    let places = [
        (StorageBuffer, AtomicStorage::Buffer),
        (PhysicalStorageBuffer, AtomicStorage::Buffer),
        (Workgroup, AtomicStorage::Shared),
        (Image, AtomicStorage::Image),
    ];
    places.into_iter().find(|(class, _)| *class as u32 == storage).map(|(_, place)| place)
}

/// True if the result can be a pointer. The result type is the first operand, the result the second.
fn makes_pointers(op: Op) -> bool {
    use Op::{
        AccessChain, Bitcast, ConvertUToPtr, CopyObject, FunctionCall, FunctionParameter, ImageTexelPointer,
        InBoundsAccessChain, InBoundsPtrAccessChain, Load, Phi, PtrAccessChain, Select, Variable,
    };
    matches!(
        op,
        AccessChain
            | Bitcast
            | ConvertUToPtr
            | CopyObject
            | FunctionCall
            | FunctionParameter
            | ImageTexelPointer
            | InBoundsAccessChain
            | InBoundsPtrAccessChain
            | Load
            | Phi
            | PtrAccessChain
            | Select
            | Variable
    )
}

fn is_atomic(op: Op) -> bool {
    (Op::AtomicLoad as u32..=Op::AtomicXor as u32).contains(&(op as u32))
        || matches!(op, Op::AtomicFAddEXT | Op::AtomicFMinEXT | Op::AtomicFMaxEXT)
}

#[cfg(all(test, feature = "glsl"))]
mod tests {
    #![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]
    use super::*;
    use crate::shader::{CompileFiles, CompileOptions, ShaderModuleDesc, ShaderSource, ShaderStage, compile};

    fn found(body: &str) -> Vec<Atomic> {
        let text = format!(
            "layout(local_size_x = 1) in;
             layout(buffer_reference, scalar) buffer Data {{ uint u; float f; uint64_t l; double d; }};
             layout(push_constant, scalar) uniform Push {{ Data data; }};
             LVK_STORAGE_IMAGES_2D(r32f, kFloats);
             shared float sf; shared uint64_t sl;
             void main() {{ {body} }}"
        );
        let desc = ShaderModuleDesc {
            stage: ShaderStage::Compute,
            source: ShaderSource::Glsl(&text),
            ..Default::default()
        };
        find_atomics(&compile(&desc, &CompileOptions::default(), CompileFiles::default()).unwrap()).unwrap()
    }

    #[test]
    fn atomics_are_told_by_value_and_place() {
        let one = |is_float, bits, is_add, place| vec![Atomic { is_float, bits, is_add, place }];
        assert_eq!(found("atomicAdd(data.u, 1u); data.f = 1.0;"), []);
        assert_eq!(found("atomicMax(data.l, 1ul);"), one(false, 64, false, AtomicStorage::Buffer));
        assert_eq!(found("atomicExchange(sl, 1ul);"), one(false, 64, false, AtomicStorage::Shared));
        assert_eq!(found("atomicAdd(data.f, 1.0);"), one(true, 32, true, AtomicStorage::Buffer));
        assert_eq!(found("atomicExchange(data.f, 1.0);"), one(true, 32, false, AtomicStorage::Buffer));
        assert_eq!(found("atomicExchange(sf, 1.0);"), one(true, 32, false, AtomicStorage::Shared));
        assert_eq!(
            found("imageAtomicAdd(kFloats[0], ivec2(0), 1.0);"),
            one(true, 32, true, AtomicStorage::Image)
        );
        assert_eq!(found("atomicAdd(data.d, 1.0);"), one(true, 64, true, AtomicStorage::Buffer));
        assert_eq!(found("atomicAdd(sf, 1.0); atomicAdd(sf, 2.0); atomicAdd(data.f, 1.0);").len(), 2);
    }
}
