//! Time and memory of loading an OBJ file, in a process of its own.

use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use super::curve::{Curve, Expected, Unit};
use super::effort::Effort;
use super::group::{Group, GroupKey};
use super::process_memory::{self, resident_and_peak};
use super::written_obj::{self, Corners};
use crate::cpu_overhead::{peak_bytes, restart_peak};
use crate::error::BenchError;
use crate::measure::elapsed_ms;
use lvk_samples::app::progress::Progress;
use lvk_samples::scene::{ObjOptions, Scene};

/// Most bytes of memory while a file is loaded, in times of the data that stay.
const GOAL: f64 = 3.0;

pub(super) fn measure(effort: Effort) -> Result<Group, BenchError> {
    let sizes = GroupKey::Loading.sizes(effort.quick).to_vec();
    let mut curves = Vec::new();
    let mut notes = vec![format!(
        "final data: positions, normals, texture coordinates, triangles; goal: at most {GOAL} times"
    )];
    let is_known = process_memory::is_known();
    if !is_known {
        notes.push("not measured: this system does not tell the memory of a process".to_owned());
    }
    let folder = tempfile::tempdir().map_err(|source| not_written(std::env::temp_dir(), source))?;
    for corners in [Corners::Positions, Corners::All].into_iter().filter(|_| is_known) {
        let mut of_corners = self::curves(corners);
        for &count in &sizes {
            let file = folder.path().join("terrain.obj");
            written_obj::write(&file, count, corners).map_err(|source| not_written(file.clone(), source))?;
            let loaded = in_child(&file)?;
            let costs = [loaded.milliseconds, loaded.resident_ratio(), loaded.counted_ratio()];
            of_corners.iter_mut().zip(costs).for_each(|(curve, cost)| curve.push(count, cost));
            notes.extend((count == sizes[sizes.len() - 1]).then(|| loaded.compare_with_goal(corners)));
        }
        curves.extend(of_corners);
    }
    notes.push(
        "resident: VmHWM without what was resident before; counted: heap allocations of 4 KiB and more"
            .to_owned(),
    );
    Ok(Group { key: GroupKey::Loading, sizes, curves, notes })
}

fn curves(corners: Corners) -> Vec<Curve> {
    let curve =
        |what: &str, unit, expected| Curve::new(format!("{what}, {}", corners_name(corners)), unit, expected);
    let fixed = Expected::Grows("fixed buffers of the reader at small sizes");
    vec![
        curve("loaded", Unit::Milliseconds, Expected::Grows("all is read")),
        curve("resident peak", Unit::Times, fixed),
        curve("counted peak", Unit::Times, fixed),
    ]
}

fn corners_name(corners: Corners) -> &'static str {
    match corners {
        Corners::Positions => "positions alone",
        Corners::All => "all of v, vt, vn",
    }
}

/// What it took to load a file.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Loaded {
    milliseconds: f64,
    /// Bytes of the arrays of the scene.
    data: u64,
    /// Resident bytes before.
    before: u64,
    /// Most resident bytes.
    peak: u64,
    /// Most bytes of heap allocations, beside those before.
    counted: u64,
}

impl Loaded {
    /// The word in front of the numbers on standard output.
    const WORD: &'static str = "loaded";

    fn resident_ratio(&self) -> f64 {
        self.peak.saturating_sub(self.before) as f64 / self.data as f64
    }

    fn counted_ratio(&self) -> f64 {
        self.counted as f64 / self.data as f64
    }

    fn to_line(self) -> String {
        let Self { milliseconds, data, before, peak, counted } = self;
        format!("{} {milliseconds} {data} {before} {peak} {counted}\n", Self::WORD)
    }

    fn from_line(line: &str) -> Option<Self> {
        let mut words = line.strip_prefix(Self::WORD)?.split_whitespace();
        let milliseconds = words.next()?.parse().ok()?;
        let mut number = || words.next()?.parse().ok();
        Some(Self { milliseconds, data: number()?, before: number()?, peak: number()?, counted: number()? })
    }

    /// Compares the largest file with the goal.
    fn compare_with_goal(&self, corners: Corners) -> String {
        let megabytes = |bytes: u64| bytes as f64 * 1e-6;
        let ratio = self.peak as f64 / self.data as f64;
        let verdict = if ratio <= GOAL { "kept" } else { "missed" };
        format!(
            "{}: {:.0} MB of final data, VmHWM {:.0} MB, {ratio:.2} times: goal {verdict}",
            corners_name(corners),
            megabytes(self.data),
            megabytes(self.peak)
        )
    }
}

fn not_written(path: PathBuf, source: io::Error) -> BenchError {
    BenchError::Write { path, source }
}

/// Loads the file in a process of its own, whose memory holds nothing else.
fn in_child(file: &Path) -> Result<Loaded, BenchError> {
    let run = |program| Command::new(program).args(["growth", "--load"]).arg(file).output();
    let output =
        std::env::current_exe().and_then(run).map_err(|error| BenchError::Child(error.to_string()))?;
    let text = String::from_utf8_lossy(&output.stdout);
    text.lines().find_map(Loaded::from_line).ok_or_else(|| {
        let errors = String::from_utf8_lossy(&output.stderr);
        BenchError::Child(format!("{}; {}", output.status, errors.trim()))
    })
}

/// Loads the file and returns the line that the parent reads.
pub(super) fn load(file: &Path) -> Result<String, BenchError> {
    process_memory::reset_peak();
    let [before, _] = resident_and_peak().unwrap_or_default();
    let heap_before = restart_peak();
    let start = Instant::now();
    let scene = Scene::from_obj(file, &ObjOptions::default(), &mut Progress::hidden())?;
    let milliseconds = elapsed_ms(start);
    let counted = peak_bytes().saturating_sub(heap_before);
    let [_, peak] = resident_and_peak().unwrap_or_default();
    Ok(Loaded { milliseconds, data: scene_bytes(&scene), before, peak, counted }.to_line())
}

/// Returns the bytes of the arrays of a scene.
fn scene_bytes(scene: &Scene) -> u64 {
    let bytes = size_of_val(&scene.positions[..])
        + size_of_val(&scene.normals[..])
        + size_of_val(&scene.texcoords[..])
        + size_of_val(&scene.colors[..])
        + size_of_val(&scene.triangles[..])
        + size_of_val(&scene.triangle_materials[..])
        + size_of_val(&scene.source_triangles[..]);
    bytes as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parent_reads_what_the_child_writes() {
        let loaded = Loaded { milliseconds: 1.5, data: 100, before: 50, peak: 350, counted: 250 };
        assert_eq!(Loaded::from_line(loaded.to_line().trim_end()), Some(loaded));
        assert_eq!((loaded.resident_ratio(), loaded.counted_ratio()), (3.0, 2.5));
        assert_eq!(Loaded::from_line("loaded 1.5 2 3"), None);
        assert_eq!(Loaded::from_line("warning: 1.5 2 3 4 5"), None);
        assert!(loaded.compare_with_goal(Corners::All).ends_with("3.50 times: goal missed"));
    }

    #[test]
    fn written_files_have_the_triangles_that_they_are_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.obj");
        for corners in [Corners::Positions, Corners::All] {
            for count in [1, 7, 200] {
                written_obj::write(&file, count, corners).unwrap();
                let scene = Scene::from_obj(&file, &ObjOptions::default(), &mut Progress::hidden()).unwrap();
                assert_eq!(scene.triangles.len() as u64, count);
                assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
                let has_texcoords = scene.texcoords.iter().any(|uv| uv[0] != 0.0);
                assert_eq!(has_texcoords, corners == Corners::All);
            }
        }
    }
}
