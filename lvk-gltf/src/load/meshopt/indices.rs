//! Indices: lists of triangles, which refer to recent edges and vertices, and sequences.

use super::{CUT_OFF, Damage, TRAILING, take};

const TRIANGLES_HEADER: u8 = 0xe1;
const SEQUENCE_HEADER: u8 = 0xd1;
const WRONG_HEADER: Damage = "its header is that of another codec or version";

/// Decodes a list of triangles into indices of `width` bytes, 2 or 4.
pub(super) fn decode_triangles(data: &[u8], width: usize, indices: &mut [u8]) -> Result<(), Damage> {
    let (header, rest) = data.split_first().ok_or(CUT_OFF)?;
    if *header != TRIANGLES_HEADER {
        return Err(WRONG_HEADER);
    }
    let (data, table) = rest.split_last_chunk::<16>().ok_or(CUT_OFF)?;
    let (codes, data) = data.split_at_checked(indices.len() / width / 3).ok_or(CUT_OFF)?;
    let mut decoder =
        Triangles { data, table, edges: Recent::default(), vertices: Recent::default(), next: 0, last: 0 };
    for (code, triangle) in codes.iter().zip(indices.chunks_exact_mut(3 * width)) {
        let corners = decoder.triangle(*code)?;
        triangle.chunks_exact_mut(width).zip(corners).for_each(|(index, corner)| write(index, corner));
    }
    if decoder.data.is_empty() { Ok(()) } else { Err(TRAILING) }
}

/// Decodes a sequence of indices of `width` bytes, 2 or 4.
pub(super) fn decode_sequence(data: &[u8], width: usize, indices: &mut [u8]) -> Result<(), Damage> {
    let (header, rest) = data.split_first().ok_or(CUT_OFF)?;
    if *header != SEQUENCE_HEADER {
        return Err(WRONG_HEADER);
    }
    let mut data = rest.split_last_chunk::<4>().ok_or(CUT_OFF)?.0;
    let mut last = [0_u32; 2];
    for index in indices.chunks_exact_mut(width) {
        let value = variable(&mut data)?;
        let last = &mut last[(value & 1) as usize];
        *last = last.wrapping_add(signed(value >> 1));
        write(index, *last);
    }
    if data.is_empty() { Ok(()) } else { Err(TRAILING) }
}

fn write(index: &mut [u8], value: u32) {
    let width = index.len();
    index.copy_from_slice(&value.to_le_bytes()[..width]);
}

/// Reads an integer of seven bits a byte, the lowest first.
fn variable(data: &mut &[u8]) -> Result<u32, Damage> {
    let mut value = 0;
    for shift in [0, 7, 14, 21, 28] {
        let byte = take(data, 1)?[0];
        value |= u32::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            break;
        }
    }
    Ok(value)
}

fn signed(value: u32) -> u32 {
    value >> 1 ^ (value & 1).wrapping_neg()
}

/// The last 16 of something.
struct Recent<T> {
    entries: [T; 16],
    next: usize,
}

impl Default for Recent<u32> {
    fn default() -> Self {
        Self { entries: [u32::MAX; 16], next: 0 }
    }
}

impl Default for Recent<[u32; 2]> {
    fn default() -> Self {
        Self { entries: [[u32::MAX; 2]; 16], next: 0 }
    }
}

impl<T: Copy> Recent<T> {
    fn push(&mut self, entry: T) {
        self.entries[self.next % 16] = entry;
        self.next += 1;
    }

    /// Returns an entry: 1 is the last one.
    fn back(&self, distance: u8) -> T {
        self.entries[self.next.wrapping_sub(usize::from(distance)) % 16]
    }
}

struct Triangles<'a> {
    data: &'a [u8],
    /// Frequent pairs of codes of the second and third corner.
    table: &'a [u8; 16],
    edges: Recent<[u32; 2]>,
    vertices: Recent<u32>,
    /// The smallest index that has not been used.
    next: u32,
    /// The last index that was stored as a difference.
    last: u32,
}

impl Triangles<'_> {
    fn triangle(&mut self, code: u8) -> Result<[u32; 3], Damage> {
        match code {
            0xf0..=0xfd => self.with_two_codes(0, self.table[usize::from(code & 15)]),
            0xfe | 0xff => {
                let codes = take(&mut self.data, 1)?[0];
                if codes == 0 {
                    self.next = 0;
                }
                self.with_two_codes(if code == 0xfe { 0 } else { 15 }, codes)
            }
            _ => self.at_recent_edge(code >> 4, code & 15),
        }
    }

    /// A triangle at a recent edge, with one other corner.
    fn at_recent_edge(&mut self, edge: u8, code: u8) -> Result<[u32; 3], Damage> {
        let [a, b] = self.edges.back(edge + 1);
        let (c, is_new) = match code {
            0 => (self.take_next(), true),
            1..=12 => (self.vertices.back(code + 1), false),
            13 => (self.beside_stored(u32::MAX), true),
            14 => (self.beside_stored(1), true),
            _ => (self.stored()?, true),
        };
        if is_new {
            self.vertices.push(c);
        }
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        Ok([a, b, c])
    }

    /// A triangle with a code for each corner: 0 is the next vertex, 15 a stored one, others are recent.
    fn with_two_codes(&mut self, first: u8, codes: u8) -> Result<[u32; 3], Damage> {
        let corner_codes = [first, codes >> 4, codes & 15];
        let mut corners = [0; 3];
        for (corner, code) in corners.iter_mut().zip(corner_codes) {
            match code {
                0 => *corner = self.take_next(),
                15 => {}
                code => *corner = self.vertices.back(code),
            }
        }
        for (corner, code) in corners.iter_mut().zip(corner_codes) {
            if code == 15 {
                *corner = self.stored()?;
            }
        }
        for (corner, code) in corners.iter().zip(corner_codes) {
            if matches!(code, 0 | 15) {
                self.vertices.push(*corner);
            }
        }
        let [a, b, c] = corners;
        [[b, a], [c, b], [a, c]].into_iter().for_each(|edge| self.edges.push(edge));
        Ok(corners)
    }

    fn take_next(&mut self) -> u32 {
        let next = self.next;
        self.next = next.wrapping_add(1);
        next
    }

    /// Returns a neighbour of the last index that was stored, which becomes the last one.
    fn beside_stored(&mut self, step: u32) -> u32 {
        self.last = self.last.wrapping_add(step);
        self.last
    }

    fn stored(&mut self) -> Result<u32, Damage> {
        self.last = self.last.wrapping_add(signed(variable(&mut self.data)?));
        Ok(self.last)
    }
}
