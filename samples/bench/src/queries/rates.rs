//! Tables of rays per second.

use super::tracers::{Backend, Layout};
use super::traversal::{TraversalPlan, TraversalResult};
use crate::table::{Table, format_ratio};

/// Column heads: for each kind of rays the rate and its ratios to the driver's pipeline.
const COLUMNS: [&str; 10] = [
    "rays per second",
    "primary",
    "ratio to pipeline, given order",
    "ratio to pipeline, best order",
    "shadow",
    "ratio to pipeline, given order",
    "ratio to pipeline, best order",
    "bounce",
    "ratio to pipeline, given order",
    "ratio to pipeline, best order",
];

/// Returns the table of the mesh as one instance.
pub(super) fn single_instance_table(
    title: String,
    results: &[TraversalResult],
    plan: &TraversalPlan,
) -> Table {
    let mut table = Table::new(title, &COLUMNS);
    add_rows(&mut table, results, Layout::SingleInstance);
    let (runs, cameras) = (plan.runs, plan.cameras.len());
    let cameras = if cameras == 1 { "one camera".to_owned() } else { format!("{cameras} cameras") };
    table.add_note(format!(
        "means over {cameras} of rays per second by the medians of {runs} interleaved frames, each after a frame that fills \
         the caches; shadow and bounce rays only where a primary ray hit; bounce rays have the cosine distribution of diffuse light"
    ));
    table.add_note(
        "aim on the H200: software at least 1.5 times the pipeline's rate, for primary and shadow rays",
    );
    table.add_note(
        "aim on the software driver: at least 5 times the pipeline's rate in the given order, 4 times in the best order",
    );
    table
}

/// Returns the table of the mesh as overlapping instances.
pub(super) fn chunks_table(instances: usize, results: &[TraversalResult]) -> Table {
    let mut table = Table::new(format!("### As {instances} overlapping instances"), &COLUMNS);
    add_rows(&mut table, results, Layout::Chunks);
    table.add_note(
        "the same triangles, split into BLAS of consecutive triangles, with one untransformed instance each",
    );
    table
}

fn add_rows(table: &mut Table, results: &[TraversalResult], layout: Layout) {
    let rows: Vec<_> = results.iter().filter(|case| case.layout == layout).collect();
    for case in &rows {
        let cells = [0, 1, 2].map(|kind| {
            let pipelines = || rows.iter().filter(|case| case.backend == Backend::Pipeline);
            let given = pipelines().map(|case| case.rates[kind]).next();
            let best = pipelines().map(|case| case.rates[kind]).reduce(f64::max);
            let ratio =
                |to: Option<f64>| to.map_or_else(String::new, |to| format_ratio(case.rates[kind] / to));
            [format!("{:.3} M/s", case.rates[kind]), ratio(given), ratio(best)]
        });
        table.add_row(case.name.clone(), cells.into_iter().flatten());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results(backend: Backend, rates: [f64; 3]) -> TraversalResult {
        TraversalResult {
            name: format!("{backend:?}"),
            layout: Layout::SingleInstance,
            backend,
            rates,
            agreement: None,
        }
    }

    #[test]
    fn ratios_are_to_the_first_and_to_the_best_pipeline() {
        let cases = [
            results(Backend::Pipeline, [1.0, 4.0, 1.0]),
            results(Backend::Pipeline, [2.0, 2.0, 2.0]),
            results(Backend::Software, [8.0, 8.0, 3.0]),
        ];
        let mut table = Table::new(String::new(), &COLUMNS);
        add_rows(&mut table, &cases, Layout::SingleInstance);
        let text = table.to_string();
        let row = text.lines().find(|line| line.contains("Software")).unwrap();
        let cells: Vec<_> = row.split('|').map(str::trim).filter(|cell| !cell.is_empty()).collect();
        assert_eq!(
            cells,
            [
                "Software",
                "8.000 M/s",
                "8.000x",
                "4.000x",
                "8.000 M/s",
                "2.000x",
                "2.000x",
                "3.000 M/s",
                "3.000x",
                "1.500x"
            ]
        );
    }
}
