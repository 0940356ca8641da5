//! Measures BVH builds by the CPU, phase by phase, for several numbers of threads, beside those of `obvhs`. Needs no device.

use std::time::Duration;

use lvk::BuildFlags;
use lvk::test_hooks::{CpuBuild, ObvhsBuild, WideTree, build_by_obvhs, build_on_threads};

use crate::args::{BenchArgs, BuildsArgs};
use crate::cpu_overhead::{peak_bytes, restart_peak};
use crate::embree::{Embree, EmbreeBuild};
use crate::error::BenchError;
use crate::measure::median_of;
use crate::mesh::Mesh;
use crate::table::{Table, format_grouped, format_ms, format_ratio};
use crate::tree_rays::{all_camera_rays, bounce_rays, trace_all};

/// The builds on one number of threads.
struct ThreadRow {
    threads: usize,
    builds: Vec<CpuBuild>,
    /// Times of the same by `obvhs`, and the tree of one of these builds.
    others: Vec<Duration>,
    tree_of_obvhs: Option<WideTree>,
    /// The same by Embree, if it is named.
    by_embree: Vec<EmbreeBuild>,
    /// Heap bytes that a build had at most, beside the mesh of the caller.
    peak: u64,
}

/// Builds the mesh on each number of threads and returns the table.
pub(super) fn measure(bench: &BenchArgs, args: &BuildsArgs) -> Result<Table, BenchError> {
    let (triangles, runs) = if bench.quick { (2_000, 1) } else { (1_000_000, 9) };
    let mesh = Mesh::new(&args.mesh, 1, triangles)?;
    let runs = bench.runs.unwrap_or(runs);
    // The first build of the process touches memory that later ones use again.
    let mut rows: Vec<ThreadRow> = args
        .threads()
        .into_iter()
        .map(|threads| ThreadRow {
            threads,
            builds: Vec::new(),
            others: Vec::new(),
            tree_of_obvhs: None,
            by_embree: Vec::new(),
            peak: 0,
        })
        .collect();
    let embree = args.embree.as_deref().map(Embree::open).transpose()?;
    let mut embree_tree = None;
    for row in &mut rows {
        measure_row(&mesh, args.flags(), runs, row);
        if let Some(embree) = &embree {
            let (builds, tree) = embree.build(&mesh.positions, &mesh.triangles, row.threads, runs)?;
            row.by_embree = builds;
            embree_tree = Some(tree);
        }
    }
    let mut table = table(&mesh, runs, &rows);
    let own = rows.iter().flat_map(|row| &row.builds).find_map(CpuBuild::tree);
    let obvhs = rows.into_iter().find_map(|row| row.tree_of_obvhs);
    let trees = [("lvk", own), ("obvhs", obvhs), ("Embree, medium", embree_tree)];
    let trees: Vec<_> = trees.into_iter().filter_map(|(name, tree)| Some((name, tree?))).collect();
    add_trees(&mut table, &mesh, &trees, bench.quick);
    Ok(table)
}

/// Adds the cost of the tree of each builder, and the work of the same rays in each.
fn add_trees(table: &mut Table, mesh: &Mesh, trees: &[(&str, WideTree)], quick: bool) {
    let Some((_, first)) = trees.first() else { return };
    let costs: Vec<f64> = trees.iter().map(|(_, tree)| tree.sah_cost()).collect();
    let primary = all_camera_rays(mesh, if quick { [16, 9] } else { [320, 180] });
    let bounced = bounce_rays(first, &primary);
    for (kind, rays) in [("primary", &primary), ("bounce", &bounced)] {
        let traced = trace_all(trees, rays, if quick { 1 } else { 5 });
        let expected = traced[0].1;
        for (((name, _), cost), (work, sum)) in trees.iter().zip(&costs).zip(&traced) {
            let each = |count: f64| count / rays.len().max(1) as f64;
            table.add_note(format!(
                "tree of {name}: SAH cost {cost:.5}; {} {kind} rays, each {:.2} nodes and {:.2} triangles, {:.0} ns on one thread{}",
                format_grouped(rays.len() as u64),
                each(work.nodes as f64),
                each(work.triangles as f64),
                each(work.time * 1e6),
                if (sum / expected - 1.0).abs() < 1e-6 { "" } else { ", WITH OTHER HITS" },
            ));
        }
    }
}

