//! Light from all directions in a Radiance HDR file (Ward, 1991).

use std::path::Path;

use lvk_samples::app::input_file::{self, FileKind};

use super::radiance_picture::{RadianceError, RadiancePicture};
use super::sky_map::SkyMap;

/// Most texels in a row of a file.
const MOST_FILE_WIDTH: u32 = 8192;
/// Most texels in a row of the map that is made of a file: finer files are averaged.
const MOST_MAP_WIDTH: u32 = 2048;
/// Largest radiance that is kept: a sun in the picture is a few texels.
const MOST_RADIANCE: f32 = 1e8;

/// Errors of reading an environment file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentError {
    /// The file cannot be read.
    #[error("{file}: {source}")]
    Read {
        /// The file.
        file: String,
        /// Why.
        source: std::io::Error,
    },
    /// The file is no Radiance HDR file, or it is damaged.
    #[error("{file} is no whole Radiance HDR file ({source}); export the picture again, as .hdr")]
    Decode {
        /// The file.
        file: String,
        /// Why.
        source: RadianceError,
    },
    /// The picture does not show all directions, or it is too large.
    #[error(
        "{file} has {width} x {height} texels; an environment is twice as wide as high, 2 to {} texels wide",
        MOST_FILE_WIDTH
    )]
    Size {
        /// The file.
        file: String,
        /// Texels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The header states more texels than a file of this length can have.
    #[error(
        "{file} has {bytes} bytes of texels, too few for the {width} x {height} texels that it states, which take {least} at \
         least; it is cut off or damaged: export the picture again, as .hdr"
    )]
    TooFewBytes {
        /// The file.
        file: String,
        /// Texels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes behind the header.
        bytes: u64,
        /// Fewest bytes of so many texels.
        least: u64,
    },
}

/// Reads a file as a map of the sky, turned around the vertical.
pub(super) fn read(path: &Path, rotation_degrees: f32) -> Result<SkyMap, EnvironmentError> {
    let file = || lvk::readable_name(path);
    let bytes = input_file::read_named_by_user(path, FileKind::Environment)
        .map_err(|source| EnvironmentError::Read { file: file(), source })?;
    let failed = |source| EnvironmentError::Decode { file: file(), source };
    let mut picture = RadiancePicture::new(&bytes).map_err(failed)?;
    let (width, height) = (picture.width, picture.height);
    if u64::from(width) != 2 * u64::from(height) || !(2..=MOST_FILE_WIDTH).contains(&width) {
        return Err(EnvironmentError::Size { file: file(), width, height });
    }
    let (bytes, least) = (picture.bytes_left(), picture.least_bytes());
    if bytes < least {
        return Err(EnvironmentError::TooFewBytes { file: file(), width, height, bytes, least });
    }
    let mut averaged = AveragedScanlines::new(width, height);
    for _ in 0..height {
        let mut row = picture.next_scanline().map_err(failed)?;
        row.as_flattened_mut().iter_mut().for_each(|channel| *channel = radiance(*channel));
        averaged.push(row);
    }
    let mut map = averaged.map;
    turn(&mut map, rotation_degrees);
    Ok(map)
}

/// Radiance that can be summed: no number is 0.
fn radiance(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, MOST_RADIANCE) }
}

/// A map that is made of the rows of a picture, one after another. Of a wide picture, squares of four texels are averaged, once or
/// more; no other rows are kept than those that wait for the next one.
struct AveragedScanlines {
    map: SkyMap,
    /// A row of each finer size, the finest first, that waits for the next one; empty without one.
    waiting: Vec<Vec<[f32; 3]>>,
}

impl AveragedScanlines {
    /// No rows of a picture of this size.
    fn new(mut width: u32, mut height: u32) -> Self {
        let mut waiting = Vec::new();
        while width > MOST_MAP_WIDTH {
            (width, height) = (width / 2, height / 2);
            waiting.push(Vec::new());
        }
        let texels = Vec::with_capacity(width as usize * height as usize);
        Self { map: SkyMap { width, height, texels }, waiting }
    }

    /// Adds the next row of the picture.
    fn push(&mut self, mut row: Vec<[f32; 3]>) {
        for upper in &mut self.waiting {
            if upper.is_empty() {
                *upper = row;
                return;
            }
            row = halved(&std::mem::take(upper), &row);
        }
        self.map.texels.extend(row);
    }
}

/// The means of squares of four texels of two rows. A last column without a partner is left out.
fn halved(upper: &[[f32; 3]], lower: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
    let mean = |([a, b], [c, d]): (&[[f32; 3]; 2], &[[f32; 3]; 2])| {
        let of = |channel: usize| (a[channel] + b[channel] + c[channel] + d[channel]) / 4.0;
        [of(0), of(1), of(2)]
    };
    pairs.map(mean).collect()
}

