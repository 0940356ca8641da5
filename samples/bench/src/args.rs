//! The command line of the `bench` program.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use clap::{Args, Parser, Subcommand};
use lvk::{BuildFlags, DeviceProfile};

use crate::growth::GrowthArgs;
use crate::paper::PaperArgs;
use crate::peers::PeersArgs;

/// Measures the costs and gains of lvk on a device and prints Markdown tables.
///
/// Default sizes depend on the device: full sizes on a GPU, smaller sizes on a driver that runs on the CPU.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "bench", version, after_help = EXAMPLES)]
pub struct BenchArgs {
    /// Benchmark to run
    #[command(subcommand)]
    pub(super) benchmark: Option<Benchmark>,

    /// Smoke test: tiny sizes, one run
    #[arg(long, global = true)]
    pub(super) quick: bool,

    /// Runs per measurement; the median is printed [default: by benchmark and device]
    #[arg(long, value_name = "N", global = true, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(super) runs: Option<u32>,

    /// Device to use: its number or part of its name [default: the most capable one]
    #[arg(long, value_name = "NUMBER|NAME", global = true)]
    pub(super) device: Option<String>,

    /// Emulate a device profile on this device: disable missing features and clamp limits
    #[arg(
        long,
        value_name = "NAME",
        global = true,
        value_parser = PossibleValuesParser::new(DeviceProfile::names()).try_map(|name| DeviceProfile::named(&name))
    )]
    pub(super) profile: Option<DeviceProfile>,

    /// Print the devices and their ray tracing support, and exit
    #[arg(long, global = true)]
    pub(super) list_devices: bool,

    /// Print the scenes that `paper --scenes` accepts by name, and exit; searches FOLDER, by default the folder in LVK_SCENES
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, default_missing_value = "")]
    #[arg(value_parser = clap::value_parser!(OsString), global = true)]
    pub(super) list_scenes: Option<OsString>,

    /// One Vulkan queue for all commands, where the library would use others for computing and transfers
    #[arg(long, global = true)]
    pub(super) single_queue: bool,

    /// Run with Vulkan validation; a message is an error, and times are not meaningful
    #[arg(long, global = true)]
    pub(super) validate: bool,
}

/// The benchmarks.
#[derive(Debug, Clone, PartialEq, Subcommand)]
pub(super) enum Benchmark {
    /// BLAS builds of many small meshes: one batch compared with one submission and wait per mesh
    Batch(BatchArgs),
    /// BVH builds by the CPU, phase by phase, on several numbers of threads; needs no device
    Builds(BuildsArgs),
    /// BLAS builds, refits and compaction of one large mesh, compared with hand-written Vulkan
    Compaction(MeshArgs),
    /// CPU overhead of the library: draws, dispatches, objects, submissions, uploads, start-up, heap growth
    Core,
    /// Cost against size: instances, textures, buffers, draws, triangles, OBJ files; exponents and log-log plots
    Growth(GrowthArgs),
    /// Frames by the driver's ray tracing pipelines, by pipelines lowered to software, and by ray queries in software
    Lowered(ImageSizeArgs),
    /// Ray tracing cost of a mesh split into several BLAS, compared with one BLAS
    Split(SplitArgs),
    /// TLAS updates, compared with a memory copy plus the driver's build
    Tlas(TlasArgs),
    /// Triangle orders: given order, Morton order, the library's spatial order
    Order(TraceArgs),
    /// Software ray queries of the library, compared with the driver's ray tracing
    Queries(QueriesArgs),
    /// A ray traced frame by lvk and by hand-written Vulkan
    Overhead(TraceArgs),
    /// The paper's experiment: stand-alone and hybrid rendering along five camera paths, with a report
    Paper(PaperArgs),
    /// The same work by lvk and by plain ash; `cargo run --release -p lvk-bench-peers` adds wgpu, blade and vk-graph
    Peers(PeersArgs),
}

/// Sizes of [`Benchmark::Batch`].
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct BatchArgs {
    /// Number of meshes [default: 1000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) meshes: Option<u32>,

    /// Triangles per mesh [default: 1000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) triangles: Option<u32>,
}

/// The measured mesh and the numbers of threads.
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct BuildsArgs {
    #[command(flatten)]
    pub(super) mesh: MeshArgs,

    /// Numbers of threads, separated by commas [default: 1, 2, 4 and so on to the number of cores]
    #[arg(long, value_name = "N,...", value_delimiter = ',')]
    #[arg(value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Vec<u16>,

    /// Builds BLAS that keep indices of shared vertices (`BuildFlags::LOW_MEMORY`); their rays are not traced
    #[arg(long)]
    low_memory: bool,

    /// Builds by Embree 3 or 4 too; FILE is its library, as libembree3.so.3
    #[arg(long, value_name = "FILE")]
    pub(super) embree: Option<PathBuf>,
}

