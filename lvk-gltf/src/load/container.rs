//! The two forms of a file: JSON alone, or GLB with JSON and a buffer.

use std::borrow::Cow;

use super::source::Source;
use crate::Problem;

const MAGIC: &[u8] = b"glTF";
const HEADER_BYTES: u64 = 12;
const CHUNK_HEADER_BYTES: u64 = 8;
/// The byte order mark of UTF-8.
const MARK: &[u8] = b"\xef\xbb\xbf";
const JSON_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BIN_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");

/// The parts of a file.
#[derive(Debug)]
pub(super) struct Container<'a> {
    /// The JSON.
    pub(super) json: Cow<'a, [u8]>,
    /// The buffer of a GLB.
    pub(super) bin: Option<Source<'a>>,
}

impl<'a> Container<'a> {
    /// Finds the parts of a file and reads its JSON. The content decides what it is, not its name.
    pub(super) fn read(file: Source<'a>) -> Result<Self, Problem> {
        let start =
            file.part(0, file.length().min(HEADER_BYTES)).map_or(Ok(Cow::default()), |it| it.read())?;
        if start.starts_with(MAGIC) {
            return Self::read_glb(file, &start);
        }
        // A file that is neither is not read as a whole.
        let is_json = |bytes: &[u8]| {
            let bytes = bytes.strip_prefix(MARK).unwrap_or(bytes);
            let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
            first.is_none_or(|byte| *byte == b'{')
        };
        if !is_json(&start) {
            return Err(Problem::NotGltf);
        }
        let mut json = file.read()?;
        if json.starts_with(MARK) {
            json = Cow::Owned(json[MARK.len()..].to_vec());
        }
        match json.iter().find(|byte| !byte.is_ascii_whitespace()) {
            Some(b'{') => Ok(Self { json, bin: None }),
            _ => Err(Problem::NotGltf),
        }
    }

    /// Chunks of unknown types are left out, as the specification demands.
    fn read_glb(file: Source<'a>, header: &[u8]) -> Result<Self, Problem> {
        let damaged = |what: &str| Problem::Container { what: what.into() };
        let (Some(version), Some(length)) = (word(header, 4), word(header, 8)) else {
            return Err(damaged("its header is cut off"));
        };
        if version != 2 {
            return Err(Problem::Version { version: version.to_string() });
        }
        let (length, has) = (u64::from(length), file.length());
        if length > has {
            return Err(Problem::Container { what: format!("it states {length} bytes and has {has}") });
        }
        let (mut json, mut bin, mut at) = (None, None, HEADER_BYTES);
        while at < length {
            let Some(head) = file.part(at, CHUNK_HEADER_BYTES) else {
                return Err(damaged("a chunk is cut off"));
            };
            let head = head.read()?;
            let (size, kind) = (u64::from(word(&head, 0).unwrap_or(0)), word(&head, 4).unwrap_or(0));
            let start = at + CHUNK_HEADER_BYTES;
            let chunk = file.part(start, size).filter(|_| start + size <= length);
            let Some(chunk) = chunk else {
                let what = format!("a chunk of {size} bytes starts at byte {start} of {length}");
                return Err(Problem::Container { what });
            };
            match (kind, &json) {
                (JSON_CHUNK, None) => json = Some(chunk.read()?),
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

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4).and_then(|word| word.try_into().ok()).map(u32::from_le_bytes)
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

    /// The JSON and the buffer.
    type Parts = (Vec<u8>, Option<Vec<u8>>);

    fn split(bytes: &[u8]) -> Result<Parts, Problem> {
        let Container { json, bin } = Container::read(Source::Memory(bytes))?;
        let bin = bin.map(|bin| bin.read()).transpose()?;
        Ok((json.into_owned(), bin.map(Cow::into_owned)))
    }

    #[test]
    fn parts_of_both_forms_are_found() {
        let file = glb(&[(b"JSON", b"{}  "), (b"BIN\0", b"1234"), (b"NEW!", b"more")]);
        assert_eq!(split(&file).unwrap(), (b"{}  ".to_vec(), Some(b"1234".to_vec())));
        assert_eq!(split(&glb(&[(b"JSON", b"{}")])).unwrap(), (b"{}".to_vec(), None));
        assert_eq!(split(b" \n{}").unwrap().0, b" \n{}");
        assert_eq!(split(b"\n              {}").unwrap().0, b"\n              {}");
        assert_eq!(split(b"\xef\xbb\xbf{}").unwrap().0, b"{}");
        let trailing = [&file[..], b"rubbish"].concat();
        assert_eq!(split(&trailing).unwrap().1.unwrap(), b"1234");
    }

    #[test]
    fn every_cut_is_an_error() {
        let file = glb(&[(b"JSON", b"{}  "), (b"BIN\0", b"1234")]);
        for length in 0..file.len() {
            assert!(split(&file[..length]).is_err(), "{length}");
        }
        assert!(matches!(split(b"OBJ"), Err(Problem::NotGltf)));
        assert!(matches!(split(&glb(&[(b"BIN\0", b"1234")])), Err(Problem::Container { .. })));
        let mut version = file.clone();
        version[4] = 1;
        assert!(matches!(split(&version), Err(Problem::Version { .. })));
        let mut chunk = file;
        chunk[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(matches!(split(&chunk), Err(Problem::Container { .. })));
    }
}
