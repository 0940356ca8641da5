//! Runs every row of every peer in its smallest form, and draws their triangles.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::process::Command;

use lvk_bench::peers::Row;
use lvk_dev_driver::{DriverRequest, prepare};

#[cfg(feature = "blade")]
#[path = "../examples/triangle_blade.rs"]
mod triangle_blade;
#[cfg(feature = "vk-graph")]
#[path = "../examples/triangle_vk_graph.rs"]
mod triangle_vk_graph;
#[cfg(feature = "wgpu")]
#[path = "../examples/triangle_wgpu.rs"]
mod triangle_wgpu;

/// Opens the loader, which the programs find by its bare name.
fn open_loader() {
    if let Some(loader) = prepare(&DriverRequest::default()).unwrap().loader {
        // SAFETY: the library is a Vulkan loader.
        std::mem::forget(unsafe { ash::Entry::load_from(loader) }.unwrap());
    }
}

#[test]
fn every_peer_does_every_row_that_it_can_with_the_same_result() {
    let output = Command::new(env!("CARGO_BIN_EXE_peers")).args(["--quick", "--runs", "1"]).output().unwrap();
    let (report, errors) =
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert!(output.status.success(), "{report}{errors}");
    assert!(report.contains("textures: equal"), "{report}");
    // Software rays are a column with few rows.
    let is_reason = |line: &&str| line.contains(" cannot: ") && !line.starts_with("- lvk-sw");
    for reason in report.lines().filter(is_reason) {
        let expected = ["no ray tracing pipelines", "no ray queries", "no acceleration structures"];
        assert!(expected.iter().any(|part| reason.contains(part)), "{report}");
    }
    // Each peer has a GPU time above zero in every row that has one and that it does.
    let cells = |line: &str| line.split('|').skip(3).map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let lines: Vec<_> = report.lines().collect();
    let pairs: Vec<_> = lines.windows(2).filter(|pair| pair[1].contains("|  GPU |")).collect();
    assert!(pairs.len() >= 6, "{report}");
    for (done, gpu) in pairs.iter().flat_map(|pair| cells(pair[0]).into_iter().zip(cells(pair[1]))) {
        let time = gpu.split(' ').next().and_then(|time| time.parse().ok()).unwrap_or(0.0);
        assert!(
            time > 0.0 || ["-", ""].contains(&done.as_str()),
            "{done} until done, {gpu} of it by the GPU\n{report}"
        );
    }
    let peers = lvk_bench_peers::peers();
    let rows: Vec<_> = report.lines().filter(|line| line.starts_with("| ")).collect();
    let heads: Vec<_> = rows[0].split('|').skip(3).map(str::trim).take(peers.len()).collect();
    assert_eq!(heads, peers.iter().map(|peer| peer.name).collect::<Vec<_>>());
    assert!(rows.len() > Row::ALL.len() + 3, "{report}");
    for peer in &peers {
        let name = peer.package;
        assert!(
            report.contains(&format!("{name} ")) && !report.contains(&format!("{name} of unknown")),
            "{name}"
        );
    }
}

#[test]
fn an_unknown_peer_is_an_error_that_names_all() {
    let output = Command::new(env!("CARGO_BIN_EXE_peers")).args(["--peers", "gfx"]).output().unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && errors.contains("ash, lvk"), "{errors}");
}

/// All programs in one test: they change the folder of the process.
#[test]
fn triangles_are_equal_up_to_their_edges() {
    type Draw = fn() -> Result<Vec<u8>, Box<dyn std::error::Error>>;
    type Main = fn() -> Result<(), Box<dyn std::error::Error>>;
    let programs: &[(Draw, Main)] = &[
        #[cfg(feature = "wgpu")]
        (triangle_wgpu::draw, triangle_wgpu::main),
        #[cfg(feature = "blade")]
        (triangle_blade::draw, triangle_blade::main),
        #[cfg(feature = "vk-graph")]
        (triangle_vk_graph::draw, triangle_vk_graph::main),
    ];
    open_loader();
    let folder = std::env::temp_dir().join(format!("lvk-bench-peers-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::env::set_current_dir(&folder).unwrap();
    let mut first = None;
    for (draw, main) in programs {
        let pixels = draw().unwrap();
        let expected = first.get_or_insert_with(|| pixels.clone());
        let differs = |(a, b): (&u8, &u8)| a.abs_diff(*b) > 2;
        let differing = pixels.iter().zip(&*expected).filter(|pair| differs(*pair)).count();
        assert!(pixels.len() == 4 * 256 * 256 && differing < 1000, "{differing} bytes differ");
        let inside = pixels.chunks(4).filter(|texel| texel[..3] != [0, 0, 0]).count();
        assert!((19_000..23_000).contains(&inside), "the triangle covers 32 %, not {inside} pixels");
        main().unwrap();
        assert_eq!(std::fs::read("triangle.ppm").unwrap().len(), "P6 256 256 255\n".len() + 3 * 256 * 256);
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn the_shaders_are_those_of_the_other_crate() {
    let folder = env!("CARGO_MANIFEST_DIR");
    for name in ["triangle.vert.spv", "triangle.frag.spv"] {
        let read = |path: &str| std::fs::read(format!("{folder}/{path}/{name}")).unwrap();
        assert!(read("examples") == read("../bench/examples"), "copy {name} from samples/bench/examples");
    }
}
