//! The two forms of a file: JSON alone, or GLB with JSON and a buffer.

use crate::Problem;

const MAGIC: &[u8] = b"glTF";
const HEADER_BYTES: usize = 12;
const JSON_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BIN_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");

/// The parts of a file.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Container<'a> {
    /// The JSON.
    pub(super) json: &'a [u8],
    /// The buffer of a GLB.
    pub(super) bin: Option<&'a [u8]>,
}

impl<'a> Container<'a> {
    /// Finds the parts of a file. The content decides what it is, not its name.
    pub(super) fn split(bytes: &'a [u8]) -> Result<Self, Problem> {
        if bytes.starts_with(MAGIC) {
            return Self::split_glb(bytes);
        }
        let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        match json.iter().find(|byte| !byte.is_ascii_whitespace()) {
            Some(b'{') => Ok(Self { json, bin: None }),
            _ => Err(Problem::NotGltf),
        }
    }

    /// Chunks of unknown types are left out, as the specification demands.
    fn split_glb(bytes: &'a [u8]) -> Result<Self, Problem> {
        let word =
            |at: usize| bytes.get(at..at + 4).and_then(|word| word.try_into().ok()).map(u32::from_le_bytes);
        let damaged = |what: &str| Problem::Container { what: what.into() };
        let (Some(version), Some(length)) = (word(4), word(8)) else {
            return Err(damaged("its header is cut off"));
        };
        if version != 2 {
            return Err(Problem::Version { version: version.to_string() });
        }
        let (length, has) = (length as usize, bytes.len());
        if length > has {
            return Err(Problem::Container { what: format!("it states {length} bytes and has {has}") });
        }
        let (mut json, mut bin, mut at) = (None, None, HEADER_BYTES);
        while at < length {
            let (Some(size), Some(kind)) = (word(at), word(at + 4)) else {
                return Err(damaged("a chunk is cut off"));
            };
            let (start, size) = (at + 8, size as usize);
            if start > length || size > length - start {
                let what = format!("a chunk of {size} bytes starts at byte {start} of {length}");
                return Err(Problem::Container { what });
            }
            let chunk = &bytes[start..start + size];
            match (kind, json) {
                (JSON_CHUNK, None) => json = Some(chunk),
                (BIN_CHUNK, Some(_)) if bin.is_none() => bin = Some(chunk),
                (_, None) => return Err(damaged("its first chunk is not JSON")),
                _ => {}
            }
            at = start + size;
        }
        let json = json.ok_or_else(|| damaged("it has no JSON"))?;
        Ok(Self { json, bin })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let body: Vec<u8> = chunks
            .iter()
            .flat_map(|(kind, data)| [&(data.len() as u32).to_le_bytes()[..], &kind[..], data].concat())
            .collect();
        [MAGIC, &2_u32.to_le_bytes(), &(12 + body.len() as u32).to_le_bytes(), &body].concat()
    }

    #[test]
    fn parts_of_both_forms_are_found() {
        let file = glb(&[(b"JSON", b"{}  "), (b"BIN\0", b"1234"), (b"NEW!", b"more")]);
        assert_eq!(Container::split(&file).unwrap(), Container { json: b"{}  ", bin: Some(b"1234") });
        assert_eq!(
            Container::split(&glb(&[(b"JSON", b"{}")])).unwrap(),
            Container { json: b"{}", bin: None }
        );
        assert_eq!(Container::split(b" \n{}").unwrap().json, b" \n{}");
        assert_eq!(Container::split(b"\xef\xbb\xbf{}").unwrap().json, b"{}");
        let trailing = [&file[..], b"rubbish"].concat();
        assert_eq!(Container::split(&trailing).unwrap().bin, Some(&b"1234"[..]));
    }

    #[test]
    fn every_cut_is_an_error() {
        let file = glb(&[(b"JSON", b"{}  "), (b"BIN\0", b"1234")]);
        for length in 0..file.len() {
            assert!(Container::split(&file[..length]).is_err(), "{length}");
        }
        assert!(matches!(Container::split(b"OBJ"), Err(Problem::NotGltf)));
        assert!(matches!(Container::split(&glb(&[(b"BIN\0", b"1234")])), Err(Problem::Container { .. })));
        let mut version = file.clone();
        version[4] = 1;
        assert!(matches!(Container::split(&version), Err(Problem::Version { .. })));
        let mut chunk = file;
        chunk[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(matches!(Container::split(&chunk), Err(Problem::Container { .. })));
    }
}