/// Turns the map around the vertical, by whole texels.
fn turn(map: &mut SkyMap, degrees: f32) {
    let columns = (degrees / 360.0 * map.width as f32).round() as i64;
    // Columns go from -x over +x, where the middle is, to -x again, clockwise from above; see `direction_at`.
    let steps = (-columns).rem_euclid(i64::from(map.width)) as usize;
    map.texels.chunks_mut(map.width as usize).for_each(|row| row.rotate_right(steps));
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::path::PathBuf;

    use image::Rgb;
    use image::codecs::hdr::HdrEncoder;

    use super::*;

    fn written(folder: &Path, name: &str, width: usize, texels: &[[f32; 3]]) -> PathBuf {
        let path = folder.join(name);
        let pixels: Vec<_> = texels.iter().map(|texel| Rgb(*texel)).collect();
        let height = texels.len() / width;
        HdrEncoder::new(File::create(&path).unwrap()).encode(&pixels, width, height).unwrap();
        path
    }

    #[test]
    fn a_file_gives_its_radiance_from_its_directions() {
        let folder = tempfile::tempdir().unwrap();
        let mut texels = vec![[0.25, 0.5, 1.0]; 16 * 8];
        texels[3 * 16 + 10] = [64.0, 32.0, 16.0];
        let path = written(folder.path(), "sky.hdr", 16, &texels);
        assert_eq!(read(&path, 0.0).unwrap(), SkyMap { width: 16, height: 8, texels: texels.clone() });
        // A quarter is four of sixteen columns.
        let turned = read(&path, 90.0).unwrap();
        assert_eq!(turned.texels[3 * 16 + 6], [64.0, 32.0, 16.0]);
        assert_eq!(read(&path, -270.0).unwrap(), turned);
    }

    #[test]
    fn fine_files_are_averaged_to_the_same_light() {
        let (width, height) = (4096_u32, 2048_u32);
        let mut texels = vec![[1.0; 3]; (width * height) as usize];
        texels[(700 * width + 900) as usize] = [1024.0; 3];
        let fine = SkyMap { width, height, texels };
        let mut averaged = AveragedScanlines::new(width, height);
        fine.texels.chunks(4096).for_each(|row| averaged.push(row.to_vec()));
        let coarse = averaged.map;
        assert_eq!((coarse.width, coarse.height, coarse.texels.len()), (2048, 1024, 2048 * 1024));
        assert!((coarse.mean() / fine.mean() - 1.0).abs().max_element() < 1e-4);
        assert_eq!(coarse.texels[350 * 2048 + 450], [(1024.0 + 3.0) / 4.0; 3]);
    }

    #[test]
    fn a_last_row_and_column_without_a_partner_are_left_out() {
        let mut averaged = AveragedScanlines::new(4098, 2049);
        for row in 0..2049_u16 {
            averaged.push((0..4098_u16).map(|column| [f32::from(column), f32::from(row), 1.0]).collect());
        }
        assert_eq!(
            (averaged.map.width, averaged.map.height, averaged.map.texels.len()),
            (1024, 512, 1024 * 512)
        );
        assert_eq!(averaged.map.texels.last(), Some(&[4093.5, 2045.5, 1.0]));
    }

    #[test]
    fn files_that_are_no_environment_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        assert!(matches!(read(&place("absent.hdr"), 0.0), Err(EnvironmentError::Read { .. })));
        std::fs::write(place("text.hdr"), "P6 1 1").unwrap();
        std::fs::write(place("huge.hdr"), "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8192 +X 16384\n")
            .unwrap();
        let square = written(folder.path(), "square.hdr", 4, &[[1.0; 3]; 16]);
        let whole = std::fs::read(written(folder.path(), "cut.hdr", 64, &vec![[1.0; 3]; 64 * 32])).unwrap();
        std::fs::write(place("cut.hdr"), &whole[..whole.len() - 9]).unwrap();
        assert!(matches!(read(&square, 0.0), Err(EnvironmentError::Size { width: 4, height: 4, .. })));
        let error = read(&place("huge.hdr"), 0.0).unwrap_err().to_string();
        assert!(error.contains("16384 x 8192"), "{error}");
        for name in ["text.hdr", "cut.hdr"] {
            let error = read(&place(name), 0.0).unwrap_err();
            assert!(
                matches!(error, EnvironmentError::Decode { .. }) && error.to_string().contains(name),
                "{error}"
            );
        }
    }

    #[test]
    fn values_that_are_no_radiance_do_not_get_through() {
        for (value, expected) in [(f32::NAN, 0.0), (-1.0, 0.0), (f32::INFINITY, MOST_RADIANCE), (2.0, 2.0)] {
            assert_eq!(radiance(value), expected);
        }
    }
}
