//! The experiment as a subcommand of `bench`.

use std::path::Path;

use lvk::Context;

use super::super::error::BenchError;
use super::super::setup::{Choice, Setup, ray_paths};
use super::super::table::Table;
use super::args::PaperArgs;
use super::measured::{Plan, measure};
use super::pictures::Pictures;
use super::report::{Experiment, PICTURES};
use super::tables;
use crate::app::progress::Progress;
use crate::app::run_args::RayTracing;
use crate::app::scene_list;
use crate::hybrid::{RayPath, fit_textures, textures_needed};
use crate::scene::{ObjOptions, Scene};

/// Measures all scenes, writes the report after each, and answers the averages.
pub(in crate::bench) fn run(setup: &Setup, args: &PaperArgs) -> Result<Table, BenchError> {
    let files: Vec<Option<&Path>> = match args.scenes.is_empty() {
        true => vec![None],
        false => args.scenes.iter().map(|scene| Some(scene.as_path())).collect(),
    };
    let mut progress = Progress::visible();
    let mut experiment: Option<Experiment> = None;
    let mut headline = String::new();
    for file in files {
        let mut scene = load(file, &mut progress)?;
        progress.stage("opening the device", 0);
        let ctx = setup.open_for_textures(textures_needed(&scene))?;
        progress.pause();
        warn(&scene.warnings);
        warn(&fit_textures(&mut scene, &ctx.capabilities().limits).map_err(super::PaperError::from)?);
        headline = setup.headline(&ctx, "Stand-alone and hybrid, averages in milliseconds");
        let experiment = match &mut experiment {
            Some(known) => known,
            none => none.insert(begin(setup, args, &ctx)?),
        };
        let pictures = Pictures::new(&args.out.join(PICTURES), experiment.plan.size)?;
        let found = measure(&ctx, &scene, &experiment.plan, &pictures, &mut progress)?;
        experiment.scenes.push(found);
        experiment.write(&args.out)?;
    }
    let (scenes, paths) = experiment.map(|found| (found.scenes, found.plan.paths)).unwrap_or_default();
    let mut table = tables::summary(headline, &scenes, &paths);
    table.note(format!("all tables, plots and pictures: {}", args.out.join("report.md").display()));
    Ok(table)
}

fn load(file: Option<&Path>, progress: &mut Progress) -> Result<Scene, BenchError> {
    let Some(wish) = file else {
        progress.stage("making the courtyard", 0);
        return Ok(Scene::procedural());
    };
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
    let paths = match args.rt {
        RayTracing::Auto => paths,
        RayTracing::Pipeline => vec![only(ctx, RayPath::Pipeline)?],
        RayTracing::Query => vec![only(ctx, RayPath::Query)?],
    };
    let [width, height] = setup.choose(ctx, Choice { quick: [256, 144], cpu: [640, 360], gpu: [1280, 720] });
    let plan = Plan {
        size: [args.width.unwrap_or(width), args.height.unwrap_or(height)],
        frames: args.frames.unwrap_or_else(|| setup.choose(ctx, Choice { quick: 4, cpu: 12, gpu: 4000 })),
        runs: setup.runs(ctx, Choice { quick: 1, cpu: 1, gpu: 1 }),
        warm_up: setup.choose(ctx, Choice { quick: 1, cpu: 1, gpu: 30 }),
        compared: args.compared.unwrap_or_else(|| setup.choose(ctx, Choice { quick: 2, cpu: 5, gpu: 5 })),
        max_depth: args.depth,
        paths,
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
