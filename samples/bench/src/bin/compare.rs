//! Compares two images: `compare FIRST.png SECOND.png` prints PSNR, SSIM and the share of differing pixels.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use image::RgbaImage;
use lvk_samples::app::metrics;

/// Compares two images of the same size.
#[derive(Parser)]
#[command(version)]
struct Args {
    /// First image
    first: PathBuf,
    /// Second image
    second: PathBuf,
}

fn main() -> ExitCode {
    match compare(&Args::parse()) {
        Ok(line) => {
            println!("{line}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("error: {message}");
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
    found.map(|difference| difference.to_string()).map_err(|error| error.to_string())
}

fn read(path: &Path) -> Result<RgbaImage, String> {
    let picture = image::open(path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(picture.to_rgba8())
}
