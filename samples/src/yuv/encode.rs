//! Encoder from colours to planes of Y'CbCr.

use glam::Vec3;

use super::config::{YuvFormat, YuvModel, YuvRange};
use super::synthetic_video::SyntheticVideo;

/// The planes of a picture, one after the other, as they lie in memory.
pub(super) fn planes(
    video: &SyntheticVideo,
    format: YuvFormat,
    model: YuvModel,
    range: YuvRange,
) -> Vec<Vec<u8>> {
    let [width, height] = video.size;
    let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    let all: Vec<Vec3> = pixels.map(|(column, row)| differences(video.color(column, row), model)).collect();
    let halved = halve(&all, video.size);
    let luma = all.iter().map(|pixel| code(pixel.x, Channel::Luma, format, range)).collect();
    let chroma = |pixel: &Vec3, axis: usize| code(pixel[axis], Channel::Difference, format, range);
    let codes: Vec<Vec<u16>> = if format.has_two_planes() {
        vec![luma, halved.iter().flat_map(|pixel| [chroma(pixel, 1), chroma(pixel, 2)]).collect()]
    } else {
        let plane = |axis| halved.iter().map(|pixel| chroma(pixel, axis)).collect();
        vec![luma, plane(1), plane(2)]
    };
    codes.into_iter().map(|plane| bytes(&plane, format)).collect()
}

/// The meaning of a number.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Channel {
    /// 0 to 1.
    Luma,
    /// -0.5 to 0.5.
    Difference,
}

/// Y, Cb and Cr of a colour.
fn differences(color: Vec3, model: YuvModel) -> Vec3 {
    let [red, blue] = model.weights();
    let y = color.dot(Vec3::new(red, 1.0 - red - blue, blue));
    Vec3::new(y, 0.5 * (color.z - y) / (1.0 - blue), 0.5 * (color.x - y) / (1.0 - red))
}

/// Every second pixel of every second row, with a share of its neighbours: their middles are those of the pixels that stay.
fn halve(all: &[Vec3], [width, height]: [u32; 2]) -> Vec<Vec3> {
    const NEAR: [(i32, f32); 3] = [(-1, 0.25), (0, 0.5), (1, 0.25)];
    let at = |column: i32, row: i32| {
        let (column, row) = (column.clamp(0, width as i32 - 1), row.clamp(0, height as i32 - 1));
        all[row as usize * width as usize + column as usize]
    };
    let mean = |column: i32, row: i32| {
        let pairs = NEAR.iter().flat_map(|down| NEAR.iter().map(move |right| (down, right)));
        pairs.map(|(down, right)| at(column + right.0, row + down.0) * (down.1 * right.1)).sum::<Vec3>()
    };
    let places = (0..height / 2).flat_map(|row| (0..width / 2).map(move |column| (column, row)));
    places.map(|(column, row)| mean(2 * column as i32, 2 * row as i32)).collect()
}

fn code(value: f32, channel: Channel, format: YuvFormat, range: YuvRange) -> u16 {
    let step = (1_u32 << (format.bits() - 8)) as f32;
    let most = ((1_u32 << format.bits()) - 1) as f32;
    let code = match (range, channel) {
        (YuvRange::Narrow, Channel::Luma) => step * (219.0 * value + 16.0),
        (YuvRange::Narrow, Channel::Difference) => step * (224.0 * value + 128.0),
        (YuvRange::Full, Channel::Luma) => most * value,
        (YuvRange::Full, Channel::Difference) => most * value + step * 128.0,
    };
    code.round().clamp(0.0, most) as u16
}

/// 8 bits are bytes; 10 bits are the upper ones of two bytes.
fn bytes(codes: &[u16], format: YuvFormat) -> Vec<u8> {
    match format.bits() {
        8 => codes.iter().map(|code| *code as u8).collect(),
        _ => codes.iter().flat_map(|code| (code << 6).to_le_bytes()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colours_have_their_known_codes() {
        let codes = |color: [f32; 3], format, range| {
            let pixel = differences(color.into(), YuvModel::Bt709);
            [Channel::Luma, Channel::Difference, Channel::Difference]
                .iter()
                .enumerate()
                .map(|(axis, channel)| code(pixel[axis], *channel, format, range))
                .collect::<Vec<_>>()
        };
        assert_eq!(codes([1.0; 3], YuvFormat::Nv12, YuvRange::Narrow), [235, 128, 128]);
        assert_eq!(codes([0.0; 3], YuvFormat::P010, YuvRange::Narrow), [64, 512, 512]);
        assert_eq!(codes([1.0; 3], YuvFormat::P010, YuvRange::Full), [1023, 512, 512]);
        // SMPTE RP 219: red and blue of full strength.
        assert_eq!(codes([1.0, 0.0, 0.0], YuvFormat::Nv12, YuvRange::Narrow), [63, 102, 240]);
        assert_eq!(codes([0.0, 0.0, 1.0], YuvFormat::Nv12, YuvRange::Narrow), [32, 240, 118]);
    }

    #[test]
    fn planes_have_their_sizes() {
        let video = SyntheticVideo { size: [8, 6], phase: 0.0 };
        let sizes = |format| {
            let planes = planes(&video, format, YuvModel::Bt601, YuvRange::Full);
            planes.iter().map(Vec::len).collect::<Vec<_>>()
        };
        assert_eq!(sizes(YuvFormat::Nv12), [48, 24]);
        assert_eq!(sizes(YuvFormat::I420), [48, 12, 12]);
        assert_eq!(sizes(YuvFormat::P010), [96, 48]);
        assert_eq!(sizes(YuvFormat::I010), [96, 24, 24]);
    }
}
