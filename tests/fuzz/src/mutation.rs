//! Mutations of inputs by a seeded generator: the same on every machine.

/// A generator of pseudo-random numbers (xorshift, 64 bits).
pub struct Random(u64);

/// Numbers at which readers decide: ends of ranges, signs, sizes of headers.
const NUMBERS: [u32; 14] = [
    0,
    1,
    2,
    4,
    32,
    0x7f,
    0xff,
    0x7fff,
    0xffff,
    0x0001_0000,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_fffe,
    0xffff_ffff,
];
/// Words of text formats.
const WORDS: [&str; 20] = [
    "\n",
    " ",
    "-1",
    "0",
    "nan",
    "inf",
    "1e39",
    "4294967296",
    "9223372036854775808",
    "\\\n",
    "#",
    "//",
    "/*",
    "\"",
    "#include \"a\"\n",
    "f 1 2 3\n",
    "usemtl a\n",
    "newmtl a\n",
    "map_Kd t.bmp\n",
    "\0",
];

impl Random {
    /// Returns the generator of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// Returns a number below `end`; 0 for an empty range.
    pub fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % end.max(1)
    }
}

/// Returns `bytes` after one to four mutations. `other` is another input, of which parts are taken.
#[must_use]
pub fn mutated(bytes: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..=random.below(4) {
        mutate(&mut out, other, random);
    }
    out
}

fn mutate(out: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    let at = random.below(out.len() + 1);
    let end = at + random.below((out.len() - at).min(64) + 1);
    match random.below(8) {
        0 if at < out.len() => out[at] ^= 1 << random.below(8),
        1 if at < out.len() => out[at] = random.below(256) as u8,
        2 => overwrite(out, at / 4 * 4, &NUMBERS[random.below(NUMBERS.len())].to_le_bytes()),
        3 => drop(out.drain(at..end)),
        4 => {
            let copied = out[at..end].to_vec();
            let times = 1 + random.below(8);
            out.splice(end..end, copied.repeat(times));
        }
        5 => {
            let from = random.below(other.len() + 1);
            let taken = &other[from..from + random.below((other.len() - from).min(256) + 1)];
            out.splice(at..end, taken.iter().copied());
        }
        6 => drop(out.splice(at..at, WORDS[random.below(WORDS.len())].bytes())),
        _ => out.truncate(at),
    }
}

fn overwrite(out: &mut [u8], at: usize, bytes: &[u8]) {
    out.iter_mut().skip(at).zip(bytes).for_each(|(out, byte)| *out = *byte);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_same_mutations_and_another_seed_others() {
        let all = |seed| {
            let mut random = Random::new(seed);
            (0..50).map(|_| mutated(b"v 1 2 3", b"f 1 2 3", &mut random)).collect::<Vec<_>>()
        };
        assert_eq!(all(1), all(1));
        assert_ne!(all(1), all(2));
        assert!(all(1).iter().any(|bytes| bytes != b"v 1 2 3"));
    }

    #[test]
    fn nothing_is_mutated_without_a_panic() {
        let mut random = Random::new(3);
        for _ in 0..1_000 {
            drop(mutated(b"", b"", &mut random));
        }
    }
}
