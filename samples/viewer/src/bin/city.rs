//! Writes a city made by code as a glTF file: `city city.glb`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use lvk::temporary_file::replace_file;
use lvk_samples::app::value_parsers::whole;
use lvk_viewer::city::{CityConfig, city};

/// Writes a city made by code as a glTF file for the viewer: millions of triangles by instances
#[derive(Parser)]
#[command(version)]
struct Args {
    /// File to write, .glb; it replaces one of that name
    file: PathBuf,

    /// Blocks along each side of the city, 1 to 64
    #[arg(long, value_name = "N", default_value_t = CityConfig::default().blocks)]
    #[arg(value_parser = whole(1..=CityConfig::MOST_BLOCKS))]
    blocks: u32,

    /// Kinds of buildings, 1 to 256, each a mesh of its own
    #[arg(long, value_name = "N", default_value_t = CityConfig::default().kinds)]
    #[arg(value_parser = whole(1..=CityConfig::MOST_KINDS))]
    kinds: u32,

    /// Cities of other seeds differ
    #[arg(long, value_name = "N", default_value_t = CityConfig::default().seed)]
    seed: u64,

    /// Texels along each side of the textures, up to 4096; 0 for none
    #[arg(long, value_name = "N", default_value_t = CityConfig::default().texture_size)]
    #[arg(value_parser = whole(0..=CityConfig::MOST_TEXTURE_SIZE))]
    texture_size: u32,
}

fn main() -> ExitCode {
    match write(&Args::parse()) {
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

fn write(args: &Args) -> Result<String, String> {
    let Args { file, blocks, kinds, seed, texture_size } = args;
    let name = lvk::readable_name(file);
    if !file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("glb")) {
        return Err(format!("{name}: the city is a GLB file; give it a name that ends with .glb"));
    }
    let config = CityConfig { blocks: *blocks, kinds: *kinds, seed: *seed, texture_size: *texture_size };
    let city = city(&config).map_err(|error| error.to_string())?;
    replace_file(file, &city.glb).map_err(|error| format!("cannot write {name}: {error}"))?;
    Ok(format!(
        "{name}: {:.1} MB, {} textures, {} meshes of {} triangles, {} instances of {} triangles",
        city.glb.len() as f64 / 1e6,
        city.texture_count,
        city.mesh_count,
        city.distinct_triangles,
        city.instance_count,
        city.triangles
    ))
}
