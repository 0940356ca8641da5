//! Map from the primitives of a part to those of the mesh, and the gathered inputs of the part.

use std::sync::Arc;

use crate::error::limit_origin::LimitOrigin;
use crate::error::{Result, check_limit_of};
use crate::gpu::Gpu;
use crate::lock_order::{Mutex, Rank};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};

/// Bytes of three 32-bit indices.
const TRIANGLE_BYTES: u64 = 12;
/// Bytes of an AABB.
const BOX_BYTES: u64 = 24;

/// Maps the primitives of a part to those of the mesh, and holds the part's own indices or AABBs.
///
/// The table has one word for each geometry, the position of its first primitive in the table. The primitive numbers
/// of the mesh follow. Shaders read the table to return the caller's primitive number. The gather kernel reads it too.
pub(crate) struct PrimitiveMap {
    pub(crate) table: Arc<Buffer>,
    /// The gathered inputs; `None` once no further build is possible.
    inputs: Mutex<Option<Arc<Buffer>>>,
    inputs_address: u64,
    /// First primitive of each geometry in the gathered inputs.
    first_primitives: Vec<u32>,
    primitive_bytes: u64,
}

impl PrimitiveMap {
    /// Creates the buffers. The caller uploads [`encode_table`] and gathers the inputs.
    pub(crate) fn new(gpu: &Arc<Gpu>, name: &str, geometries: &[Vec<u32>], boxes: bool) -> Result<Self> {
        let primitive_bytes = if boxes { BOX_BYTES } else { TRIANGLE_BYTES };
        let total: u64 = geometries.iter().map(|list| list.len() as u64).sum();
        let words = total + geometries.len() as u64;
        check_limit_of(
            LimitOrigin::Library,
            name,
            "primitives and geometries of a part",
            words,
            u32::MAX.into(),
        )?;
        let inputs = Arc::new(new_buffer(gpu, name, total * primitive_bytes, BufferUsage::ACCEL_INPUT)?);
        Ok(Self {
            table: Arc::new(new_buffer(gpu, name, words * 4, BufferUsage::STORAGE)?),
            inputs_address: inputs.address,
            inputs: Mutex::new(Rank::GatheredInputs, Some(inputs)),
            first_primitives: first_primitives(geometries),
            primitive_bytes,
        })
    }

    /// The gathered inputs; `None` once they were taken.
    pub(crate) fn gathered_inputs(&self) -> Option<Arc<Buffer>> {
        self.inputs.lock().clone()
    }

    /// Takes the gathered inputs of a part that is never built again. The caller frees them later.
    pub(crate) fn take_gathered_inputs(&self) -> Option<Arc<Buffer>> {
        self.inputs.lock().take()
    }

    /// Address of the gathered inputs of a geometry.
    pub(crate) fn input_address(&self, geometry: usize) -> u64 {
        let first = self.first_primitives.get(geometry).copied().unwrap_or(0);
        self.inputs_address + u64::from(first) * self.primitive_bytes
    }

    /// Address of the primitive numbers of a geometry.
    pub(crate) fn primitive_ids_address(&self, geometry: usize) -> u64 {
        let first = self.first_primitives.get(geometry).copied().unwrap_or(0);
        self.table.address + (self.first_primitives.len() as u64 + u64::from(first)) * 4
    }

    /// Bytes of the table and of the gathered inputs, if these still exist.
    pub(crate) fn table_bytes(&self) -> u64 {
        self.table.size_bytes + self.gathered_inputs().map_or(0, |inputs| inputs.size_bytes)
    }
}

/// The words of the table.
pub(crate) fn encode_table(geometries: &[Vec<u32>]) -> Vec<u32> {
    let head = geometries.len() as u32;
    let places = first_primitives(geometries).into_iter().map(|first| head + first);
    places.chain(geometries.iter().flatten().copied()).collect()
}

