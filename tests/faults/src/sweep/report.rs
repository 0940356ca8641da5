//! Runs all faults of a plan, and counts what came of them.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::clean_program::CleanProgram;
use super::plan::SweepPlan;
use super::run::Program;
use super::verdict::{Ending, Flaw, RunOutcome, flaws, leaks_on_purpose};
use crate::fault::{Fault, PROGRESS};

/// Environment variable with the number of processes at the same time.
pub const JOBS_VARIABLE: &str = "LVK_FAULT_JOBS";

/// Returns the number of processes at the same time: that of the environment, or the number of cores and 2 at least.
fn jobs() -> usize {
    let wish = std::env::var(JOBS_VARIABLE).ok().and_then(|text| text.parse().ok()).filter(|jobs| *jobs > 0);
    wish.unwrap_or_else(|| std::thread::available_parallelism().map_or(2, |count| count.get().max(2)))
}

/// A run with flaws.
#[derive(Debug)]
pub struct FlawedRun {
    /// The fault; `None` for a run without.
    pub fault: Option<Fault>,
    /// The flaws.
    pub flaws: Vec<Flaw>,
    /// The last lines of standard error.
    pub stderr: String,
}

/// Counts of a sweep.
#[derive(Debug, Default)]
pub struct SweepReport {
    /// Calls of the run without fault.
    pub calls: usize,
    /// Commands among them.
    pub commands: usize,
    /// Faults of the plan.
    pub planned: usize,
    /// Runs with a fault.
    pub runs: usize,
    /// Runs in which the fault was reached.
    pub reached: usize,
    /// Faults that no run reached. Those in questions about the progress of work do not count: how often a program asks depends
    /// on the speed of the device.
    pub missed: usize,
    /// Runs in which the fault was reached, and that ended with an error.
    pub refused: usize,
    /// Runs in which the fault was reached, and that ended with success.
    pub succeeded: usize,
    /// Those by command and error.
    pub succeeded_by: BTreeMap<String, usize>,
    /// Runs that left a context alive on purpose, as its work could not be waited for.
    pub leaked: usize,
    /// Runs with flaws.
    pub flawed: Vec<FlawedRun>,
    /// Time of the sweep.
    pub time: Duration,
}

impl fmt::Display for SweepReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            calls,
            commands,
            planned,
            runs,
            reached,
            missed,
            refused,
            succeeded,
            succeeded_by,
            leaked,
            flawed,
            time,
        } = self;
        write!(
            out,
            "{calls} calls of {commands} commands, {runs} of {planned} faults, {reached} reached, {missed} missed, \
             {refused} errors, {succeeded} successes, {leaked} runs leaked a context, {} flawed, {} s",
            flawed.len(),
            time.as_secs()
        )?;
        for (by, count) in succeeded_by {
            write!(out, "\n  right results with {by}: {count}")?;
        }
        for run in flawed {
            let fault = run.fault.as_ref().map_or_else(|| "no fault".to_owned(), ToString::to_string);
            let texts: Vec<_> = run.flaws.iter().map(ToString::to_string).collect();
            write!(out, "\n  {fault}: {}\n    {}", texts.join("; "), run.stderr.replace('\n', "\n    "))?;
        }
        Ok(())
    }
}

impl SweepReport {
    /// Returns the row of a program in a table: calls, faults, faults that were reached, errors, right results, contexts that
    /// were leaked, runs with flaws, and seconds.
    #[must_use]
    pub fn row(&self, name: &str) -> String {
        let Self { calls, runs, reached, refused, succeeded, leaked, flawed, time, .. } = self;
        let (flawed, seconds) = (flawed.len(), time.as_secs());
        format!(
            "| {name} | {calls} | {runs} | {reached} | {refused} | {succeeded} | {leaked} | {flawed} | {seconds} |"
        )
    }

    /// True if at least half of the planned faults have run, and at most `most_missed` of them were not reached.
    #[must_use]
    pub fn is_large_enough(&self, most_missed: usize) -> bool {
        self.runs > 0 && 2 * self.runs >= self.planned && self.missed <= most_missed
    }

