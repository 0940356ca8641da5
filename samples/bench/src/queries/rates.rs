//! Tables of rays a second.

use super::super::table::{Table, times};
use super::sides::{Shape, Walker};
use super::walk::{Plan, Walked};

/// Heads of the columns: for each kind of rays, how many and how they stand to the driver's pipeline.
const COLUMNS: [&str; 7] = [
    "rays a second",
    "primary",
    "to pipeline as given",
    "to its best order",
    "shadow",
    "to pipeline as given",
    "to its best order",
];

/// The mesh as one instance.
pub(super) fn whole(headline: String, walked: &[Walked], plan: &Plan) -> Table {
    let mut table = Table::new(headline, &COLUMNS);
    add_rows(&mut table, walked, Shape::Whole);
    let (runs, cameras) = (plan.runs, plan.cameras.len());
    let cameras = if cameras == 1 { "one camera".to_owned() } else { format!("{cameras} cameras") };
    table.note(format!(
        "means over {cameras} of rays a second by the medians of {runs} frames, taken in turns, each after one that fills \
         the caches; shadow rays only where a primary ray hit"
    ));
    table.note("aim on the H200: software at least 1.5 times the pipeline, for primary and for shadow rays");
    table.note(
        "aim on the software driver: at least 5 times the pipeline as given, 4 times in its best order",
    );
    table
}

/// The mesh as overlapping instances.
pub(super) fn cut(instances: usize, walked: &[Walked]) -> Table {
    let mut table = Table::new(format!("### As {instances} overlapping instances"), &COLUMNS);
    add_rows(&mut table, walked, Shape::Cut);
    table.note(
        "the same triangles, cut into structures of neighbours in the list, each shown once where it is",
    );
    table
}

fn add_rows(table: &mut Table, walked: &[Walked], shape: Shape) {
    let rows: Vec<_> = walked.iter().filter(|side| side.shape == shape).collect();
    for side in &rows {
        let cells = [0, 1].map(|kind| {
            let pipelines = || rows.iter().filter(|side| side.walker == Walker::Pipeline);
            let given = pipelines().map(|side| side.rates[kind]).next();
            let best = pipelines().map(|side| side.rates[kind]).reduce(f64::max);
            let ratio = |to: Option<f64>| to.map_or_else(String::new, |to| times(side.rates[kind] / to));
            [format!("{:.3} M/s", side.rates[kind]), ratio(given), ratio(best)]
        });
        table.row(side.name.clone(), cells.into_iter().flatten());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walked(walker: Walker, rates: [f64; 2]) -> Walked {
        Walked { name: format!("{walker:?}"), shape: Shape::Whole, walker, rates, agreement: None }
    }

    #[test]
    fn ratios_are_to_the_first_and_to_the_best_pipeline() {
        let sides = [
            walked(Walker::Pipeline, [1.0, 4.0]),
            walked(Walker::Pipeline, [2.0, 2.0]),
            walked(Walker::Software, [8.0, 8.0]),
        ];
        let mut table = Table::new(String::new(), &COLUMNS);
        add_rows(&mut table, &sides, Shape::Whole);
        let text = table.to_string();
        let row = text.lines().find(|line| line.contains("Software")).unwrap();
        let cells: Vec<_> = row.split('|').map(str::trim).filter(|cell| !cell.is_empty()).collect();
        assert_eq!(cells, ["Software", "8.000 M/s", "8.000x", "4.000x", "8.000 M/s", "2.000x", "2.000x"]);
    }
}
