//! The file format of a compiled module: the fingerprint of its inputs, its includes, and its words.

use crate::cache_file::fingerprint;

const MAGIC: [u8; 8] = *b"lvkspirv";
/// Version of the file format and of the passes that run after the compiler.
const VERSION: u32 = 1;
/// The crates of the compiler that produced a file's words; a test compares them with the lock file.
const COMPILER: &str = "glslang 0.9.1, glslang-sys 0.9.2+e1b562a";
/// Bytes of the header: magic, version, a reserved word, key, and the checksum of everything after it.
const HEADER_BYTES: usize = 40;
const MAX_NAME_BYTES: usize = 1 << 16;

/// Two checksums. Inputs are different if one of the checksums differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Fingerprint(pub(super) [u64; 2]);

impl Fingerprint {
    pub(crate) fn from_bytes(bytes: &[u8]) -> Self {
        Self([1, 2].map(|seed| fingerprint(bytes, seed)))
    }

    /// Returns the fingerprint of the compiler and all inputs of a compilation. The lengths of `parts` separate them.
    pub(super) fn from_input<'a>(numbers: &[u32], parts: impl Iterator<Item = &'a [u8]>) -> Self {
        let mut all = Vec::new();
        all.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        for part in std::iter::once(COMPILER.as_bytes()).chain(parts) {
            all.extend((part.len() as u64).to_le_bytes());
            all.extend(part);
        }
        Self::from_bytes(&all)
    }
}

/// An `#include` that the compiler requested.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Included {
    /// True if the directive has quotes, false if it has angle brackets.
    pub(super) local: bool,
    /// Nesting depth of the directive: 1 in the module's own text.
    pub(super) depth: u32,
    /// The name in the directive.
    pub(super) name: String,
    /// Fingerprint of the included text.
    pub(super) text: Fingerprint,
}

/// The content of a cache file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct CachedModule {
    /// The includes, in the order of the compiler's requests.
    pub(super) included: Vec<Included>,
    pub(crate) words: Vec<u32>,
}

/// Returns the file of a module that was compiled from `key`.
pub(super) fn encode_file(key: Fingerprint, entry: &CachedModule) -> Vec<u8> {
    sealed(key, &encode_body(entry))
}

/// Prepends the header to a body.
pub(crate) fn sealed(key: Fingerprint, body: &[u8]) -> Vec<u8> {
    let mut file = Vec::with_capacity(HEADER_BYTES + body.len());
    file.extend(MAGIC);
    file.extend(VERSION.to_le_bytes());
    file.extend([0; 4]);
    file.extend(key.0.iter().flat_map(|half| half.to_le_bytes()));
    file.extend(checksum(key, body).to_le_bytes());
    file.extend(body);
    file
}

/// Returns the content of the file, if the file is complete and was compiled from `key`.
pub(crate) fn decode_file(key: Fingerprint, file: &[u8]) -> Result<CachedModule, &'static str> {
    if !file.starts_with(&MAGIC) {
        return Err("it is no compiled shader");
    }
    let (header, body) = file.split_at_checked(HEADER_BYTES).ok_or(DAMAGED)?;
    if header[8..12] != VERSION.to_le_bytes() {
        return Err("another version of the library wrote it");
    }
    let found: Vec<u8> = key.0.iter().flat_map(|half| half.to_le_bytes()).collect();
    if header[16..32] != found {
        return Err("it was compiled from something else");
    }
    if header[12..16] != [0; 4] || header[32..] != checksum(key, body).to_le_bytes() {
        return Err(DAMAGED);
    }
    decode_body(body).ok_or(DAMAGED)
}

const DAMAGED: &str = "it is damaged or cut off";

fn checksum(key: Fingerprint, body: &[u8]) -> u64 {
    fingerprint(body, key.0[0])
}

fn encode_body(entry: &CachedModule) -> Vec<u8> {
    let mut out = (entry.included.len() as u32).to_le_bytes().to_vec();
    for included in &entry.included {
        out.push(included.local.into());
        out.extend(included.depth.to_le_bytes());
        out.extend(included.text.0.iter().flat_map(|half| half.to_le_bytes()));
        out.extend((included.name.len() as u32).to_le_bytes());
        out.extend(included.name.as_bytes());
    }
    out.extend(entry.words.iter().flat_map(|word| word.to_le_bytes()));
    out
}

