//! Compares two images: `compare FIRST.png SECOND.png` prints PSNR, SSIM, FLIP and the share of differing pixels.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use image::RgbaImage;
use lvk_bench::flip::flip_errors;
use lvk_samples::app::metrics;
use lvk_samples::picture::{self, Bounds};

/// Compares two images of the same size.
#[derive(Parser)]
#[command(version)]
struct Args {
    /// First image
    first: PathBuf,
    /// Second image, the reference of FLIP
    second: PathBuf,
}

fn main() -> ExitCode {
    match compare(&Args::parse()) {
        Ok(line) => {
            println!("{line}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("error: {}", lvk::readable_text(&message));
            ExitCode::from(2)
        }
    }
}

fn compare(args: &Args) -> Result<String, String> {
    let (first, second) = (read(&args.first)?, read(&args.second)?);
    if first.dimensions() != second.dimensions() {
        let sizes = (first.dimensions(), second.dimensions());
        return Err(format!("the images differ in size: {:?} and {:?}", sizes.0, sizes.1));
    }
    let (width, height) = first.dimensions();
    let found = metrics::compare(first.as_raw(), second.as_raw(), width, height);
    let found = found.map_err(|error| error.to_string())?;
    let errors = flip_errors(&first, &second);
    let flip = errors.iter().map(|error| f64::from(*error)).sum::<f64>() / errors.len().max(1) as f64;
    Ok(format!("{found}, FLIP {flip:.4}"))
}

fn read(path: &Path) -> Result<RgbaImage, String> {
    let named = |error: String| format!("{}: {error}", lvk::readable_name(path));
    let picture = picture::read(path, &Bounds::unshrunk())
        .map_err(|error| named(error.to_string().trim_end().to_owned()))?;
    if let Some(warning) = picture.warnings.first() {
        return Err(named(warning.clone()));
    }
    RgbaImage::from_raw(picture.width, picture.height, picture.rgba)
        .ok_or_else(|| named("the image has too few texels".to_owned()))
}
