//! Attributes of hits of triangles: barycentrics, in whatever type the shader declares for them.

use ::spirv::{Op, StorageClass};

use super::emit::Emitter;
use super::linker::Linker;

/// Barycentrics of a hit.
const COUNT: usize = 2;
/// Most types that are looked at for them. Structs without members have no scalars, however many there are.
const MAX_PARTS: usize = 64;

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
    let mut found = Vec::new();
    let mut waiting = vec![Scalar { path: Vec::new(), ty }];
    for _ in 0..MAX_PARTS {
        let Some(part) = waiting.pop().filter(|_| found.len() < COUNT) else { break };
        let Some(inst) = linker.global(part.ty) else { continue };
        let element = |count: u32| vec![inst.operand(1); (count as usize).min(COUNT)];
        let members: Vec<u32> = match inst.op {
            Op::TypeStruct => inst.operands.iter().skip(1).take(MAX_PARTS).copied().collect(),
            Op::TypeVector | Op::TypeMatrix => element(inst.operand(2)),
            Op::TypeArray => element(linker.array_length(part.ty).unwrap_or(0)),
            _ => {
                found.push(part);
                continue;
            }
        };
        // The first member is looked at first.
        let inside = members.into_iter().enumerate().rev();
        waiting.extend(
            inside.map(|(index, ty)| Scalar { path: [&part.path[..], &[index as u32]].concat(), ty }),
        );
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scalars_of_nested_types_have_their_paths() {
        let mut linker = Linker::new(0x0001_0600);
        let (uint, pair) = (linker.uint(), linker.uvec2());
        let pairs = linker.array(pair, 3);
        let paths = |ty| first_scalars(&linker, ty).into_iter().map(|scalar| scalar.path).collect::<Vec<_>>();
        assert_eq!(paths(uint), [Vec::<u32>::new()]);
        assert_eq!(paths(pair), [[0], [1]]);
        assert_eq!(paths(pairs), [[0, 0], [0, 1]]);
        assert!(paths(0xffff).is_empty(), "no type");
    }
}
