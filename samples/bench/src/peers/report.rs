//! The report: a table of times and ratios, and notes.

use std::fmt;

use super::cold_build::BuildTime;
use super::peer::{Failure, PeerEntry, Sample};
use super::program::{Program, locked_version};
use super::statistics::{Spread, format_time};
use crate::paper::today;
use crate::table::Table;

/// Versions of all packages.
const LOCK: &str = include_str!("../../../../Cargo.lock");

/// The measurements of one peer in one row.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Measured {
    pub(super) samples: Vec<Sample>,
    /// Milliseconds in which the GPU worked, in rounds of their own.
    pub(super) gpu: Vec<f64>,
    /// The result of the work.
    pub(super) result: Option<f64>,
    /// Why there are no samples.
    pub(super) reason: Option<String>,
    /// Why there are samples, but no GPU times.
    pub(super) gpu_reason: Option<String>,
}

impl Measured {
    /// Discards the samples, for this reason.
    pub(super) fn fail(&mut self, reason: &dyn std::error::Error) {
        self.samples.clear();
        self.reason.get_or_insert_with(|| reason.to_string());
    }

    /// Discards the GPU times, for this reason.
    pub(super) fn fail_gpu(&mut self, reason: &dyn std::error::Error) {
        self.gpu.clear();
        self.gpu_reason.get_or_insert_with(|| reason.to_string());
    }
}

/// The report.
pub(super) struct Report {
    table: Table,
    peers: Vec<&'static str>,
    /// Reason, peer and rows.
    reasons: Vec<(String, &'static str, Vec<String>)>,
    differing: Vec<String>,
    builds: Vec<String>,
    lines: Vec<String>,
}

impl Report {
    pub(super) fn new(entries: &[PeerEntry], device: &str, rounds: u32, is_smoke_test: bool) -> Self {
        let smoke = if is_smoke_test { " (smoke test: times are not meaningful)" } else { "" };
        let mut versions: Vec<_> = entries.iter().map(|entry| version(entry.package)).collect();
        versions.dedup();
        let title = format!(
            "## peers: the same work by several libraries{smoke}\n\n{device}; {}; {}",
            versions.join(", "),
            today()
        );
        let peers: Vec<_> = entries.iter().map(|entry| entry.name).collect();
        let columns: Vec<_> = ["", "time"].into_iter().chain(peers.iter().copied()).collect();
        let mut table = Table::new(title, &columns);
        table.add_note(format!(
            "medians of up to {rounds} rounds; in brackets the ratio to {}, with the range of the middle half of the rounds",
            peers[0]
        ));
        table.add_note(
            "CPU: the thread until all work is submitted; done: until the GPU has finished; each peer in a process of its \
             own, asked in turn",
        );
        table.add_note(
            "GPU: while any queue works, by timestamps around each submission, which the layer of lvk-gpu-timer adds in rounds of \
             their own",
        );
        Self {
            table,
            peers,
            reasons: Vec::new(),
            differing: Vec::new(),
            builds: Vec::new(),
            lines: Vec::new(),
        }
    }

    /// Adds the times of a row with `items` equal items in a sample.
    pub(super) fn add_times(&mut self, title: &str, items: u32, is_cpu_only: bool, measured: Vec<Measured>) {
        let count = f64::from(items);
        let times = |time: fn(&Sample) -> f64| -> Vec<Vec<f64>> {
            let of_one = |m: &Measured| m.samples.iter().map(|sample| time(sample) / count).collect();
            measured.iter().map(of_one).collect()
        };
        if !is_cpu_only {
            self.table.add_row(
                title,
                std::iter::once("CPU".to_owned()).chain(cells(&times(|s| s.cpu), format_time)),
            );
        }
        let name = if is_cpu_only { title } else { "" };
        self.table
            .add_row(name, std::iter::once("done".to_owned()).chain(cells(&times(|s| s.done), format_time)));
        let gpu: Vec<Vec<f64>> =
            measured.iter().map(|m| m.gpu.iter().map(|time| time / count).collect()).collect();
        if gpu.iter().any(|times| !times.is_empty()) {
            self.table.add_row("", std::iter::once("GPU".to_owned()).chain(cells(&gpu, format_time)));
        }
        for (peer, measured) in self.peers.clone().into_iter().zip(&measured) {
            if let Some(reason) = &measured.reason {
                self.add_reason(reason, peer, title.to_owned());
            }
            if let Some(reason) = &measured.gpu_reason {
                self.add_reason(reason, peer, format!("GPU time of {title}"));
            }
        }
        self.compare_results(title, &measured);
    }

    /// Adds a line below the table.
    pub(super) fn add_note(&mut self, note: String) {
        self.table.add_note(note);
    }

    fn add_reason(&mut self, reason: &str, peer: &'static str, title: String) {
        let known = self.reasons.iter_mut().find(|(text, of, _)| text == reason && *of == peer);
        match known {
            Some((_, _, titles)) => titles.push(title),
            None => self.reasons.push((reason.to_owned(), peer, vec![title])),
        }
    }

    /// Notes results that differ from the first peer's by more than a thousandth.
    fn compare_results(&mut self, title: &str, measured: &[Measured]) {
        let Some(expected) = measured.first().and_then(|measured| measured.result) else { return };
        for (peer, measured) in self.peers.iter().zip(measured) {
            let Some(found) = measured.result else { continue };
            if (found - expected).abs() > 1e-3 * expected.abs() {
                self.differing.push(format!("{title}: the result of {peer} is {found}, not {expected}"));
            }
        }
    }

