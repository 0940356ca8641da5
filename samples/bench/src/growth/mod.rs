//! `bench growth`: cost against size, with the exponent of each curve.
//!
//! A cost that should not depend on a number of objects is measured beside 1 to 1,000,000 of them. The exponent of a constant
//! cost is about 0, that of one in proportion 1. The fit takes the larger half of the sizes; see [`fit::exponent`].

mod args;
mod backends;
mod curve;
mod draws;
mod effort;
mod fit;
mod group;
mod handles;
mod instances;
mod live_objects;
mod loading;
mod log_log_chart;
mod process_memory;
mod report;
mod terrain;
mod textures;
mod triangles;
mod written_obj;

use std::path::Path;
use std::time::Instant;

use lvk::Context;

pub(super) use args::GrowthArgs;

use super::error::BenchError;
use super::paper::today;
use super::setup::{DefaultBy, Setup};
use super::table::Table;
use effort::Effort;
use group::{Group, GroupKey};

/// Measures the selected groups, and writes the report where the arguments name a folder.
pub(super) fn measure(setup: &Setup, args: &GrowthArgs) -> Result<Vec<Table>, BenchError> {
    let started = Instant::now();
    let ctx = setup.open()?;
    let runs = setup.runs(&ctx, DefaultBy { quick: 1, cpu: 15, gpu: 15 });
    let effort =
        Effort { runs, quick: setup.default_for(&ctx, DefaultBy { quick: true, cpu: false, gpu: false }) };
    let image = setup.default_for(&ctx, DefaultBy { quick: [32, 18], cpu: [160, 90], gpu: [1280, 720] });
    let keys = args.groups();
    let mut groups = Vec::new();
    for (number, key) in keys.iter().enumerate() {
        let group = measure_group(setup, &ctx, *key, image, effort)?;
        let mut table = report::table(&group, setup.title(&ctx, &format!("growth: {}", key.title())));
        if number + 1 == keys.len() {
            let seconds = started.elapsed().as_secs();
            table.add_note(format!(
                "{}; medians of at most {runs} runs, fewer of long costs; took {seconds} s",
                today()
            ));
        }
        groups.push((group, table));
    }
    if let Some(folder) = &args.out {
        let texts: Vec<_> = groups.iter().map(|(group, table)| (group, table.to_string())).collect();
        report::write(folder, &texts)?;
    }
    Ok(groups.into_iter().map(|(_, table)| table).collect())
}

/// Loads the OBJ file as a child process, and returns its line of output.
pub(super) fn load(file: &Path) -> Result<String, BenchError> {
    loading::load(file)
}

fn measure_group(
    setup: &Setup,
    ctx: &Context,
    key: GroupKey,
    image: [u32; 2],
    effort: Effort,
) -> Result<Group, BenchError> {
    match key {
        GroupKey::Instances => instances::measure(&backends::open(setup)?, image, effort),
        GroupKey::Textures => textures::measure(setup, effort),
        GroupKey::Handles => handles::measure(ctx, effort),
        GroupKey::Draws => draws::measure(setup, ctx, effort),
        GroupKey::Triangles => triangles::measure(&backends::open(setup)?, image, effort),
        GroupKey::Loading => loading::measure(effort),
    }
}
