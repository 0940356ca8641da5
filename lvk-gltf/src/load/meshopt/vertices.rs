//! Attributes: blocks of elements, in which each byte of an element is a channel of differences.

use super::{CUT_OFF, Damage, TRAILING, take};

const HEADER: u8 = 0xa0;
const BLOCK_BYTES: usize = 8192;
const MOST_BLOCK_ELEMENTS: usize = 256;
const GROUP: usize = 16;

/// Decodes elements of `stride` bytes, a multiple of 4 up to 256.
pub(super) fn decode(data: &[u8], stride: usize, elements: &mut [u8]) -> Result<(), Damage> {
    let (header, data) = data.split_first().ok_or(CUT_OFF)?;
    let version = match header ^ HEADER {
        version @ (0 | 1) => version,
        _ => return Err("its header is that of another codec or version"),
    };
    let (channel_bytes, least_tail) = if version == 0 { (0, 32) } else { (stride / 4, 24) };
    let tail_bytes = stride + channel_bytes;
    let blocks_bytes = data.len().checked_sub(tail_bytes.max(least_tail)).ok_or(CUT_OFF)?;
    let tail = &data[data.len() - tail_bytes..];
    let mut previous = tail[..stride].to_vec();
    let mut blocks = &data[..blocks_bytes];
    let block_elements = (BLOCK_BYTES / stride / GROUP * GROUP).min(MOST_BLOCK_ELEMENTS);
    for block in elements.chunks_mut(block_elements * stride) {
        let block = Block { version, stride, channels: &tail[stride..], elements: block };
        block.decode(&mut blocks, &mut previous)?;
    }
    if blocks.is_empty() { Ok(()) } else { Err(TRAILING) }
}

struct Block<'a> {
    version: u8,
    stride: usize,
    /// How the four bytes of each word are put together; empty in version 0.
    channels: &'a [u8],
    elements: &'a mut [u8],
}

impl Block<'_> {
    /// Decodes a block. `previous` is the element before it, and becomes its last one.
    fn decode(self, data: &mut &[u8], previous: &mut [u8]) -> Result<(), Damage> {
        let controls = if self.version == 0 { &[][..] } else { take(data, self.stride / 4)? };
        let count = self.elements.len() / self.stride;
        let mut bytes = [[0; MOST_BLOCK_ELEMENTS]; 4];
        for word in 0..self.stride / 4 {
            let control = controls.get(word).copied();
            for (byte, channel) in bytes.iter_mut().enumerate() {
                let control = control.map(|control| control >> (2 * byte) & 3);
                decode_channel(data, control, &mut channel[..count])?;
            }
            let channel = self.channels.get(word).copied().unwrap_or(0);
            let words = Words { stride: self.stride, offset: 4 * word, previous };
            words.undo_differences(&bytes, channel, self.elements)?;
        }
        previous.copy_from_slice(&self.elements[(count - 1) * self.stride..]);
        Ok(())
    }
}

/// Decodes the bytes of a channel: `control` is that of version 1.
fn decode_channel(data: &mut &[u8], control: Option<u8>, channel: &mut [u8]) -> Result<(), Damage> {
    let bits = match control {
        None => [0, 2, 4, 8],
        Some(0) => [0, 1, 2, 4],
        Some(1) => [1, 2, 4, 8],
        Some(2) => {
            channel.fill(0);
            return Ok(());
        }
        Some(_) => {
            channel.copy_from_slice(take(data, channel.len())?);
            return Ok(());
        }
    };
    let groups = channel.len().div_ceil(GROUP);
    let header = take(data, groups.div_ceil(4))?;
    for (index, group) in channel.chunks_mut(GROUP).enumerate() {
        let mode = header[index / 4] >> (2 * (index % 4)) & 3;
        let whole = decode_group(data, bits[usize::from(mode)])?;
        group.copy_from_slice(&whole[..group.len()]);
    }
    Ok(())
}

/// Decodes 16 bytes of this number of bits. A byte that does not fit is all ones, and follows behind the group.
fn decode_group(data: &mut &[u8], bits: usize) -> Result<[u8; GROUP], Damage> {
    let mut group = [0; GROUP];
    match bits {
        0 => return Ok(group),
        8 => {
            group.copy_from_slice(take(data, GROUP)?);
            return Ok(group);
        }
        _ => {}
    }
    let packed = take(data, GROUP * bits / 8)?;
    let escape = (1_u8 << bits) - 1;
    for (index, value) in group.iter_mut().enumerate() {
        let at = index * bits;
        // The first value has the highest bits, except for single bits.
        let shift = if bits == 1 { at % 8 } else { 8 - bits - at % 8 };
        *value = packed[at / 8] >> shift & escape;
        if *value == escape {
            *value = take(data, 1)?[0];
        }
    }
    Ok(group)
}

/// Four bytes of each element of a block.
struct Words<'a> {
    stride: usize,
    offset: usize,
    previous: &'a [u8],
}

impl Words<'_> {
    fn undo_differences(
        &self,
        bytes: &[[u8; MOST_BLOCK_ELEMENTS]; 4],
        channel: u8,
        elements: &mut [u8],
    ) -> Result<(), Damage> {
        let start = &self.previous[self.offset..self.offset + 4];
        let mut last = [start[0], start[1], start[2], start[3]];
        for (index, element) in elements.chunks_exact_mut(self.stride).enumerate() {
            let difference = [bytes[0][index], bytes[1][index], bytes[2][index], bytes[3][index]];
            last = match channel & 3 {
                0 => add_bytes(last, difference),
                1 => add_shorts(last, difference),
                2 => {
                    let rotated = u32::from_le_bytes(difference).rotate_right(u32::from(channel >> 4));
                    (u32::from_le_bytes(last) ^ rotated).to_le_bytes()
                }
                _ => return Err("a channel has an unknown mode"),
            };
            element[self.offset..self.offset + 4].copy_from_slice(&last);
        }
        Ok(())
    }
}

fn add_bytes(last: [u8; 4], difference: [u8; 4]) -> [u8; 4] {
    let signed = |byte: u8| byte >> 1 ^ (byte & 1).wrapping_neg();
    std::array::from_fn(|i| last[i].wrapping_add(signed(difference[i])))
}

fn add_shorts(last: [u8; 4], difference: [u8; 4]) -> [u8; 4] {
    let short = |bytes: [u8; 4], at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let signed = |short: u16| short >> 1 ^ (short & 1).wrapping_neg();
    let sum = |at| short(last, at).wrapping_add(signed(short(difference, at))).to_le_bytes();
    let ([a, b], [c, d]) = (sum(0), sum(2));
    [a, b, c, d]
}
