//! Colours of vertices (`v x y z r g b`).

use super::warnings::Warnings;

/// The colours as linear light with Rec. 709 primaries, 0 to 1; none if all are white.
///
/// Files hold sRGB, as Blender, MeshLab and photogrammetry write it and Blender and three.js read it. Some hold 0 to 255.
pub(super) fn linear(mut colors: Vec<[f32; 3]>, warnings: &mut Warnings) -> Vec<[f32; 3]> {
    let highest = colors.iter().flatten().fold(0.0_f32, |highest, channel| highest.max(*channel));
    let is_byte = |channel: &f32| channel.fract() == 0.0 && (0.0..=255.0).contains(channel);
    let is_bytes = highest > 1.0 && colors.iter().flatten().all(is_byte);
    if is_bytes {
        // Positions without a colour are white in the unit range.
        colors.iter_mut().filter(|color| **color != [1.0; 3]).flatten().for_each(|channel| *channel /= 255.0);
        let line = format!("vertex colours reach {highest}; they are taken as 0 to 255");
        warnings.push("vertex colours", line);
    }
    if colors.iter().flatten().all(|channel| *channel >= 1.0) {
        return Vec::new();
    }
    colors.iter_mut().flatten().for_each(|channel| *channel = decode_srgb(channel.clamp(0.0, 1.0)));
    colors
}

/// The colours of a `#MRGB` line of ZBrush: eight hexadecimal digits each, mask, red, green and blue. 0 to 1, sRGB.
pub(super) fn painted(text: &[u8]) -> Vec<[f32; 3]> {
    let digits = text.trim_ascii().as_chunks::<8>().0;
    let color = |digits: &[u8; 8]| {
        let value = u32::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?;
        let [_, red, green, blue] = value.to_be_bytes();
        Some([red, green, blue].map(|channel| f32::from(channel) / 255.0))
    };
    digits.iter().map_while(color).collect()
}

/// The linear value of an sRGB-encoded one (IEC 61966-2-1), both 0 to 1.
fn decode_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::light::encode_srgb;

    fn found(colors: &[[f32; 3]]) -> (Vec<[f32; 3]>, Vec<String>) {
        let mut warnings = Warnings::default();
        (linear(colors.to_vec(), &mut warnings), warnings.into_lines())
    }

    #[test]
    fn colors_are_decoded_from_srgb() {
        let (colors, warnings) = found(&[[0.0, 0.5, 1.0], [-1.0, 2.0, 0.02]]);
        assert_eq!((colors[0][0], colors[0][2], colors[1][..2].to_vec()), (0.0, 1.0, vec![0.0, 1.0]));
        assert!((colors[0][1] - 0.214_041).abs() < 1e-5 && (colors[1][2] - 0.02 / 12.92).abs() < 1e-7);
        assert!(warnings.is_empty());
        for byte in 0..=255_u8 {
            assert_eq!(encode_srgb(decode_srgb(f32::from(byte) / 255.0)), byte);
        }
    }

    #[test]
    fn painted_colors_are_hexadecimal() {
        assert_eq!(painted(b" ffff0000000080ff \r"), [[1.0, 0.0, 0.0], [0.0, 128.0 / 255.0, 1.0]]);
        assert_eq!(painted(b"ffFF0000 00ff00"), [[1.0, 0.0, 0.0]]);
        assert_eq!(painted(b"block of colours"), [[0.0; 3]; 0]);
    }

    #[test]
    fn white_alone_is_no_color() {
        assert_eq!(found(&[[1.0; 3]; 3]), (Vec::new(), Vec::new()));
        assert_eq!(found(&[]), (Vec::new(), Vec::new()));
    }

    #[test]
    fn bytes_are_told_by_their_range() {
        let (colors, warnings) = found(&[[255.0, 128.0, 0.0], [1.0; 3]]);
        assert_eq!((colors[0][0], colors[0][2], colors[1]), (1.0, 0.0, [1.0; 3]));
        assert!((colors[0][1] - 0.215_86).abs() < 1e-5);
        assert_eq!(warnings, ["vertex colours reach 255; they are taken as 0 to 255"]);
        let (bright, _) = found(&[[1.5, 0.5, 0.0]]);
        assert_eq!(bright[0][0], 1.0, "a number beyond the range is clamped");
    }
}
