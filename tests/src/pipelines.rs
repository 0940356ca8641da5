//! The pipelines of the samples and of the benchmarks.

use lvk_samples::app::sample_info::SampleInfo as _;
use lvk_samples::pipelines::SamplePipeline;

/// Returns every pipeline of the samples and of the benchmarks.
#[must_use]
pub fn all() -> Vec<SamplePipeline> {
    [lvk_samples::pipelines::all(), lvk_viewer::Viewer::pipelines(), lvk_bench::pipelines()].concat()
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use super::*;

    const STAGES: [&str; 10] =
        ["vert", "frag", "comp", "rgen", "rmiss", "rchit", "rahit", "rint", "mesh", "task"];

    fn stage_files(folder: &Path) -> Vec<PathBuf> {
        let mut found = Vec::new();
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if path.is_dir() {
                found.extend(stage_files(&path));
            } else if STAGES.iter().any(|stage| name.ends_with(&format!(".{stage}.glsl"))) {
                found.push(path);
            }
        }
        found
    }

    #[test]
    fn every_stage_below_shaders_is_in_a_pipeline() {
        let files = stage_files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders"));
        assert!(files.len() >= 7, "{files:?}");
        let pipelines = all();
        for file in files {
            let text = std::fs::read_to_string(&file).unwrap();
            let listed =
                pipelines.iter().flat_map(|pipeline| &pipeline.stages).any(|stage| stage.text == text);
            assert!(listed, "{} is in no pipeline of `pipelines::all`", file.display());
        }
    }

    #[test]
    fn names_tell_pipelines_apart() {
        let mut names: Vec<_> = all().iter().map(|pipeline| pipeline.name).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