fn decode_body(body: &[u8]) -> Option<CachedModule> {
    let mut rest = body;
    let mut included = Vec::new();
    for _ in 0..u32::from_le_bytes(take_array(&mut rest)?) {
        let [local] = take_array(&mut rest)?;
        let depth = u32::from_le_bytes(take_array(&mut rest)?);
        let text = Fingerprint([
            u64::from_le_bytes(take_array(&mut rest)?),
            u64::from_le_bytes(take_array(&mut rest)?),
        ]);
        let len = u32::from_le_bytes(take_array(&mut rest)?) as usize;
        let (name, behind) = rest.split_at_checked(len).filter(|_| len <= MAX_NAME_BYTES)?;
        rest = behind;
        let name = std::str::from_utf8(name).ok()?.to_owned();
        included.push(Included { local: local != 0, depth, name, text });
    }
    let (words, odd) = rest.as_chunks::<4>();
    odd.is_empty()
        .then(|| CachedModule { included, words: words.iter().map(|w| u32::from_le_bytes(*w)).collect() })
}

fn take_array<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (head, tail) = rest.split_first_chunk::<N>()?;
    *rest = tail;
    Some(*head)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const KEY: Fingerprint = Fingerprint([3, 4]);

    fn entries() -> impl Strategy<Value = CachedModule> {
        let included = (any::<bool>(), any::<u32>(), ".{0,20}", any::<[u64; 2]>())
            .prop_map(|(local, depth, name, text)| Included { local, depth, name, text: Fingerprint(text) });
        (prop::collection::vec(included, 0..4), prop::collection::vec(any::<u32>(), 0..40))
            .prop_map(|(included, words)| CachedModule { included, words })
    }

    proptest! {
        #[test]
        fn sealed_data_is_read_again(entry in entries()) {
            prop_assert_eq!(decode_file(KEY, &encode_file(KEY, &entry)), Ok(entry));
        }

        #[test]
        fn every_changed_bit_and_every_truncation_is_noticed(
            entry in entries(), at in any::<prop::sample::Index>(), bit in 0..8_u32
        ) {
            let mut file = encode_file(KEY, &entry);
            let at = at.index(file.len());
            prop_assert!(decode_file(KEY, &file[..at]).is_err());
            file[at] ^= 1 << bit;
            prop_assert!(decode_file(KEY, &file).is_err());
        }

        #[test]
        fn random_bodies_are_read_or_refused(body in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = decode_body(&body);
        }
    }

    #[test]
    fn files_of_others_are_named() {
        let file = encode_file(KEY, &CachedModule::default());
        assert_eq!(decode_file(Fingerprint([3, 5]), &file), Err("it was compiled from something else"));
        assert_eq!(decode_file(KEY, b"#version 460"), Err("it is no compiled shader"));
        let mut newer = file;
        newer[8] += 1;
        assert_eq!(decode_file(KEY, &newer), Err("another version of the library wrote it"));
    }

    #[test]
    fn parts_of_the_input_are_kept_apart() {
        let of = |parts: &[&str]| Fingerprint::from_input(&[1], parts.iter().map(|part| part.as_bytes()));
        assert_ne!(of(&["ab", "c"]), of(&["a", "bc"]));
        assert_ne!(of(&["ab"]), of(&["ab", ""]));
        assert_ne!(
            Fingerprint::from_input(&[1], [].into_iter()),
            Fingerprint::from_input(&[2], [].into_iter())
        );
    }

    #[test]
    fn the_compiler_is_that_of_the_lock_file() {
        // A package of the crate has the file in its own folder, the workspace one above.
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let read = |path| std::fs::read_to_string(folder.join(path)).ok();
        let lock = read("Cargo.lock").or_else(|| read("../Cargo.lock")).unwrap();
        let version = |name: &str| {
            let (_, behind) = lock.split_once(&format!("name = \"{name}\"\nversion = \"")).unwrap();
            format!("{name} {}", behind.split_once('"').unwrap().0)
        };
        assert_eq!(COMPILER, format!("{}, {}", version("glslang"), version("glslang-sys")));
    }
}