    fn add(&mut self, fault: &Fault, outcome: &RunOutcome, flaws: Vec<Flaw>) {
        self.runs += 1;
        self.reached += usize::from(outcome.reached);
        self.missed += usize::from(!outcome.reached && fault.command != PROGRESS);
        match outcome.ending {
            Ending::Status(0) if outcome.reached => {
                self.succeeded += 1;
                let by = format!("{} {}", fault.command, fault.error.name());
                *self.succeeded_by.entry(by).or_default() += 1;
            }
            Ending::Status(_) => self.refused += usize::from(outcome.reached),
            _ => {}
        }
        self.leaked += usize::from(leaks_on_purpose(Some(fault), outcome));
        if !flaws.is_empty() {
            let stderr = last_lines(&outcome.stderr);
            self.flawed.push(FlawedRun { fault: Some(fault.clone()), flaws, stderr });
        }
    }
}

/// Runs a program without a fault, then with each fault of the plan until `budget` has passed.
///
/// # Errors
/// Those of files and processes.
pub fn sweep(program: &Program, plan: &SweepPlan, budget: Duration) -> io::Result<SweepReport> {
    let start = Instant::now();
    let program = CleanProgram::new(program.clone())?;
    let clean = &program.clean;
    let commands: BTreeSet<_> = clean.calls.iter().map(|call| &call.command).collect();
    let faults = plan.faults(&clean.calls);
    let mut report = SweepReport {
        calls: clean.calls.len(),
        commands: commands.len(),
        planned: faults.len(),
        ..Default::default()
    };
    let mut flaws_of_clean = flaws(None, clean, clean);
    if clean.ending != Ending::Status(0) || clean.calls.is_empty() {
        flaws_of_clean.push(Flaw::WrongResult);
    }
    if !flaws_of_clean.is_empty() {
        let stderr = last_lines(&clean.stderr);
        report.flawed.push(FlawedRun { fault: None, flaws: flaws_of_clean, stderr });
        return Ok(report);
    }
    let (next, report) = (AtomicUsize::new(0), Mutex::new(report));
    let work = || -> io::Result<()> {
        while let Some(fault) = faults.get(next.fetch_add(1, Ordering::Relaxed)) {
            if start.elapsed() > budget {
                break;
            }
            let (outcome, flaws_found) = program.run_until_reached(fault)?;
            report.lock().unwrap_or_else(PoisonError::into_inner).add(fault, &outcome, flaws_found);
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..jobs()).map(|_| scope.spawn(work)).collect();
        threads.into_iter().try_for_each(|thread| match thread.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        })
    })?;
    let mut report = report.into_inner().unwrap_or_else(PoisonError::into_inner);
    report.time = start.elapsed();
    Ok(report)
}

fn last_lines(text: &str) -> String {
    let lines: Vec<&str> = text.trim().lines().collect();
    lines[lines.len().saturating_sub(4)..].join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_has_the_counts_in_order() {
        let report = SweepReport {
            calls: 105,
            commands: 34,
            planned: 430,
            runs: 420,
            reached: 410,
            missed: 0,
            refused: 400,
            succeeded: 10,
            succeeded_by: BTreeMap::new(),
            leaked: 7,
            flawed: vec![FlawedRun { fault: None, flaws: vec![Flaw::Hang], stderr: String::new() }],
            time: Duration::from_secs(12),
        };
        assert_eq!(report.row("queues"), "| queues | 105 | 420 | 410 | 400 | 10 | 7 | 1 | 12 |");
    }

    #[test]
    fn a_sample_has_half_of_its_faults_and_misses_none() {
        let report = |runs, missed| SweepReport { planned: 12, runs, missed, ..Default::default() };
        assert!(report(6, 0).is_large_enough(0) && report(12, 1).is_large_enough(1));
        assert!(!report(5, 0).is_large_enough(0), "too few");
        assert!(!report(12, 1).is_large_enough(0), "one was missed");
        assert!(!SweepReport::default().is_large_enough(0), "no fault");
    }
}
