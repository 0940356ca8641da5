//! Colours of vertices (`v x y z r g b`).

use super::warnings::Warnings;

/// Stands for the colour of a vertex that has none. Such a vertex is white.
pub(super) const UNCOLORED: [f32; 3] = [f32::NAN; 3];

/// Highest channel of colours in the unit range that are too bright; beyond it the range is another one.
const BRIGHT: f32 = 8.0;

/// The colours as linear light with Rec. 709 primaries, 0 to 1; none if all are white.
///
/// Files hold sRGB, as Blender, MeshLab and photogrammetry write it and Blender and three.js read it: 0 to 1, some 0 to 255,
/// a few 0 to 65,535. A warning names any other range than the first.
pub(super) fn linear(mut colors: Vec<[f32; 3]>, warnings: &mut Warnings) -> Vec<[f32; 3]> {
    let channels = || colors.iter().flatten().filter(|channel| !channel.is_nan());
    let highest = channels().fold(0.0_f32, |highest, channel| highest.max(*channel));
    let is_whole = channels().all(|channel| channel.fract() == 0.0 && *channel >= 0.0);
    let full = match highest {
        ..=1.0 => 1.0,
        ..=255.0 if is_whole || highest > BRIGHT => 255.0,
        255.0..=65_535.0 => 65_535.0,
        _ => 1.0,
    };
    if highest > 1.0 {
        let done = match full {
            1.0 => "what is beyond 1 is taken as 1".to_owned(),
            full => format!("they are taken as 0 to {full}"),
        };
        warnings.push("vertex colours", format!("vertex colours reach {highest}; {done}"));
    }
    let is_white = |color: &[f32; 3]| color.iter().all(|channel| channel.is_nan() || *channel >= full);
    if colors.iter().all(is_white) {
        return Vec::new();
    }
    for channel in colors.iter_mut().flatten() {
        *channel = if channel.is_nan() { 1.0 } else { decode_srgb((*channel / full).clamp(0.0, 1.0)) };
    }
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
pub(super) fn decode_srgb(encoded: f32) -> f32 {
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
        assert_eq!(warnings, ["vertex colours reach 2; what is beyond 1 is taken as 1"]);
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
    fn the_range_follows_from_the_highest_number() {
        let (colors, warnings) = found(&[[255.0, 128.0, 0.0], [1.0; 3], UNCOLORED]);
        assert_eq!((colors[0][0], colors[0][2], colors[2]), (1.0, 0.0, [1.0; 3]));
        assert!((colors[0][1] - 0.215_86).abs() < 1e-5);
        assert!(
            colors[1].iter().all(|channel| (0.0..0.001).contains(channel)),
            "a dark byte: {:?}",
            colors[1]
        );
        assert_eq!(warnings, ["vertex colours reach 255; they are taken as 0 to 255"]);
        let (dark, _) = found(&[[1.0; 3], [2.0, 1.0, 1.0]]);
        assert!(dark.iter().flatten().all(|channel| *channel < 0.001), "{dark:?}");
        let (averaged, warnings) = found(&[[254.5, 9.5, 9.5]]);
        assert!(averaged[0][0] > 0.99 && averaged[0][1] < 0.01 && warnings.len() == 1, "{averaged:?}");
        let (deep, warnings) = found(&[[65_535.0, 0.0, 300.0]]);
        assert_eq!((deep[0][0], deep[0][1]), (1.0, 0.0));
        assert_eq!(warnings, ["vertex colours reach 65535; they are taken as 0 to 65535"]);
        let (bright, warnings) = found(&[[1.5, 0.5, 0.0]]);
        assert_eq!((bright[0][0], warnings.len()), (1.0, 1), "a number beyond the range is clamped");
        assert_eq!(
            found(&[[1e9, 0.0, 0.0]]).1,
            ["vertex colours reach 1000000000; what is beyond 1 is taken as 1"]
        );
    }
}