    /// Adds the resident memory in megabytes, as both times of the samples.
    pub(super) fn add_memory(&mut self, measured: Vec<Measured>) {
        let megabytes: Vec<Vec<f64>> =
            measured.iter().map(|m| m.samples.iter().map(|sample| sample.done).collect()).collect();
        let format = |megabytes: f64| format!("{megabytes:.1} MB");
        self.table.add_row(
            "resident memory after a submission",
            std::iter::once(String::new()).chain(cells(&megabytes, format)),
        );
    }

    /// Adds the time of a build from an empty folder.
    pub(super) fn add_build(&mut self, program: &Program, time: Result<BuildTime, Failure>) {
        let label = program.label;
        self.builds.push(match time {
            Ok(BuildTime { seconds, cpu_seconds: Some(cpu) }) => {
                format!("{label} {seconds:.0} s, {cpu:.0} s of all cores")
            }
            Ok(BuildTime { seconds, cpu_seconds: None }) => format!("{label} {seconds:.0} s"),
            Err(reason) => format!("{label} fails: {reason}"),
        });
    }

    /// Adds the lines of code of the triangles.
    pub(super) fn add_lines<'a>(&mut self, programs: impl Iterator<Item = &'a Program>) {
        self.lines =
            programs.map(|program| format!("{} {}", program.label, program.lines_of_code())).collect();
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.table)?;
        for (reason, peer, titles) in &self.reasons {
            writeln!(f, "- {peer} cannot: {}: {}", titles.join("; "), reason.trim_end_matches('.'))?;
        }
        if self.differing.is_empty() {
            writeln!(f, "- results of dispatches, uploads, rays and textures: equal")?;
        }
        self.differing.iter().try_for_each(|line| writeln!(f, "- DIFFERENT: {line}"))?;
        if !self.builds.is_empty() {
            writeln!(f, "- release build of the triangle from an empty folder: {}", self.builds.join("; "))?;
        }
        writeln!(f, "- lines of code of the triangle, shaders included: {}", self.lines.join(", "))
    }
}

/// Returns the name and the version of a package.
fn version(package: &str) -> String {
    format!("{package} {}", locked_version(LOCK, package).unwrap_or("of unknown version"))
}

/// Returns the cell of each peer: the median, and the ratio to the first peer.
fn cells(numbers: &[Vec<f64>], format: impl Fn(f64) -> String) -> Vec<String> {
    let cell = |(which, ours): (usize, &Vec<f64>)| {
        let Some(spread) = Spread::of_samples(ours.clone()) else { return "-".to_owned() };
        let median = format(spread.median);
        match Spread::of_ratios(ours, &numbers[0]) {
            Some(Spread { median: ratio, low, high }) if which > 0 => {
                format!("{median} ({ratio:.2}; {low:.2}-{high:.2})")
            }
            _ => median,
        }
    };
    numbers.iter().enumerate().map(cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peers::own_peers;

    fn measured(times: &[f64], result: Option<f64>) -> Measured {
        let samples = times.iter().map(|&time| Sample { cpu: time, done: 2.0 * time }).collect();
        let gpu = times.iter().map(|&time| 0.5 * time).collect();
        Measured { samples, gpu, result, ..Measured::default() }
    }

    #[test]
    fn cells_have_a_median_and_a_ratio_with_its_spread() {
        let found = cells(&[vec![2.0, 2.0, 2.0], vec![3.0, 2.0, 4.0], Vec::new()], format_time);
        assert_eq!(found, ["2.00 ms", "3.00 ms (1.50; 1.25-1.75)", "-"]);
    }

    #[test]
    fn a_report_names_versions_reasons_and_different_results() {
        let mut report = Report::new(&own_peers(), "a device", 3, false);
        report.add_times(
            "two items",
            2,
            false,
            vec![measured(&[4.0], Some(8.0)), measured(&[2.0], Some(7.0))],
        );
        let mut failed = Measured::default();
        failed.fail(&*Failure::from("no such feature"));
        report.add_times("other", 1, true, vec![measured(&[1.0], None), failed.clone()]);
        report.add_times("third", 1, true, vec![measured(&[1.0], None), failed]);
        let mut untimed = measured(&[1.0], None);
        untimed.fail_gpu(&*Failure::from("no timestamps"));
        report.add_times("fourth", 1, false, vec![measured(&[1.0], None), untimed]);
        report.add_memory(vec![measured(&[20.0], None), measured(&[25.0], None)]);
        let program = Program { label: "a", dependencies: "", files: &[] };
        report.add_build(&program, Ok(BuildTime { seconds: 61.2, cpu_seconds: Some(99.6) }));
        report.add_build(&program, Ok(BuildTime { seconds: 2.0, cpu_seconds: None }));
        report.add_build(&program, Err("no compiler".into()));
        let text = report.to_string();
        for part in [
            "ash 0.38",
            "| two items ",
            "1.00 ms (0.50; 0.50-0.50)",
            "GPU | 1.00 ms |  500 us (0.50; 0.50-0.50)",
            "lvk cannot: other; third: no such feature",
            "lvk cannot: GPU time of fourth: no timestamps",
            "DIFFERENT: two items: the result of lvk is 7, not 8",
            "50.0 MB (1.25; 1.25-1.25)",
            "a 61 s, 100 s of all cores; a 2 s; a fails: no compiler",
            "lines of code of the triangle",
        ] {
            assert!(text.contains(part), "{part} in\n{text}");
        }
    }
}
