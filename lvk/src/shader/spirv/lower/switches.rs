//! Selects the targets of switches by values.

use std::collections::HashMap;

use ::spirv::Op;

use super::emit::Emitter;
use super::instruction::Inst;
use super::linker::Linker;

/// Most cases of a switch (SPIR-V, universal limits).
const MOST_CASES: usize = 16_383;

/// Fails for a switch with more cases than SPIR-V allows. The error is a message.
pub(super) fn check_cases(count: usize) -> Result<(), String> {
    if count <= MOST_CASES {
        return Ok(());
    }
    Err(format!(
        "functions that trace rays or call shaders call each other too often: an OpSwitch over them would have {count} cases, and \
         SPIR-V allows {MOST_CASES}"
    ))
}

/// Makes switches over 64 bits switches over the number of the case, in 32 bits: the targets of all switches stand in the
/// same places then.
pub(super) fn narrow_switches(linker: &mut Linker, functions: &[u32]) {
    for id in functions {
        let Some(mut function) = linker.take_function(*id) else { continue };
        let definitions = function.definitions();
        for block in &mut function.blocks {
            let is_wide =
                |inst: &mut Inst| inst.op == Op::Switch && linker.module.wide.contains(&inst.operand(0));
            let Some(switch) = block.code.pop_if(is_wide) else { continue };
            let merge = block.code.pop_if(|inst| inst.op == Op::SelectionMerge);
            let narrow = narrowed(linker, &definitions, &switch, &mut block.code);
            block.code.extend(merge);
            block.code.push(narrow);
        }
        linker.module.functions.push(function);
    }
}

fn narrowed(
    linker: &mut Linker,
    definitions: &HashMap<u32, Inst>,
    switch: &Inst,
    code: &mut Vec<Inst>,
) -> Inst {
    let (selector, default) = (switch.operand(0), switch.operand(1));
    let ty = linker.value_type(definitions, selector);
    let cases = switch.operands.get(2..).unwrap_or_default().as_chunks::<3>().0;
    let numbers: Vec<([u32; 2], u32)> =
        (1..).zip(cases).map(|(number, [low, high, _])| ([*low, *high], number)).collect();
    let literals = numbers.iter().map(|(literal, number)| (&literal[..], *number));
    let number = emit_choice(&mut Emitter::new(linker, code), (selector, ty), literals, 0);
    let targets = numbers.iter().zip(cases).flat_map(|((_, number), case)| [*number, case[2]]);
    let words: Vec<u32> = [number, default].into_iter().chain(targets).collect();
    Inst::new(Op::Switch, &words)
}

/// Returns the number beside the literal that a selector equals, or the default. `selector` is a value and its type.
pub(super) fn emit_choice<'a>(
    emitter: &mut Emitter<'_>,
    selector: (u32, u32),
    numbers: impl Iterator<Item = (&'a [u32], u32)>,
    default: u32,
) -> u32 {
    let (uint, bool) = (emitter.linker.uint(), emitter.linker.bool());
    let mut chosen = emitter.linker.constant(default);
    for (literal, number) in numbers {
        let literal = emitter.linker.constant_of(selector.1, literal);
        let number = emitter.linker.constant(number);
        let is_it = emitter.value(Op::IEqual, bool, &[selector.0, literal]);
        chosen = emitter.value(Op::Select, uint, &[is_it, number, chosen]);
    }
    chosen
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test")]
mod tests {
    use super::super::module::{Block, Function};
    use super::*;

    /// GLSL has no switch over 64 bits, so the words are written here.
    #[test]
    fn more_cases_than_spirv_allows_are_refused() {
        assert_eq!(check_cases(16_383), Ok(()));
        assert!(
            check_cases(16_384)
                .is_err_and(|message| message.contains("OpSwitch") && message.contains("16384"))
        );
    }

    #[test]
    fn a_switch_over_64_bits_becomes_one_over_the_numbers_of_its_cases() {
        const SELECTOR: u32 = 700;
        let mut linker = Linker::default();
        let (long, uint, bool) = (linker.new_id(), linker.uint(), linker.bool());
        linker.module.wide.insert(SELECTOR);
        let code = vec![
            Inst::new(Op::UConvert, &[long, SELECTOR, 701]),
            Inst::new(Op::SelectionMerge, &[900, 0]),
            Inst::new(Op::Switch, &[SELECTOR, 910, 7, 1, 911, 7, 0, 912]),
        ];
        let head = Inst::new(Op::Function, &[linker.void(), 800, 0, linker.plain_function_type()]);
        let blocks = vec![Block { label: 1, code }];
        linker.module.functions.push(Function { head, parameters: Vec::new(), blocks });
        narrow_switches(&mut linker, &[800]);
        let code = &linker.function(800).unwrap().blocks[0].code;
        let [_, first_is, first, second_is, second, merge, switch] = code.as_slice() else {
            unreachable!("{code:?}")
        };
        // Literals stand with the low word first.
        for (inst, words) in [(first_is, [7, 1]), (second_is, [7, 0])] {
            assert_eq!((inst.op, inst.operand(0), inst.operand(2)), (Op::IEqual, bool, SELECTOR));
            let literal = linker.global(inst.operand(3)).unwrap();
            assert_eq!(
                (literal.op, literal.operand(0), &literal.operands[2..]),
                (Op::Constant, long, &words[..])
            );
        }
        let value_of = |id: u32| linker.global(id).unwrap().operand(2);
        assert_eq!((first.op, first.operand(0), first.operand(2)), (Op::Select, uint, first_is.operand(1)));
        assert_eq!((value_of(first.operand(3)), value_of(first.operand(4))), (1, 0));
        assert_eq!((value_of(second.operand(3)), second.operand(4)), (2, first.operand(1)));
        assert_eq!(*merge, Inst::new(Op::SelectionMerge, &[900, 0]));
        assert_eq!(*switch, Inst::new(Op::Switch, &[second.operand(1), 910, 1, 911, 2, 912]));
    }
}
