//! The subcommand `bench paper`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use lvk::Context;

use super::args::PaperArgs;
use super::measure::{ExperimentPlan, measure};
use super::report::{Experiment, IMAGE_FOLDER};
use super::report_images::ReportImages;
use super::tables;
use super::trace_path::TracePath;
use crate::error::BenchError;
use crate::setup::{DefaultBy, Setup, ray_paths};
use crate::table::Table;
use lvk_samples::app::interrupt::Interrupt;
use lvk_samples::app::progress::Progress;
use lvk_samples::app::ray_args::RayTracing;
use lvk_samples::app::scene_list::{self, FOLDER_VARIABLE as VARIABLE};
use lvk_samples::hybrid::{RayPath, fit_textures, textures_needed};
use lvk_samples::scene::{ObjOptions, Scene};

/// The paper's scenes. The kitchen replaces the paper's gallery.
const SCENES: [&str; 3] = ["living_room", "conference", "kitchen"];

/// Measures all scenes, writes the report after each scene, and returns the table of averages.
pub(crate) fn run(setup: &Setup, args: &PaperArgs) -> Result<Table, BenchError> {
    let (files, missing_note) = match args.scenes.is_empty() {
        true => default_scenes(scene_list::folder().as_deref()),
        false => (args.scenes.clone(), None),
    };
    if let Some(missing_note) = &missing_note {
        eprintln!("{}", lvk::readable_text(missing_note));
    }
    let started = Instant::now();
    let interrupt = Interrupt::listen();
    interrupt.defer();
    let mut progress = Progress::visible();
    let mut experiment: Option<Experiment> = None;
    let mut title = String::new();
    for file in &files {
        if interrupt.is_raised() {
            break;
        }
        let mut scene = load(file, &mut progress)?;
        progress.stage("opening the device", 0);
        let ctx = setup.open_for_textures(textures_needed(&scene))?;
        progress.pause();
        warn(&scene.warnings);
        warn(&fit_textures(&mut scene, &ctx.capabilities().limits).map_err(super::PaperError::from)?);
        title = setup.title(&ctx, "Stand-alone and hybrid, averages in milliseconds");
        let experiment = match &mut experiment {
            Some(known) => known,
            none => {
                let mut started_experiment = start_experiment(setup, args, &ctx)?;
                started_experiment.notes.extend(missing_note.clone());
                none.insert(started_experiment)
            }
        };
        let images = ReportImages::new(&args.out.join(IMAGE_FOLDER), experiment.plan.size)?;
        let result = measure(&ctx, &scene, &experiment.plan, &images, &mut progress)?;
        experiment.scenes.push(result);
        experiment.wall_seconds = started.elapsed().as_secs_f64();
        experiment.write(&args.out)?;
    }
    let (scenes, paths) = experiment.map(|found| (found.scenes, found.plan.paths)).unwrap_or_default();
    let page = args.out.join("report.md");
    if interrupt.is_raised() {
        return Err(BenchError::Interrupted { done: scenes.len(), of: files.len(), page });
    }
    let mut table = tables::summary(title, &scenes, &paths);
    let seconds = started.elapsed().as_secs();
    table.add_note(format!("took {} min {} s", seconds / 60, seconds % 60));
    table.add_note(format!("all tables, plots and images: {}", lvk::readable_name(page)));
    Ok(table)
}

/// Returns the paper's scenes in `folder`, or the built-in scene if there are none, and a note on missing scenes.
fn default_scenes(folder: Option<&Path>) -> (Vec<PathBuf>, Option<String>) {
    let found = folder.map(scene_list::find).unwrap_or_default();
    let (there, missing): (Vec<&str>, Vec<&str>) =
        SCENES.into_iter().partition(|name| found.iter().any(|scene| scene.name == *name));
    let wanted = missing.join(", ");
    if there.is_empty() {
        let missing_note =
            format!("the built-in courtyard replaces {wanted}; set {VARIABLE} to a folder with these scenes");
        return (vec![PathBuf::from(scene_list::BUILT_IN)], Some(missing_note));
    }
    let missing_note = (!missing.is_empty())
        .then(|| format!("without {wanted}, which the folder in {VARIABLE} does not contain"));
    (there.into_iter().map(PathBuf::from).collect(), missing_note)
}

