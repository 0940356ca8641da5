//! Attributes of hits of triangles: barycentrics, in whatever type the shader declares for them.

use ::spirv::{Op, StorageClass};

use super::emit::Emitter;
use super::linker::Linker;

/// Barycentrics of a hit.
const COUNT: usize = 2;

/// A scalar within a type: the indices that lead to it, and its own type.
struct Scalar {
    path: Vec<u32>,
    ty: u32,
}

/// Fails for attributes that cannot hold barycentrics: those whose first two scalars have not 32 bits each. The error is a message.
pub(super) fn check_barycentrics(linker: &Linker, attributes: u32) -> Result<(), String> {
    const BITS: u32 = 32;
    let ty = linker.variable_type(attributes).unwrap_or(0);
    let is_word = |scalar: &Scalar| {
        linker
            .global(scalar.ty)
            .is_some_and(|inst| matches!(inst.op, Op::TypeFloat | Op::TypeInt) && inst.operand(1) == BITS)
    };
    match first_scalars(linker, ty).iter().all(is_word) {
        true => Ok(()),
        false => Err("OpVariable of hit attributes cannot hold the barycentrics of triangles; its first two scalars must be \
                      floats of 32 bits"
            .to_owned()),
    }
}

/// Stores barycentrics in the first scalars of the attributes.
pub(super) fn emit_barycentrics(emitter: &mut Emitter<'_>, barycentrics: u32, attributes: u32) {
    let vector = emitter.linker.variable_type(barycentrics).unwrap_or(0);
    let float = emitter.linker.global(vector).map_or(0, |inst| inst.operand(1));
    let ty = emitter.linker.variable_type(attributes).unwrap_or(0);
    let value = emitter.load(barycentrics);
    for (index, Scalar { path, ty }) in (0..).zip(first_scalars(emitter.linker, ty)) {
        let part = emitter.value(Op::CompositeExtract, float, &[value, index]);
        let part = emitter.convert(part, float, ty);
        let place = match path.is_empty() {
            true => attributes,
            false => {
                let pointer = emitter.linker.pointer_to(StorageClass::Private, ty);
                let steps: Vec<u32> = path.iter().map(|step| emitter.linker.constant(*step)).collect();
                let chain: Vec<u32> = [attributes].into_iter().chain(steps).collect();
                emitter.value(Op::AccessChain, pointer, &chain)
            }
        };
        emitter.store(place, part);
    }
}

/// The first two scalars of a type, in the order of its members.
fn first_scalars(linker: &Linker, ty: u32) -> Vec<Scalar> {
    let Some(inst) = linker.global(ty) else { return Vec::new() };
    let members: Vec<u32> = match inst.op {
        Op::TypeStruct => inst.operands.iter().skip(1).copied().collect(),
        Op::TypeVector | Op::TypeMatrix => vec![inst.operand(1); (inst.operand(2) as usize).min(COUNT)],
        Op::TypeArray => {
            let length = linker.array_length(ty).unwrap_or(0);
            vec![inst.operand(1); (length as usize).min(COUNT)]
        }
        _ => return vec![Scalar { path: Vec::new(), ty }],
    };
    let inside = (0..).zip(members).flat_map(|(index, member)| {
        let scalars = first_scalars(linker, member).into_iter();
        scalars.map(move |Scalar { path, ty }| Scalar { path: [vec![index], path].concat(), ty })
    });
    inside.take(COUNT).collect()
}