impl BuildsArgs {
    /// Returns the flags of the library's builds.
    pub(super) fn flags(&self) -> BuildFlags {
        if self.low_memory { BuildFlags::LOW_MEMORY } else { BuildFlags::FAST_TRACE }
    }

    /// Returns the numbers of threads to measure.
    pub(super) fn threads(&self) -> Vec<usize> {
        if !self.threads.is_empty() {
            return self.threads.iter().copied().map(usize::from).collect();
        }
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let doubled = std::iter::successors(Some(1), |threads| Some(threads * 2));
        doubled.take_while(|threads| *threads < cores).chain([cores]).collect()
    }
}

/// The measured mesh.
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct MeshArgs {
    /// Wavefront OBJ file; its triangles keep the order of the file [default: a generated mesh]
    #[arg(long, value_name = "FILE")]
    pub(super) scene: Option<PathBuf>,

    /// Triangles of the generated mesh [default: by benchmark and device]
    #[arg(long, value_name = "N", conflicts_with = "scene")]
    #[arg(value_parser = clap::value_parser!(u32).range(500..=100_000_000))]
    pub(super) triangles: Option<u32>,
}

/// The measured mesh, camera and image size.
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct TraceArgs {
    #[command(flatten)]
    pub(super) mesh: MeshArgs,

    /// One of the scene's five cameras
    #[arg(long, value_name = "1-5", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=5))]
    pub(super) camera: u32,

    #[command(flatten)]
    pub(super) image: ImageSizeArgs,
}

/// The image size.
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct ImageSizeArgs {
    /// Image width in pixels [default: 1280, or 160 on a driver that runs on the CPU]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=16_384))]
    pub(super) width: Option<u32>,

    /// Image height in pixels [default: 720, or 90 on a driver that runs on the CPU]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=16_384))]
    pub(super) height: Option<u32>,
}

/// The measured mesh, cameras, image size and instance count.
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct QueriesArgs {
    #[command(flatten)]
    pub(super) mesh: MeshArgs,

    /// One of the scene's five cameras [default: all cameras in turn]
    #[arg(long, value_name = "1-5", value_parser = clap::value_parser!(u32).range(1..=5))]
    pub(super) camera: Option<u32>,

    #[command(flatten)]
    pub(super) image: ImageSizeArgs,

    /// Number of overlapping instances that the mesh is split into
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(super) instances: u32,
}

/// The measured mesh, image size and number of parts.
#[derive(Debug, Clone, PartialEq, Args)]
pub(super) struct SplitArgs {
    #[command(flatten)]
    pub(super) trace: TraceArgs,

    /// Minimum number of parts
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
  bench builds --scene s.obj --threads 1,2,16      BVH builds by the CPU on these numbers of threads
  bench compaction --scene living_room.obj         builds, refits and compaction of that scene
  bench core                                       CPU overhead of the library, with its limits
  bench growth --only handles,draws --out growth   cost against size, with plots in that folder
  bench lowered --width 640 --height 360           ray tracing pipelines with and without the driver's own
  bench split --parts 100 --runs 200               the generated mesh in at least 100 parts
  bench order --scene living_room.obj --camera 3   rays per second by triangle order
  bench queries --scene living_room.obj            software ray queries and the driver's ray tracing
  bench overhead --quick                           smoke test
  bench paper --out report                         the paper's tables and figures, with the scenes in LVK_SCENES
  bench peers --rows draws,tlas                    two rows by lvk and by plain ash

Exit status: 0 on success, 1 for a device error, 2 for wrong arguments or input, 130 after Ctrl-C. After Ctrl-C, `paper`
finishes the current scene and its report.";

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn parsed(line: &str) -> Result<BenchArgs, clap::Error> {
        BenchArgs::try_parse_from(std::iter::once("bench").chain(line.split_whitespace()))
    }

    #[test]
    fn the_definition_is_valid() {
        BenchArgs::command().debug_assert();
    }

    #[test]
    fn global_options_may_precede_or_follow_the_benchmark() {
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
    fn invalid_arguments_have_exit_status_2() {
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
            "peers --rows everything",
        ] {
            assert_eq!(parsed(line).unwrap_err().exit_code(), 2, "{line}");
        }
    }
}
