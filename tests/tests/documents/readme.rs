//! The README's first program is an example of the library that runs, its figures are those of the page on performance, and it
//! stays short.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::ffi::OsStr;
use std::path::Path;

use lvk_tests::device::vulkan;
use lvk_tests::subprocess::in_subprocess;

use crate::held_by::cells;

#[path = "../../../lvk/examples/triangle.rs"]
mod triangle;

/// Width and height of the image that the example writes.
const SIZE: usize = 512;
/// Bytes of a pixel of a PPM image.
const PIXEL: usize = 3;

fn project_file(path: &str) -> String {
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    std::fs::read_to_string(project.join(path)).unwrap()
}

/// The number of lines that are not blank.
fn written_lines(text: &str) -> usize {
    text.lines().filter(|line| !line.trim().is_empty()).count()
}

#[test]
fn the_first_program_of_the_readme_is_the_example_and_is_small() {
    let readme = project_file("README.md");
    let (_, block) = readme.split_once("\n```rust\n").unwrap();
    let (code, _) = block.split_once("```").unwrap();
    let example = project_file("lvk/examples/triangle.rs");
    assert_eq!(code, example, "copy lvk/examples/triangle.rs to README.md");
    let (_, shader) = example.split_once("r\"").unwrap();
    let (shader, _) = shader.split_once("\";").unwrap();
    let (all, shader) = (written_lines(&example), written_lines(shader));
    assert!(all <= 40 && all - shader <= 30, "{all} lines, {shader} of them the shader's");
}

#[test]
fn the_pipeline_triangle_of_the_samples_is_small() {
    let lines = project_file("samples/src/bin/triangle.rs").lines().count();
    assert!(lines <= 100, "{lines} lines");
}

/// Numbers with a fraction, as `1.05`.
fn fractions(text: &str) -> Vec<&str> {
    let numbers = text.split(|letter: char| !letter.is_ascii_digit() && letter != '.');
    let numbers = numbers.map(|number| number.trim_matches('.'));
    numbers.filter(|number| number.contains('.')).collect()
}

/// A figure that is measured anew in one place only would be wrong in the other.
#[test]
fn figures_of_the_readme_stand_in_the_page_on_performance() {
    let (readme, performance) = (project_file("README.md"), project_file("docs/performance.md"));
    let known = fractions(&performance);
    let (_, section) = readme.split_once("\n## Performance\n").unwrap();
    let (section, _) = section.split_once("\n## ").unwrap();
    let figures: Vec<_> = section.lines().filter_map(cells).flat_map(|row| fractions(row[1])).collect();
    assert!(figures.len() >= 8, "{figures:?}");
    let missing: Vec<_> = figures.iter().filter(|figure| !known.contains(figure)).collect();
    assert!(missing.is_empty(), "not in docs/performance.md: {missing:?}");
}

#[test]
fn the_readme_is_short() {
    let lines = project_file("README.md").lines().count();
    assert!(lines <= 150, "{lines} lines");
}

/// The example opens the loader that the dynamic linker finds: in a new process that is the fetched one.
#[test]
fn the_first_program_of_the_readme_shows_a_triangle() {
    let Some(library) = vulkan() else { return };
    let folder = library.and_then(Path::parent).map(Path::as_os_str);
    let variables: Vec<(&str, Option<&OsStr>)> =
        folder.iter().map(|folder| ("LD_LIBRARY_PATH", Some(*folder))).collect();
    in_subprocess(the_first_program_of_the_readme_shows_a_triangle, &variables, || {
        let folder = tempfile::tempdir().unwrap();
        std::env::set_current_dir(folder.path()).unwrap();
        triangle::main().unwrap();
        assert_shows_a_triangle(&std::fs::read("triangle.ppm").unwrap());
    });
}

/// The middle, a corner of the image and a point beside each edge have the colors of the shader.
fn assert_shows_a_triangle(image: &[u8]) {
    let pixels = image.strip_prefix(b"P6 512 512 255\n").unwrap();
    assert_eq!(pixels.len(), SIZE * SIZE * PIXEL);
    let at = |x: usize, y: usize| {
        let first = (y * SIZE + x) * PIXEL;
        [pixels[first], pixels[first + 1], pixels[first + 2]]
    };
    let background = [26; PIXEL];
    for (x, y) in [(0, 0), (511, 511), (256, 70), (256, 415), (100, 240), (411, 240)] {
        assert_eq!(at(x, y), background, "at {x}, {y}");
    }
    // The vertices are at (-0.7, 0.6), (0.7, 0.6) and (0, -0.7); red and green weigh the second and the third.
    for (x, y) in [(256, 256), (120, 400), (391, 400), (256, 90)] {
        let [point_x, point_y] = [x, y].map(|pixel| (pixel as f32 + 0.5) / 256.0 - 1.0);
        let third = (0.6 - point_y) / 1.3;
        let second = (point_x + 0.7 - 0.7 * third) / 1.4;
        let expected = [second, third, 0.5].map(|color| color * 255.0);
        let color = at(x, y).map(f32::from);
        let is_close = color.iter().zip(expected).all(|(is, should)| (is - should).abs() <= 1.0);
        assert!(is_close, "{color:?} at {x}, {y}, not {expected:?}");
    }
}