fn load(scene: &Path, progress: &mut Progress) -> Result<Scene, BenchError> {
    let path = scene_list::resolve(scene, scene_list::folder().as_deref());
    match path == Path::new(scene_list::BUILT_IN) && !path.exists() {
        true => Ok(Scene::procedural()),
        false => Ok(Scene::from_obj(&path, &ObjOptions::default(), progress)?),
    }
}

fn warn(warnings: &[String]) {
    warnings.iter().for_each(|warning| eprintln!("warning: {}", lvk::readable_text(warning)));
}

fn start_experiment(setup: &Setup, args: &PaperArgs, ctx: &Context) -> Result<Experiment, BenchError> {
    let (paths, note) = ray_paths(ctx)?;
    let paths: Vec<RayPath> = match args.rt {
        RayTracing::Auto => paths,
        RayTracing::Pipeline | RayTracing::Hardware => vec![require_path(ctx, RayPath::Pipeline)?],
        RayTracing::Query | RayTracing::Software => vec![require_path(ctx, RayPath::Query)?],
    };
    let [width, height] =
        setup.default_for(ctx, DefaultBy { quick: [256, 144], cpu: [640, 360], gpu: [1280, 720] });
    let plan = ExperimentPlan {
        size: [args.width.unwrap_or(width), args.height.unwrap_or(height)],
        frames: args
            .frames
            .unwrap_or_else(|| setup.default_for(ctx, DefaultBy { quick: 4, cpu: 12, gpu: 4000 })),
        runs: setup.runs(ctx, DefaultBy { quick: 1, cpu: 1, gpu: 1 }),
        warm_up: setup.default_for(ctx, DefaultBy { quick: 1, cpu: 1, gpu: 30 }),
        compared: args
            .compared
            .unwrap_or_else(|| setup.default_for(ctx, DefaultBy { quick: 2, cpu: 5, gpu: 5 })),
        max_depth: args.depth,
        paths: paths.into_iter().map(|path| TracePath::new(path, ctx.capabilities())).collect(),
    };
    let mut experiment = Experiment::new(ctx.capabilities(), command_line(), plan);
    if setup.is_smoke_test() {
        experiment
            .notes
            .push("a smoke test, with tiny sizes or validation: times are not meaningful".to_owned());
    }
    experiment.notes.extend(note.filter(|_| args.rt == RayTracing::Auto));
    Ok(experiment)
}

fn require_path(ctx: &Context, path: RayPath) -> Result<RayPath, BenchError> {
    Ok(RayPath::choose(Some(path), ctx.capabilities()).map_err(super::PaperError::from)?)
}

/// Returns the command line. Paths are reduced to file names, so that the report contains no private folder.
fn command_line() -> String {
    let words = std::env::args_os().skip(1).map(|word| {
        let is_path = word.as_encoded_bytes().contains(&b'/');
        let name = Path::new(&word).file_name().filter(|_| is_path);
        name.map_or_else(|| word.to_string_lossy().into_owned(), |name| name.to_string_lossy().into_owned())
    });
    let words: Vec<String> = ["bench".to_owned()].into_iter().chain(words).collect();
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_of_the_paper_are_used_if_present() {
        let (scenes, missing_note) = default_scenes(None);
        assert_eq!(scenes, [Path::new(scene_list::BUILT_IN)]);
        assert!(missing_note.is_some_and(
            |missing_note| missing_note.contains("courtyard") && missing_note.contains("kitchen")
        ));
        let folder = tempfile::tempdir().unwrap();
        for name in ["kitchen", "living_room"] {
            std::fs::write(folder.path().join(format!("{name}.obj")), "").unwrap();
        }
        let (scenes, missing_note) = default_scenes(Some(folder.path()));
        assert_eq!(scenes, [Path::new("living_room"), Path::new("kitchen")]);
        assert!(missing_note.is_some_and(|missing_note| missing_note.starts_with("without conference,")));
        std::fs::write(folder.path().join("conference.obj"), "").unwrap();
        assert_eq!(default_scenes(Some(folder.path())).1, None);
    }
}
