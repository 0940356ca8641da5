//! Reads the dependencies of an ELF shared library, and the order in which to open them.

use std::collections::HashSet;

const HEADER_BYTES: usize = 64;
const SEGMENT_DYNAMIC: u32 = 2;
const SEGMENT_LOAD: u32 = 1;
const TAG_NEEDED: u64 = 1;
const TAG_STRINGS: u64 = 5;

/// One program header of a 64-bit little-endian ELF file.
struct Segment {
    kind: u32,
    offset: usize,
    address: u64,
    size_bytes: usize,
}

/// Returns the sonames of the `DT_NEEDED` entries of the 64-bit little-endian ELF file `image`, in file order. Returns `None`
/// for a damaged or other file, and an empty list for a file without a dynamic section.
pub(super) fn needed_libraries(image: &[u8]) -> Option<Vec<String>> {
    let segments = segments(image)?;
    let Some(dynamic) = segments.iter().find(|segment| segment.kind == SEGMENT_DYNAMIC) else {
        return Some(Vec::new());
    };
    let bytes = image.get(dynamic.offset..dynamic.offset.checked_add(dynamic.size_bytes)?)?;
    let entries: Vec<(u64, u64)> =
        bytes.chunks_exact(16).map_while(|entry| Some((u64_at(entry, 0)?, u64_at(entry, 8)?))).collect();
    let strings_address = entries.iter().find(|(tag, _)| *tag == TAG_STRINGS)?.1;
    let strings = file_offset(&segments, strings_address)?;
    let names = entries.iter().filter(|(tag, _)| *tag == TAG_NEEDED);
    names.map(|(_, at)| string_at(image, strings.checked_add(usize::try_from(*at).ok()?)?)).collect()
}

/// Returns `root` and its dependencies, dependencies first (depth-first order). `needed` returns the dependencies of one
/// library, or `None` for a system library, which is left out.
pub(super) fn load_order<E>(
    root: &str,
    mut needed: impl FnMut(&str) -> Result<Option<Vec<String>>, E>,
) -> Result<Vec<String>, E> {
    let mut order = Vec::new();
    let mut seen = HashSet::from([root.to_owned()]);
    let Some(first) = needed(root)? else { return Ok(order) };
    let mut stack = vec![(root.to_owned(), first.into_iter())];
    while let Some((name, children)) = stack.last_mut() {
        match children.next() {
            Some(child) if seen.insert(child.clone()) => {
                if let Some(below) = needed(&child)? {
                    stack.push((child, below.into_iter()));
                }
            }
            Some(_) => {}
            None => {
                order.push(std::mem::take(name));
                stack.pop();
            }
        }
    }
    Ok(order)
}

fn segments(image: &[u8]) -> Option<Vec<Segment>> {
    let is_elf64_little = image.len() >= HEADER_BYTES && image.starts_with(b"\x7fELF\x02\x01");
    let table = usize::try_from(u64_at(image, 32).filter(|_| is_elf64_little)?).ok()?;
    let (stride_bytes, count) = (usize::from(u16_at(image, 54)?), usize::from(u16_at(image, 56)?));
    (0..count)
        .map(|index| {
            let header = image.get(table.checked_add(index * stride_bytes)?..)?;
            Some(Segment {
                kind: u32_at(header, 0)?,
                offset: usize::try_from(u64_at(header, 8)?).ok()?,
                address: u64_at(header, 16)?,
                size_bytes: usize::try_from(u64_at(header, 32)?).ok()?,
            })
        })
        .collect()
}

fn file_offset(segments: &[Segment], address: u64) -> Option<usize> {
    segments.iter().filter(|segment| segment.kind == SEGMENT_LOAD).find_map(|segment| {
        let inside = usize::try_from(address.checked_sub(segment.address)?).ok()?;
        if inside < segment.size_bytes { segment.offset.checked_add(inside) } else { None }
    })
}

fn string_at(image: &[u8], offset: usize) -> Option<String> {
    let tail = image.get(offset..)?;
    let end = tail.iter().position(|byte| *byte == 0)?;
    String::from_utf8(tail[..end].to_vec()).ok()
}

fn u16_at(bytes: &[u8], offset: usize) -> Option<u16> {
    bytes.get(offset..)?.first_chunk().map(|chunk| u16::from_le_bytes(*chunk))
}

fn u32_at(bytes: &[u8], offset: usize) -> Option<u32> {
    bytes.get(offset..)?.first_chunk().map(|chunk| u32::from_le_bytes(*chunk))
}

fn u64_at(bytes: &[u8], offset: usize) -> Option<u64> {
    bytes.get(offset..)?.first_chunk().map(|chunk| u64::from_le_bytes(*chunk))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load_order_in(graph: &[(&str, &[&str])], root: &str) -> Vec<String> {
        let lookup = |name: &str| {
            let found = graph.iter().find(|(key, _)| *key == name);
            Ok::<_, ()>(found.map(|(_, below)| below.iter().map(|&name| name.to_owned()).collect()))
        };
        load_order(root, lookup).unwrap()
    }

    #[test]
    fn other_files_are_refused() {
        assert_eq!(needed_libraries(b""), None);
        assert_eq!(needed_libraries(b"#!/bin/sh"), None);
        assert_eq!(needed_libraries(&[0x7f, b'E', b'L', b'F', 1, 1, 0, 0]), None);
    }

    #[test]
    fn dependencies_come_first_and_system_libraries_are_left_out() {
        let graph: &[(&str, &[&str])] =
            &[("driver", &["llvm", "z", "libc"]), ("llvm", &["xml", "z"]), ("xml", &["z"]), ("z", &[])];
        assert_eq!(load_order_in(graph, "driver"), ["z", "xml", "llvm", "driver"]);
        assert!(load_order_in(graph, "libc").is_empty());
    }

    #[test]
    fn cycles_terminate() {
        assert_eq!(load_order_in(&[("a", &["b"]), ("b", &["a", "b"])], "a"), ["b", "a"]);
    }
}

/// Tests of a library that the process has open.
#[cfg(test)]
#[cfg(target_os = "linux")]
mod library_tests {
    use std::sync::LazyLock;

    use super::*;
    use proptest::prelude::*;

    /// Bytes of a small library that this process has open.
    static LIBRARY: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
        let path = maps.split_whitespace().find(|word| word.ends_with("/libgcc_s.so.1")).unwrap();
        std::fs::read(path).unwrap()
    });

    #[test]
    fn the_unwinder_needs_the_c_library() {
        assert_eq!(needed_libraries(&LIBRARY).unwrap(), ["libc.so.6"]);
    }

    proptest! {
        #[test]
        fn damaged_files_do_not_panic(damage in prop::collection::vec((0usize..2048, any::<u8>()), 1..8), kept in 0.0..1.0) {
            let mut image = LIBRARY.clone();
            for (at, value) in damage {
                image[at] = value;
            }
            image.truncate((image.len() as f64 * (kept + 0.2)) as usize);
            let _ = needed_libraries(&image);
        }
    }
}
