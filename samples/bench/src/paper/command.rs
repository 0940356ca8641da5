//! The experiment as a subcommand of `bench`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use lvk::Context;

use super::super::error::BenchError;
use super::super::setup::{Choice, Setup, ray_paths};
use super::super::table::Table;
use super::args::PaperArgs;
use super::measured::{Plan, measure};
use super::pictures::Pictures;
use super::report::{Experiment, PICTURES};
use super::tables;
use super::trace_path::TracePath;
use lvk_samples::app::interrupt::Interrupt;
use lvk_samples::app::progress::Progress;
use lvk_samples::app::ray_args::RayTracing;
use lvk_samples::app::scene_list::{self, FOLDER_VARIABLE as VARIABLE};
use lvk_samples::hybrid::{RayPath, fit_textures, textures_needed};
use lvk_samples::scene::{ObjOptions, Scene};

/// The paper's scenes, the last one in place of its gallery.
const SCENES: [&str; 3] = ["living_room", "conference", "kitchen"];

/// Measures all scenes, writes the report after each, and answers the averages.
pub(crate) fn run(setup: &Setup, args: &PaperArgs) -> Result<Table, BenchError> {
    let (files, remark) = match args.scenes.is_empty() {
        true => default_scenes(scene_list::folder().as_deref()),
        false => (args.scenes.clone(), None),
    };
    if let Some(remark) = &remark {
        eprintln!("{remark}");
    }
    let started = Instant::now();
    let interrupt = Interrupt::listen();
    let mut progress = Progress::visible();
    let mut experiment: Option<Experiment> = None;
    let mut headline = String::new();
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
        headline = setup.headline(&ctx, "Stand-alone and hybrid, averages in milliseconds");
        let experiment = match &mut experiment {
            Some(known) => known,
            none => {
                let mut begun = begin(setup, args, &ctx)?;
                begun.notes.extend(remark.clone());
                none.insert(begun)
            }
        };
        let pictures = Pictures::new(&args.out.join(PICTURES), experiment.plan.size)?;
        let found = measure(&ctx, &scene, &experiment.plan, &pictures, &mut progress)?;
        experiment.scenes.push(found);
        experiment.wall_seconds = started.elapsed().as_secs_f64();
        experiment.write(&args.out)?;
    }
    let (scenes, paths) = experiment.map(|found| (found.scenes, found.plan.paths)).unwrap_or_default();
    let page = args.out.join("report.md");
    if interrupt.is_raised() {
        return Err(BenchError::Interrupted { done: scenes.len(), of: files.len(), page });
    }
    let mut table = tables::summary(headline, &scenes, &paths);
    let seconds = started.elapsed().as_secs();
    table.note(format!("took {} min {} s", seconds / 60, seconds % 60));
    table.note(format!("all tables, plots and pictures: {}", page.display()));
    Ok(table)
}

/// Those of the paper's scenes that are in `folder`, else the built-in one; and what to say where some are not there.
fn default_scenes(folder: Option<&Path>) -> (Vec<PathBuf>, Option<String>) {
    let found = folder.map(scene_list::find).unwrap_or_default();
    let (there, missing): (Vec<&str>, Vec<&str>) =
        SCENES.into_iter().partition(|name| found.iter().any(|scene| scene.name == *name));
    let wanted = missing.join(", ");
    if there.is_empty() {
        let remark = format!("the built-in courtyard stands in for {wanted}, which {VARIABLE} would name");
        return (vec![PathBuf::from(scene_list::BUILT_IN)], Some(remark));
    }
    let remark = (!missing.is_empty()).then(|| format!("without {wanted}, which {VARIABLE} would name"));
    (there.into_iter().map(PathBuf::from).collect(), remark)
}

fn load(wish: &Path, progress: &mut Progress) -> Result<Scene, BenchError> {
    let path = scene_list::resolve(wish, scene_list::folder().as_deref());
    match path == Path::new(scene_list::BUILT_IN) && !path.exists() {
        true => Ok(Scene::procedural()),
        false => Ok(Scene::from_obj(&path, &ObjOptions::default(), progress)?),
    }
}

fn warn(warnings: &[String]) {
    warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
}

fn begin(setup: &Setup, args: &PaperArgs, ctx: &Context) -> Result<Experiment, BenchError> {
    let (paths, note) = ray_paths(ctx)?;
    let paths: Vec<RayPath> = match args.rt {
        RayTracing::Auto => paths,
        RayTracing::Pipeline => vec![only(ctx, RayPath::Pipeline)?],
        RayTracing::Query | RayTracing::Software => vec![only(ctx, RayPath::Query)?],
    };
    let [width, height] = setup.choose(ctx, Choice { quick: [256, 144], cpu: [640, 360], gpu: [1280, 720] });
    let plan = Plan {
        size: [args.width.unwrap_or(width), args.height.unwrap_or(height)],
        frames: args.frames.unwrap_or_else(|| setup.choose(ctx, Choice { quick: 4, cpu: 12, gpu: 4000 })),
        runs: setup.runs(ctx, Choice { quick: 1, cpu: 1, gpu: 1 }),
        warm_up: setup.choose(ctx, Choice { quick: 1, cpu: 1, gpu: 30 }),
        compared: args.compared.unwrap_or_else(|| setup.choose(ctx, Choice { quick: 2, cpu: 5, gpu: 5 })),
        max_depth: args.depth,
        paths: paths.into_iter().map(|path| TracePath::of(path, ctx.capabilities())).collect(),
    };
    let mut experiment = Experiment::new(ctx.capabilities(), command(), plan);
    if setup.is_rehearsal() {
        experiment
            .notes
            .push("a rehearsal, with tiny sizes or validation: the figures mean little".to_owned());
    }
    experiment.notes.extend(note.filter(|_| args.rt == RayTracing::Auto));
    Ok(experiment)
}

fn only(ctx: &Context, path: RayPath) -> Result<RayPath, BenchError> {
    Ok(RayPath::choose(Some(path), ctx.capabilities()).map_err(super::PaperError::from)?)
}

/// The command line, with the last part of each path alone, since folders are everybody's own.
fn command() -> String {
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
    fn scenes_of_the_paper_are_taken_where_they_are() {
        let (scenes, remark) = default_scenes(None);
        assert_eq!(scenes, [Path::new(scene_list::BUILT_IN)]);
        assert!(remark.is_some_and(|remark| remark.contains("courtyard") && remark.contains("kitchen")));
        let folder = tempfile::tempdir().unwrap();
        for name in ["kitchen", "living_room"] {
            std::fs::write(folder.path().join(format!("{name}.obj")), "").unwrap();
        }
        let (scenes, remark) = default_scenes(Some(folder.path()));
        assert_eq!(scenes, [Path::new("living_room"), Path::new("kitchen")]);
        assert!(remark.is_some_and(|remark| remark.starts_with("without conference,")));
        std::fs::write(folder.path().join("conference.obj"), "").unwrap();
        assert_eq!(default_scenes(Some(folder.path())).1, None);
    }
}
