//! Relief on surfaces: images of directions, and of heights, which become directions.

use std::path::Path;

use super::Texture;
use super::texture::PictureBudget;

/// Scale of heights: slope of a rise from black to white within a texel.
const STEEPNESS: f32 = 2.0;

impl Texture {
    /// Reads an image of directions (red to the right, green up, blue off the surface; 0 to 255 for -1 to 1), or of heights,
    /// from which directions are made. `map_bump` of MTL files names both, and tools differ in whether green points up or down:
    /// what fits together as slopes of one surface counts.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub(super) fn read_relief(path: &Path, budget: &mut PictureBudget) -> Result<Self, String> {
        let image = Self::read(path, budget)?;
        Ok(if shows_directions(&image) { with_green_up(image) } else { directions_of_heights(&image) })
    }
}

/// The image with green turned round where it points down.
fn with_green_up(mut image: Texture) -> Texture {
    if rise_of_green(&image) < 0.0 {
        image.pixels.iter_mut().skip(1).step_by(4).for_each(|green| *green = 255 - *green);
    }
    image
}

/// Above 0 where green points up, below 0 where it points down: a surface's slope to the right changes upwards as its slope
/// upwards changes to the right.
fn rise_of_green(image: &Texture) -> f32 {
    let [width, height] = [image.width as usize, image.height as usize];
    let texels = image.pixels.as_chunks::<4>().0;
    let slope = |x: usize, y: usize, channel: usize| {
        let [across, off] = [channel, 2].map(|c| f32::from(texels[y * width + x][c]) / 127.5 - 1.0);
        if off > 0.2 { across / off } else { 0.0 }
    };
    let change = |x: usize, y: usize| {
        let upwards = slope(x, y - 1, 0) - slope(x, y + 1, 0);
        upwards * (slope(x + 1, y, 1) - slope(x - 1, y, 1))
    };
    let inside = (1..height.max(2) - 1).flat_map(|y| (1..width.max(2) - 1).map(move |x| (x, y)));
    inside.map(|(x, y)| change(x, y)).sum()
}

/// True if most of an image are directions of about unit length off the surface. Black, which some images have where
/// nothing
/// shows them, does not count.
fn shows_directions(image: &Texture) -> bool {
    let mut counts = [0_usize; 2];
    for texel in image.pixels.as_chunks::<4>().0.iter().filter(|texel| texel[..3] != [0; 3]) {
        let [x, y, z] = [0, 1, 2].map(|channel| f32::from(texel[channel]) / 127.5 - 1.0);
        let is_direction = z > 0.2 && ((x * x + y * y + z * z).sqrt() - 1.0).abs() < 0.2;
        counts[usize::from(is_direction)] += 1;
    }
    counts[1] > counts[0]
}

/// Directions at right angles to a surface with these heights, which repeats.
fn directions_of_heights(image: &Texture) -> Texture {
    let [width, height] = [image.width as usize, image.height as usize];
    let texels = image.pixels.as_chunks::<4>().0;
    let grey = |texel: &[u8; 4]| texel[..3].iter().map(|&channel| f32::from(channel)).sum::<f32>() / 765.0;
    let heights: Vec<f32> = texels.iter().map(grey).collect();
    let at = |x: usize, y: usize| heights[y % height * width + x % width];
    let pixels = (0..width * height).flat_map(|number| {
        let (x, y) = (number % width, number / width);
        // Rows run down, and green points up.
        let right = 0.5 * (at(x + 1, y) - at(x + width - 1, y));
        let up = 0.5 * (at(x, y + height - 1) - at(x, y + 1));
        let [x, y, z] = unit([-STEEPNESS * right, -STEEPNESS * up, 1.0]).map(encoded);
        [x, y, z, 255]
    });
    Texture { name: image.name.clone(), pixels: pixels.collect(), ..*image }
}

fn unit(v: [f32; 3]) -> [f32; 3] {
    let length = v.iter().map(|x| x * x).sum::<f32>().sqrt();
    v.map(|x| x / length)
}

fn encoded(value: f32) -> u8 {
    (127.5 * (value + 1.0)).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, texels: &[[u8; 3]]) -> Texture {
        let pixels = texels.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        Texture { name: "relief".to_owned(), width, height: texels.len() as u32 / width, pixels }
    }

    #[test]
    fn directions_are_told_from_heights() {
        assert!(shows_directions(&image(2, &[[128, 128, 255], [218, 128, 218]])));
        assert!(shows_directions(&image(4, &[[0; 3], [0; 3], [0; 3], [100, 140, 250]])), "black counts not");
        assert!(!shows_directions(&image(2, &[[128; 3], [200, 190, 170]])));
        assert!(!shows_directions(&image(2, &[[255; 3], [0; 3]])));
    }

    #[test]
    fn a_level_surface_points_straight_up() {
        let level = directions_of_heights(&image(2, &[[77; 3]; 4]));
        assert_eq!(level.pixels, [128, 128, 255, 255].repeat(4));
    }

    /// A hill, by directions of both kinds.
    #[test]
    fn green_comes_to_point_up() {
        let hill = |i: i32| {
            let (x, y) = (i % 16 - 8, i / 16 - 8);
            [(255.0 * (-0.05 * (x * x + y * y) as f32).exp()) as u8; 3]
        };
        let up = directions_of_heights(&image(16, &(0..256).map(hill).collect::<Vec<_>>()));
        let mut down = up.clone();
        down.pixels.iter_mut().skip(1).step_by(4).for_each(|green| *green = 255 - *green);
        assert!(rise_of_green(&up) > 1.0 && rise_of_green(&down) < -1.0);
        assert_eq!((with_green_up(up.clone()), with_green_up(down)), (up.clone(), up));
        let even = image(3, &[[192, 90, 226]; 9]);
        assert_eq!(with_green_up(even.clone()), even, "nothing tells");
    }

    /// A wall along each axis: left and below of it surfaces look away from it.
    #[test]
    fn slopes_look_downhill() {
        let column: Vec<_> = (0..25).map(|i| if i % 5 == 2 { [255; 3] } else { [0; 3] }).collect();
        let found = directions_of_heights(&image(5, &column));
        let texel =
            |found: &Texture, x: usize, y: usize| [0, 1, 2].map(|c| found.pixels[4 * (5 * y + x) + c]);
        // A rise of one half over a texel, times the steepness: 45 degrees.
        assert_eq!((texel(&found, 1, 3), texel(&found, 3, 0)), ([37, 128, 218], [218, 128, 218]));
        assert_eq!((texel(&found, 0, 3), texel(&found, 2, 3)), ([128, 128, 255], [128, 128, 255]));
        let row: Vec<_> = (0..25).map(|i| if i / 5 == 2 { [255; 3] } else { [0; 3] }).collect();
        let found = directions_of_heights(&image(5, &row));
        assert_eq!(texel(&found, 4, 1), [128, 218, 218], "above the wall they look up the image");
        assert_eq!(texel(&found, 4, 3), [128, 37, 218]);
    }
}
