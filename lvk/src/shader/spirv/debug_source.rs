//! Embeds the source texts of a module in its SPIR-V, for debuggers.

use ::spirv::Op;

use super::words::{HEADER_WORDS, instructions};

/// Maximum words of an instruction.
const MAX_WORDS: usize = 0xFFFF;
/// The header word that holds the id bound.
const BOUND: usize = 3;

/// Returns `words` with an `OpSource` that names and contains each text. The first text is the module's own. The texts
/// are ASCII.
pub(crate) fn embed_source(words: &[u32], texts: &[(String, String)]) -> Vec<u32> {
    let mut out = words.get(..HEADER_WORDS).unwrap_or(words).to_vec();
    for instruction in instructions(words).flatten() {
        match instruction.op {
            Some(Op::Source) => {
                let language = [instruction.operand(0), instruction.operand(1)];
                push_texts(&mut out, language, texts);
            }
            _ => out.extend(instruction.words),
        }
    }
    out
}

/// Appends the texts, unless the module has no ids left for them. Every `OpString` precedes every `OpSource`.
fn push_texts(out: &mut Vec<u32>, language: [u32; 2], texts: &[(String, String)]) {
    let first = out[BOUND];
    let Some(bound) = first.checked_add(texts.len() as u32) else { return };
    out[BOUND] = bound;
    for (id, (name, _)) in (first..bound).zip(texts) {
        push_text(out, Op::String, &[id], name);
    }
    for (id, (_, text)) in (first..bound).zip(texts) {
        let most = (MAX_WORDS - 5) * 4;
        let (head, mut rest) = text.split_at(text.len().min(most));
        push_text(out, Op::Source, &[language[0], language[1], id], head);
        while !rest.is_empty() {
            let (head, tail) = rest.split_at(rest.len().min(most));
            push_text(out, Op::SourceContinued, &[], head);
            rest = tail;
        }
    }
}

/// Appends an instruction that ends in a string.
fn push_text(out: &mut Vec<u32>, op: Op, operands: &[u32], text: &str) {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize((bytes.len() / 4 + 1) * 4, 0);
    let len = 1 + operands.len() + bytes.len() / 4;
    out.push((len as u32) << 16 | op as u32);
    out.extend(operands);
    out.extend(bytes.as_chunks::<4>().0.iter().map(|chunk| u32::from_le_bytes(*chunk)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_module_without_ids_gets_no_texts() {
        let mut words =
            vec![0x0723_0203, 0x0001_0600, 0, u32::MAX - 1, 0, 3 << 16 | Op::Source as u32, 2, 460];
        let texts = [("a".to_owned(), "b".to_owned()), ("c".to_owned(), "d".to_owned())];
        assert_eq!(embed_source(&words, &texts), words[..HEADER_WORDS]);
        words[BOUND] -= 1;
        assert_eq!(embed_source(&words, &texts)[BOUND], u32::MAX);
    }

    #[test]
    fn texts_longer_than_an_instruction_are_continued() {
        let words = [0x0723_0203, 0x0001_0600, 0, 7, 0, 3 << 16 | Op::Source as u32, 2, 460];
        let long: String = (0..600_000).map(|i| char::from(b'a' + (i % 23) as u8)).collect();
        let texts = [("main.glsl".to_owned(), long.clone()), ("b".to_owned(), "short".to_owned())];
        let out = embed_source(&words, &texts);
        assert_eq!(out[BOUND], 9);
        let code: Vec<_> = instructions(&out).map(Result::unwrap).collect();
        let ops: Vec<_> = code.iter().map(|i| i.op.unwrap()).collect();
        use Op::{Source, SourceContinued, String as Text};
        assert_eq!(ops, [Text, Text, Source, SourceContinued, SourceContinued, Source]);
        assert_eq!((code[0].operand(0), code[0].string(1).0.as_str()), (7, "main.glsl"));
        assert_eq!([code[2].operand(2), code[5].operand(2)], [7, 8]);
        let found = code[2].string(3).0 + &code[3].string(0).0 + &code[4].string(0).0;
        assert!(found == long && code[5].string(3).0 == "short");
    }
}
