//! Mip levels of images whose sides are not powers of two.
//!
//! A device halves an image by linear blits. Where a side is odd, a blit weighs texels unevenly, and the middle one alone is left of three.
//! Levels of such images are made here instead: each has the mean of the one before.

use super::vertex_colors::decode_srgb;

/// Channels of a texel: red, green, blue, alpha.
const CHANNELS: usize = 4;

/// How the numbers of an image encode light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Red, green and blue are sRGB-encoded, alpha is linear.
    Srgb,
    /// All channels are linear.
    Linear,
}

/// True if linear blits make mip levels with the mean of the image: both sides are powers of two.
#[must_use]
pub fn blits_keep_the_mean([width, height]: [u32; 2]) -> bool {
    width.is_power_of_two() && height.is_power_of_two()
}

/// Returns the mip levels below an image, down to one texel. Each side is half of the one before, rounded down, and 1 at least.
///
/// `texels`: four channels of 8 bits, in rows without gaps, of an image of `extent` texels. A texel of a level is the mean of the texels that
/// it covers, by area: two of an even side, three of an odd one (Guthe and Heckbert, "Non-Power-of-Two Mipmapping", 2005).
///
/// # Panics
/// If `texels` does not have `4 * width * height` bytes.
#[must_use]
pub fn mip_levels(texels: &[u8], extent: [u32; 2], encoding: Encoding) -> Vec<Vec<u8>> {
    let codec = Codec::new(encoding);
    let mut extent = extent.map(|side| side as usize);
    assert_eq!(texels.len(), CHANNELS * extent[0] * extent[1], "texels of an image of {extent:?}");
    let mut levels: Vec<Vec<u8>> = Vec::new();
    while extent != [1, 1] {
        let level = halved(levels.last().map_or(texels, Vec::as_slice), extent, &codec);
        levels.push(level);
        extent = extent.map(half);
    }
    levels
}

fn half(side: usize) -> usize {
    (side / 2).max(1)
}

/// The next level of an image.
fn halved(texels: &[u8], extent: [usize; 2], codec: &Codec) -> Vec<u8> {
    let [width, height] = extent;
    let columns: Vec<_> = (0..half(width)).map(|column| box_weights(width, column)).collect();
    let mut level = Vec::with_capacity(CHANNELS * half(width) * half(height));
    for row in 0..half(height) {
        let rows = box_weights(height, row);
        for column in &columns {
            let mut mean = [0.0; CHANNELS];
            for (y, share) in rows {
                for (x, part) in column {
                    let first = CHANNELS * (y * width + x);
                    for (channel, sum) in mean.iter_mut().enumerate() {
                        *sum += share * part * codec.decoded(channel, texels[first + channel]);
                    }
                }
            }
            level.extend((0..CHANNELS).map(|channel| codec.encoded(channel, mean[channel])));
        }
    }
    level
}

/// The texels of a side of `side` that texel `place` of half of it covers, and their shares.
fn box_weights(side: usize, place: usize) -> [(usize, f32); 3] {
    let first = 2 * place;
    if side == 1 {
        return [(0, 1.0), (0, 0.0), (0, 0.0)];
    }
    if side.is_multiple_of(2) {
        return [(first, 0.5), (first + 1, 0.5), (first + 1, 0.0)];
    }
    let share = |part: usize| part as f32 / side as f32;
    let count = side / 2;
    [(first, share(count - place)), (first + 1, share(count)), (first + 2, share(place + 1))]
}

/// Decodes and encodes the numbers of an image.
struct Codec {
    /// The linear value of each number of red, green and blue.
    colors: [f32; 256],
    /// The value from which on the next number is nearer.
    thresholds: [f32; 255],
}

impl Codec {
    fn new(encoding: Encoding) -> Self {
        let decode = |encoded: f32| match encoding {
            Encoding::Srgb => decode_srgb(encoded),
            Encoding::Linear => encoded,
        };
        Self {
            colors: std::array::from_fn(|number| decode(number as f32 / 255.0)),
            thresholds: std::array::from_fn(|number| decode((number as f32 + 0.5) / 255.0)),
        }
    }

