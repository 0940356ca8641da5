//! Reads SPIR-V words. Only the lengths of instructions are checked, so that instructions newer than this library are
//! accepted.

use ::spirv::{MAGIC_NUMBER, Op};

pub(crate) const HEADER_WORDS: usize = 5;
/// SPIR-V 1.6, the highest version that Vulkan 1.3 accepts.
const MAX_VERSION: u32 = 0x0001_0600;
pub(crate) const VERSION_1_4: u32 = 0x0001_0400;

/// One instruction of a module.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instruction<'a> {
    /// `None` for an instruction unknown to this library.
    pub(crate) op: Option<Op>,
    /// All words, including the first.
    pub(crate) words: &'a [u32],
}

impl<'a> Instruction<'a> {
    /// Returns operand `index`, counted from the word after the opcode. A missing operand is zero, an invalid id.
    pub(crate) fn operand(&self, index: usize) -> u32 {
        self.operands().get(index).copied().unwrap_or(0)
    }

    pub(crate) fn operands(&self) -> &'a [u32] {
        self.words.get(1..).unwrap_or(&[])
    }

    /// Returns the string that starts at operand `index`, and its length in words.
    pub(crate) fn string(&self, index: usize) -> (String, usize) {
        let words = self.operands().get(index..).unwrap_or(&[]);
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let len = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        (String::from_utf8_lossy(&bytes[..len]).into_owned(), (len / 4 + 1).min(words.len()))
    }
}

/// Checks the header, and that complete instructions and functions fill `words`.
pub(crate) fn validate(words: &[u32]) -> Result<(), String> {
    match words.first() {
        Some(&MAGIC_NUMBER) => {}
        Some(&word) if word == MAGIC_NUMBER.swap_bytes() => {
            return Err("the SPIR-V words are in the other byte order; read them as little endian".to_owned());
        }
        _ => return Err("not SPIR-V: the first word is not the magic number 0x07230203".to_owned()),
    }
    if words.len() < HEADER_WORDS {
        return Err("the SPIR-V ends inside its header".to_owned());
    }
    if version(words) > MAX_VERSION {
        return Err(format!("SPIR-V version word {:#x} is newer than 1.6; compile for Vulkan 1.3", words[1]));
    }
    let mut in_function = false;
    for instruction in instructions(words) {
        match instruction?.op {
            Some(Op::Function) => in_function = true,
            Some(Op::FunctionEnd) => in_function = false,
            _ => {}
        }
    }
    if in_function { Err("the SPIR-V ends inside a function".to_owned()) } else { Ok(()) }
}

/// Returns the version word: `0x0001_0600` for 1.6.
pub(crate) fn version(words: &[u32]) -> u32 {
    words.get(1).copied().unwrap_or(0)
}

/// Returns the instructions after the header. Ends after the first error.
pub(crate) fn instructions(words: &[u32]) -> impl Iterator<Item = Result<Instruction<'_>, String>> {
    let mut rest = words.get(HEADER_WORDS..).unwrap_or(&[]);
    std::iter::from_fn(move || {
        let first = *rest.first()?;
        let len = (first >> 16) as usize;
        if len == 0 || len > rest.len() {
            let at = words.len() - rest.len();
            rest = &[];
            return Some(Err(format!("the SPIR-V is damaged or cut off at word {at}")));
        }
        let (head, tail) = rest.split_at(len);
        rest = tail;
        Some(Ok(Instruction { op: Op::from_u32(first & 0xFFFF), words: head }))
    })
}
