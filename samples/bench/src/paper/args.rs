//! The command line of `bench paper`.

use std::path::PathBuf;

use clap::Args;

use lvk_samples::app::frames::Frames;
use lvk_samples::app::ray_args::RayTracing;
use lvk_samples::app::run_args::MAX_SIZE;

/// Arguments of the paper's experiment.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct PaperArgs {
    /// Wavefront OBJ files, or scene names in the folder LVK_SCENES
    /// [default: living_room, conference and kitchen of that folder, else the built-in courtyard]
    #[arg(long, value_name = "FILE|NAME", num_args = 1..)]
    pub scenes: Vec<PathBuf>,

    /// Frames along the path of each camera [default: 4000; 12 on a driver that runs on the CPU, 4 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(Frames::MAX_COUNT)))]
    pub frames: Option<u32>,

    /// Frames per camera whose images are compared, at most --frames [default: 5; 2 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub compared: Option<u32>,

    /// Ray tracing path: auto (every path of the device), pipeline, query, or software (the library's software ray
    /// queries)
    #[arg(long, value_enum, default_value_t = RayTracing::Auto, hide_possible_values = true)]
    pub rt: RayTracing,

    /// Maximum number of reflections and refractions of a ray, 0 to 16
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(0..=16))]
    pub depth: u32,

    /// Image width in pixels [default: 1280; 640 on a driver that runs on the CPU, 256 with --quick]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SIZE)))]
    pub width: Option<u32>,

    /// Image height in pixels [default: 720; 360 on a driver that runs on the CPU, 144 with --quick]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SIZE)))]
    pub height: Option<u32>,

    /// Folder for the report, created if missing: report.md, CSV files, SVG plots and images
    #[arg(long, value_name = "FOLDER", default_value = "paper")]
    pub out: PathBuf,
}