    fn decoded(&self, channel: usize, number: u8) -> f32 {
        if channel == CHANNELS - 1 { f32::from(number) / 255.0 } else { self.colors[usize::from(number)] }
    }

    fn encoded(&self, channel: usize, value: f32) -> u8 {
        if channel == CHANNELS - 1 {
            return (value * 255.0 + 0.5) as u8;
        }
        self.thresholds.partition_point(|threshold| *threshold <= value) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::light::encode_srgb;
    use proptest::prelude::*;

    /// The mean of each channel, linear.
    fn means(texels: &[u8], encoding: Encoding) -> [f64; CHANNELS] {
        let codec = Codec::new(encoding);
        let count = (texels.len() / CHANNELS) as f64;
        std::array::from_fn(|channel| {
            let numbers = texels.iter().skip(channel).step_by(CHANNELS);
            numbers.map(|number| f64::from(codec.decoded(channel, *number))).sum::<f64>() / count
        })
    }

    #[test]
    fn numbers_that_are_decoded_and_encoded_stay() {
        for encoding in [Encoding::Srgb, Encoding::Linear] {
            let codec = Codec::new(encoding);
            for number in 0..=255 {
                for channel in 0..CHANNELS {
                    assert_eq!(codec.encoded(channel, codec.decoded(channel, number)), number);
                }
            }
        }
        let codec = Codec::new(Encoding::Srgb);
        for step in 0..=1000 {
            let value = step as f32 / 1000.0;
            assert_eq!(codec.encoded(0, value), encode_srgb(value), "{value}");
        }
    }

    #[test]
    fn three_texels_count_alike() {
        let texels: Vec<u8> = [255, 0, 0].into_iter().flat_map(|number| [number; CHANNELS]).collect();
        assert_eq!(mip_levels(&texels, [3, 1], Encoding::Linear), [vec![85; CHANNELS]]);
        assert_eq!(mip_levels(&texels, [1, 3], Encoding::Srgb), [vec![156, 156, 156, 85]]);
    }

    #[test]
    fn a_texel_of_half_of_five_covers_two_and_a_half() {
        assert_eq!(box_weights(5, 0), [(0, 0.4), (1, 0.4), (2, 0.2)]);
        assert_eq!(box_weights(5, 1), [(2, 0.2), (3, 0.4), (4, 0.4)]);
    }

    proptest! {
        #[test]
        fn levels_halve_the_sides_and_keep_the_mean(
            extent in [1_u32..24, 1_u32..24],
            is_srgb: bool,
            seed in proptest::collection::vec(any::<u8>(), 64),
        ) {
            let encoding = if is_srgb { Encoding::Srgb } else { Encoding::Linear };
            let count = CHANNELS * (extent[0] * extent[1]) as usize;
            let texels: Vec<u8> = (0..count).map(|place| seed[place * 7 % 64].wrapping_add((place / 64) as u8)).collect();
            let levels = mip_levels(&texels, extent, encoding);
            prop_assert_eq!(levels.len() as u32, extent[0].max(extent[1]).ilog2());
            let whole = means(&texels, encoding);
            let mut most = 0.0;
            for (level, depth) in levels.iter().zip(1..) {
                let [width, height] = extent.map(|side| (side >> depth).max(1) as usize);
                prop_assert_eq!(level.len(), CHANNELS * width * height);
                // Each level is rounded to 8 bits; a step of bright sRGB numbers is 0.0088 of linear light.
                most += if is_srgb { 0.0045 } else { 0.002 };
                for (mean, expected) in means(level, encoding).into_iter().zip(whole) {
                    prop_assert!((mean - expected).abs() <= most, "{mean} instead of {expected} in level {depth}");
                }
            }
        }
    }
}
