//! The command line of the `bench` program.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use clap::{Args, Parser, Subcommand};
use lvk::DeviceProfile;

use super::paper::PaperArgs;

/// Measures what lvk costs and gains on this device, and prints tables in markdown.
///
/// Sizes that are not given suit the device: real ones on a GPU, smaller ones on a driver that runs on the CPU.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "bench", version, after_help = EXAMPLES)]
pub struct BenchArgs {
    /// What to measure
    #[command(subcommand)]
    pub(super) benchmark: Option<Benchmark>,

    /// Only see whether it works: tiny sizes, one run
    #[arg(long, global = true)]
    pub(super) quick: bool,

    /// Runs of each measurement, of which the median counts [default: by benchmark and device]
    #[arg(long, value_name = "N", global = true, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(super) runs: Option<u32>,

    /// Device to use, by its number or part of its name [default: the most capable one]
    #[arg(long, value_name = "NUMBER|NAME", global = true)]
    pub(super) device: Option<String>,

    /// Rehearse another device on this one: without what it lacks, and within its limits
    #[arg(
        long,
        value_name = "NAME",
        global = true,
        value_parser = PossibleValuesParser::new(DeviceProfile::names()).try_map(|name| DeviceProfile::named(&name))
    )]
    pub(super) profile: Option<DeviceProfile>,

    /// Print the devices and what they can do, and exit
    #[arg(long, global = true)]
    pub(super) list_devices: bool,

    /// Print the scenes that `paper --scenes` knows by name, and exit; FOLDER is searched, else that in LVK_SCENES
    #[arg(
        long,
        value_name = "FOLDER",
        num_args = 0..=1,
        default_missing_value = "",
        value_parser = clap::value_parser!(OsString),
        global = true
    )]
    pub(super) list_scenes: Option<OsString>,

    /// Run with Vulkan validation; a message is an error, and the figures mean little
    #[arg(long, global = true)]
    pub(super) validate: bool,
}

/// What to measure.
#[derive(Debug, Clone, PartialEq, Subcommand)]
pub(super) enum Benchmark {
    /// Many small meshes: one batch against a submission and a wait for each
    Batch(BatchArgs),
    /// Builds, refits and compaction of one large mesh, beside hand-written Vulkan
    Compaction(MeshArgs),
    /// What the library costs the host: draws, dispatches, objects, submissions, uploads, the start, the heap
    Core,
    /// A mesh whole and split into parts: what tracing costs
    Split(SplitArgs),
    /// Updates of a top-level structure, against a copy of the bytes and the driver's own build
    Tlas(TlasArgs),
    /// Orders of triangles: as given, along a Morton curve, by the library
    Order(TraceArgs),
    /// Ray queries walked by the library, beside the device's own tracing
    Queries(QueriesArgs),
    /// A traced frame by lvk and by hand-written Vulkan
    Overhead(TraceArgs),
    /// The paper's experiment: stand-alone and hybrid rendering along the paths of five cameras, as a report
    Paper(PaperArgs),
}

/// Sizes of [`Benchmark::Batch`].
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct BatchArgs {
    /// Number of meshes [default: 1000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) meshes: Option<u32>,

    /// Triangles of each [default: 1000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) triangles: Option<u32>,
}

/// Which mesh.
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct MeshArgs {
    /// Wavefront OBJ to measure with, its triangles in the order of the file [default: a mesh made by formulas]
    #[arg(long, value_name = "FILE")]
    pub(super) scene: Option<PathBuf>,

    /// Triangles of the mesh made by formulas [default: by benchmark and device]
    #[arg(
        long,
        value_name = "N",
        conflicts_with = "scene",
        value_parser = clap::value_parser!(u32).range(500..=100_000_000)
    )]
    pub(super) triangles: Option<u32>,
}