fn measure_row(mesh: &Mesh, flags: BuildFlags, runs: u32, row: &mut ThreadRow) {
    let (threads, builds) = (row.threads, &mut row.builds);
    let before = restart_peak();
    build_on_threads(&mesh.positions, &mesh.triangles, flags, threads, 1, |_| {});
    row.peak = peak_bytes().saturating_sub(before);
    build_on_threads(&mesh.positions, &mesh.triangles, flags, threads, runs, |build| builds.push(build));
    build_by_obvhs(&mesh.positions, &mesh.triangles, threads, runs, |ObvhsBuild { total, tree }| {
        row.others.push(total);
        row.tree_of_obvhs = Some(tree);
    });
}

fn table(mesh: &Mesh, runs: u32, rows: &[ThreadRow]) -> Table {
    let title = format!("builds by the CPU: {}, {runs} runs", mesh.describe());
    let heads: Vec<String> = rows.iter().map(|row| count_text(row.threads)).collect();
    let columns: Vec<&str> =
        std::iter::once("Milliseconds").chain(heads.iter().map(String::as_str)).collect();
    let mut table = Table::new(title, &columns);
    let phases = rows.first().and_then(|row| row.builds.first()).map_or(&[][..], |build| &build.phases);
    for (number, (name, _)) in phases.iter().enumerate() {
        let of_phase = |build: &CpuBuild| milliseconds(build.phases[number].1);
        table.add_row(*name, rows.iter().map(|row| format_ms(median_of(&row.builds, of_phase))));
    }
    let totals: Vec<f64> =
        rows.iter().map(|row| median_of(&row.builds, |build| milliseconds(build.total))).collect();
    let least = |row: &ThreadRow| {
        row.builds.iter().map(|build| milliseconds(build.total)).fold(f64::INFINITY, f64::min)
    };
    table.add_row("total", totals.iter().map(|total| format_ms(*total)));
    table.add_row("least total", rows.iter().map(|row| format_ms(least(row))));
    table.add_row(
        "times as fast as the first column",
        totals.iter().map(|total| format_ratio(totals[0] / total)),
    );
    table.add_row("peak heap memory, times the BLAS", rows.iter().map(peak_ratio));
    table.add_row(
        "total of obvhs 0.4, slow_build",
        rows.iter().map(|row| format_ms(median_of(&row.others, |total| milliseconds(*total)))),
    );
    add_embree(&mut table, rows);
    let all = || rows.iter().flat_map(|row| &row.builds);
    if let Some(first) = all().next() {
        table.add_note(format!("bytes of the BLAS: {}", format_grouped(first.bytes.len() as u64)));
        let same = all().all(|build| build.bytes == first.bytes);
        table.add_note(if same { "all builds made the same bytes" } else { "BUILDS DIFFER" });
    }
    table
}

/// Adds the builds by Embree, if there are any.
fn add_embree(table: &mut Table, rows: &[ThreadRow]) {
    if rows.iter().all(|row| row.by_embree.is_empty()) {
        return;
    }
    for (name, time) in [
        ("total of Embree, medium quality", (|build| build.medium) as fn(&EmbreeBuild) -> Duration),
        ("total of Embree, high quality", |build| build.high),
        ("rtcBuildBVH of Embree, medium quality", |build| build.bvh),
    ] {
        let median = |row: &ThreadRow| median_of(&row.by_embree, |build| milliseconds(time(build)));
        table.add_row(name, rows.iter().map(|row| format_ms(median(row))));
    }
}

fn count_text(threads: usize) -> String {
    if threads == 1 { "1 thread".to_owned() } else { format!("{threads} threads") }
}

fn peak_ratio(row: &ThreadRow) -> String {
    let bytes = row.builds.first().map_or(0, |build| build.bytes.len());
    if row.peak == 0 { String::new() } else { format_ratio(row.peak as f64 / bytes.max(1) as f64) }
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}