/// Decodes the lists that [`encode_table`] put into `words`, for a mesh with `primitive_counts` primitives in each
/// geometry. Returns `None` for any other words.
pub(crate) fn decode_table(words: &[u32], primitive_counts: &[u32]) -> Option<Vec<Vec<u32>>> {
    let head = words.get(..primitive_counts.len())?;
    let ends = head.iter().skip(1).map(|end| *end as usize).chain([words.len()]);
    let list = |((start, end), count): ((&u32, usize), &u32)| {
        let numbers = words.get(*start as usize..end)?;
        numbers.iter().all(|number| number < count).then(|| numbers.to_vec())
    };
    let lists = head.iter().zip(ends).zip(primitive_counts).map(list).collect::<Option<Vec<_>>>()?;
    (encode_table(&lists) == words).then_some(lists)
}

/// True if the parts together hold every primitive of the mesh exactly once.
pub(crate) fn covers_mesh(parts: &[Vec<Vec<u32>>], primitive_counts: &[u32]) -> bool {
    primitive_counts.iter().enumerate().all(|(geometry, count)| {
        let lists = parts.iter().filter_map(|part| part.get(geometry));
        let held: usize = lists.clone().map(Vec::len).sum();
        if held != *count as usize {
            return false;
        }
        let mut seen = vec![false; held];
        let mut is_new =
            |number: &u32| seen.get_mut(*number as usize).is_some_and(|seen| !std::mem::replace(seen, true));
        lists.flatten().all(&mut is_new)
    })
}

fn first_primitives(geometries: &[Vec<u32>]) -> Vec<u32> {
    let mut next = 0;
    let mut place = |list: &Vec<u32>| {
        let first = next;
        next += list.len() as u32;
        first
    };
    geometries.iter().map(&mut place).collect()
}

fn new_buffer(gpu: &Arc<Gpu>, name: &str, bytes: u64, usage: BufferUsage) -> Result<Buffer> {
    let size_bytes = bytes.max(4);
    let usage = usage | BufferUsage::STORAGE;
    let desc = BufferDesc { size_bytes, usage, debug_name: name, ..Default::default() };
    Buffer::new(gpu, &desc, InternalUsage::NONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_leads_from_geometry_and_primitive_to_the_mesh() {
        let geometries = [vec![7, 3], vec![], vec![1]];
        let words = encode_table(&geometries);
        for (geometry, list) in geometries.iter().enumerate() {
            for (primitive, number) in list.iter().enumerate() {
                assert_eq!(words[words[geometry] as usize + primitive], *number);
            }
        }
        assert_eq!(words.len(), 6);
    }

    #[test]
    fn parts_have_each_primitive_once() {
        let whole = [vec![vec![1, 0], vec![]], vec![vec![2], vec![0]]];
        assert!(covers_mesh(&whole, &[3, 1]));
        assert!(covers_mesh(&[], &[0, 0]));
        assert!(!covers_mesh(&[], &[1]));
        assert!(!covers_mesh(&whole[..1], &[3, 1]), "some are missing");
        assert!(!covers_mesh(&whole, &[4, 1]), "the last is missing");
        assert!(!covers_mesh(&whole, &[2, 1]), "there are too many");
        assert!(!covers_mesh(&[vec![vec![1, 0]], vec![vec![1]]], &[3]), "one is there twice");
        assert!(!covers_mesh(&[vec![vec![1, 3, 0]]], &[3]), "one is of no mesh");
    }

    #[test]
    fn lists_come_out_of_their_table_and_of_no_other() {
        let geometries = vec![vec![7, 3], vec![], vec![1]];
        let (words, counts) = (encode_table(&geometries), [8, 0, 2]);
        assert_eq!(decode_table(&words, &counts), Some(geometries));
        assert_eq!(decode_table(&words, &[7, 0, 2]), None);
        assert_eq!(decode_table(&words[..2], &counts), None);
        for place in 0..3 {
            for wrong in [0, 1, 4, 6, 7, u32::MAX] {
                let mut broken = words.clone();
                broken[place] = wrong;
                assert!(broken == words || decode_table(&broken, &counts).is_none(), "{place} {wrong}");
            }
        }
    }
}