/// Which mesh, and what picture of it.
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct TraceArgs {
    #[command(flatten)]
    pub(super) mesh: MeshArgs,

    /// Which of the scene's five cameras to look through
    #[arg(long, value_name = "1-5", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=5))]
    pub(super) camera: u32,

    #[command(flatten)]
    pub(super) picture: PictureArgs,
}

/// How large a picture.
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct PictureArgs {
    /// Width of the picture in pixels [default: 1280, or 160 on a driver that runs on the CPU]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=16_384))]
    pub(super) width: Option<u32>,

    /// Height of the picture in pixels [default: 720, or 90 on a driver that runs on the CPU]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=16_384))]
    pub(super) height: Option<u32>,
}

/// Which mesh, what pictures of it, how many instances.
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct QueriesArgs {
    #[command(flatten)]
    pub(super) mesh: MeshArgs,

    /// Which of the scene's five cameras to look through [default: all, one after the other]
    #[arg(long, value_name = "1-5", value_parser = clap::value_parser!(u32).range(1..=5))]
    pub(super) camera: Option<u32>,

    #[command(flatten)]
    pub(super) picture: PictureArgs,

    /// Overlapping instances that the mesh is cut into
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(super) instances: u32,
}

/// Which mesh, what picture, how many parts.
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct SplitArgs {
    #[command(flatten)]
    pub(super) trace: TraceArgs,

    /// Least number of parts
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    pub(super) parts: u32,
}

/// Sizes of [`Benchmark::Tlas`].
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct TlasArgs {
    /// Number of instances; may be given several times [default: 100000 and 1000000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub(super) instances: Vec<u32>,
}

const EXAMPLES: &str = "\
Examples:
  bench batch                                      1000 meshes of 1000 triangles
  bench compaction --scene living_room.obj         builds, refits and compaction of that scene
  bench core                                       what the library costs the host, beside its limits
  bench split --parts 100 --runs 200               parts of the mesh made by formulas
  bench order --scene living_room.obj --camera 3   what the order of triangles does to rays a second
  bench queries --scene living_room.obj            ray queries in software beside the device's own tracing
  bench overhead --quick                           does it work at all?
  bench paper --out report                         the paper's tables and figures, with the scenes of LVK_SCENES

Exit status: 0 when everything was measured, 1 for trouble with the device, 2 for wrong arguments or input, 130 after
Ctrl-C, which lets `paper` finish the scene under way and its report.";

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn parsed(line: &str) -> Result<BenchArgs, clap::Error> {
        BenchArgs::try_parse_from(std::iter::once("bench").chain(line.split_whitespace()))
    }

    #[test]
    fn the_definition_is_sound() {
        BenchArgs::command().debug_assert();
    }

    #[test]
    fn options_of_all_benchmarks_may_stand_on_either_side() {
        for line in ["--quick --runs 3 batch --meshes 7", "batch --meshes 7 --runs 3 --quick"] {
            let args = parsed(line).unwrap();
            assert_eq!((args.quick, args.runs), (true, Some(3)), "{line}");
            let expected = BatchArgs { meshes: Some(7), triangles: None };
            assert_eq!(args.benchmark, Some(Benchmark::Batch(expected)), "{line}");
        }
        let listing = parsed("--list-scenes --list-devices").unwrap();
        assert!(listing.list_devices && listing.list_scenes.is_some() && listing.benchmark.is_none());
    }

    #[test]
    fn what_cannot_be_measured_is_refused_with_exit_status_2() {
        for line in [
            "everything",
            "batch --meshes 0",
            "tlas --instances 0",
            "split --parts 1",
            "order --camera 6",
            "queries --camera 0",
            "queries --instances 0",
            "order --scene a.obj --triangles 1000",
            "overhead --width 0",
            "batch --runs 0",
            "paper --frames 0",
            "paper --scenes",
            "paper --depth 17",
        ] {
            assert_eq!(parsed(line).unwrap_err().exit_code(), 2, "{line}");
        }
    }
}
