//! The parent process: it starts the children, asks them in turn, and prints the report.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use lvk_dev_driver::{DriverRequest, prepare};
use lvk_layer::LayerFolder;

use super::args::{PeersArgs, WorkClass};
use super::child::{Launch, PeerProcess};
use super::cold_build::cold_build;
use super::gpu_timer::timer_layer;
use super::peer::{Failure, PeerEntry, Sample};
use super::report::{Measured, Report};
use super::row::Row;
use super::serve::serve;

/// Rounds before those that count.
const WARM_UP_ROUNDS: u32 = 2;
/// Time after which a row ends, once it has [`FEWEST_ROUNDS`].
const LONGEST_ROW: Duration = Duration::from_secs(25);
/// Rounds that a row has at least.
const FEWEST_ROUNDS: u32 = 3;

/// Options that are not those of the comparison alone.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RunOptions {
    /// Tiny sizes, two rounds.
    pub quick: bool,
    /// Rounds of each row; `None` for the default of the device.
    pub runs: Option<u32>,
    /// Run under the validation layer; a message is an error.
    pub validate: bool,
    /// Words in front of the options on the command line of this program.
    pub subcommand: Option<&'static str>,
}

/// Measures the rows for `entries`, the first of which the others are compared with. Returns the report. In a child process
/// it serves the parent and does not return.
///
/// # Errors
/// The first peer does not open, a name of the command line is unknown, validation reported messages, or the report cannot
/// be written.
pub fn run(entries: &[PeerEntry], args: &PeersArgs, options: &RunOptions) -> Result<String, Failure> {
    if let (Some(name), Some(row)) = (&args.serve, args.row.as_deref().and_then(Row::from_key)) {
        let entry = entries.iter().find(|entry| entry.name == name).ok_or("no such peer")?;
        serve(entry, row, &args.workload(&args.class))?;
    }
    let entries = chosen(entries, &args.peers)?;
    prepare(&DriverRequest { validation: options.validate, ..DriverRequest::default() })?;
    let log = options.validate.then(tempfile::NamedTempFile::new).transpose()?;
    let launch = Launch {
        program: std::env::current_exe()?,
        subcommand: options.subcommand,
        validation_log: log.as_ref().map(|log| log.path().to_owned()),
    };
    let report = measure(&entries, args, options, &launch)?.to_string();
    if let Some(log) = log {
        let messages = std::fs::read_to_string(log.path())?;
        if !messages.trim().is_empty() {
            return Err(format!("validation reported:\n{messages}").into());
        }
    }
    if let Some(out) = &args.out {
        write_report(out, &report)?;
    }
    Ok(report)
}

fn write_report(out: &PathBuf, report: &str) -> Result<(), Failure> {
    let fail = |error| format!("cannot write {}: {error}", lvk::readable_name(out));
    Ok(std::fs::write(out, report).map_err(fail)?)
}

/// Returns the first entry, and those with these names, or all.
fn chosen(entries: &[PeerEntry], names: &[String]) -> Result<Vec<PeerEntry>, Failure> {
    if let Some(unknown) = names.iter().find(|name| !entries.iter().any(|entry| entry.name == *name)) {
        let known: Vec<_> = entries.iter().map(|entry| entry.name).collect();
        return Err(format!("no peer '{unknown}' in this program; choose of: {}", known.join(", ")).into());
    }
    let is_chosen = |number: usize, entry: &PeerEntry| {
        number == 0 || names.is_empty() || names.iter().any(|name| name == entry.name)
    };
    let numbered = entries.iter().enumerate().filter(|(number, entry)| is_chosen(*number, entry));
    Ok(numbered.map(|(_, entry)| *entry).collect())
}

fn measure(
    entries: &[PeerEntry],
    args: &PeersArgs,
    options: &RunOptions,
    launch: &Launch,
) -> Result<Report, Failure> {
    let probe = launch.start(&args.child(entries[0].name, Row::EmptySubmit, WorkClass::Quick), None)?;
    let class = match (options.quick, probe.device.is_cpu) {
        (true, _) => WorkClass::Quick,
        (false, true) => WorkClass::Cpu,
        (false, false) => WorkClass::Gpu,
    };
    let rounds = options.runs.unwrap_or(class.rounds());
    let work = args.workload(class.key());
    let device = probe.device.name.clone();
    let mut report = Report::new(entries, &device, rounds, options.quick || options.validate);
    drop(probe);
    report.add_note(format!("frames of rays and of textures: the mean of {} in a row", work.frames));
    let timer = timer_layer().map_err(|error| report.add_note(format!("no time of the GPU: {error}"))).ok();
    let run = Rounds { entries, args, launch, device: &device, class, rounds };
    let [opened, memory] = run.opened();
    report.add_times("context created", 1, true, opened);
    for row in args.selected() {
        eprintln!("measuring {} ...", row.key());
        let mut measured = run.row(row);
        if let (Some(timer), false) = (&timer, row.is_cpu_only()) {
            run.add_gpu_times(row, timer, &mut measured);
        }
        report.add_times(&row.title(&work), row.items(&work), row.is_cpu_only(), measured);
    }
    report.add_memory(memory);
    if args.builds {
        for program in entries.iter().flat_map(|entry| entry.triangles) {
            eprintln!("building the triangle of {} ...", program.label);
            report.add_build(program, cold_build(program));
        }
    }
    report.add_lines(entries.iter().filter_map(|entry| entry.triangles.first()));
    Ok(report)
}

/// Rounds over all peers.
struct Rounds<'a> {
    entries: &'a [PeerEntry],
    args: &'a PeersArgs,
    launch: &'a Launch,
    /// Name of the first peer's device, with its driver.
    device: &'a str,
    class: WorkClass,
    rounds: u32,
}

impl Rounds<'_> {
    /// Starts a process of each peer in every round. Returns the times to open a device, and the resident memory after one
    /// submission.
    fn opened(&self) -> [Vec<Measured>; 2] {
        let count = self.entries.len();
        let [mut times, mut memory] = [(); 2].map(|()| vec![Measured::default(); count]);
        for round in 0..self.rounds.min(WorkClass::Cpu.rounds()) as usize {
            for turn in 0..count {
                let which = (turn + round) % count;
                match self.open_once(which) {
                    Ok((opened, held)) => {
                        times[which].samples.push(Sample { cpu: opened, done: opened });
                        memory[which].samples.extend(held.map(|mb| Sample { cpu: mb, done: mb }));
                    }
                    Err(reason) => times[which].fail(&*reason),
                }
            }
        }
        [times, memory]
    }

    fn open_once(&self, which: usize) -> Result<(f64, Option<f64>), Failure> {
        let mut process = self.start(&self.entries[which], Row::EmptySubmit, WorkClass::Quick, None)?;
        process.sample()?;
        Ok((process.opened_ms, process.memory()?))
    }

    /// Gives each peer its turn in every round, of which the first ones do not count, until the row takes too long. `turn` gets the number
    /// of a peer, and whether the round counts.
    fn take_turns(&self, rounds: u32, mut turn: impl FnMut(usize, bool)) {
        let (began, warm_up, count) = (Instant::now(), WARM_UP_ROUNDS.min(rounds), self.entries.len());
        for round in 0..warm_up + rounds {
            for place in 0..count {
                turn((place + round as usize) % count, round >= warm_up);
            }
            if began.elapsed() > LONGEST_ROW && round + 1 >= warm_up + FEWEST_ROUNDS {
                break;
            }
        }
    }

    /// Measures a row. The children live until the row ends.
    fn row(&self, row: Row) -> Vec<Measured> {
        let mut peers: Vec<_> = self.entries.iter().map(|entry| self.running(entry, row)).collect();
        self.take_turns(self.rounds, |which, counts| peers[which].sample(counts));
        peers.into_iter().map(RunningPeer::finish).collect()
    }

    /// Measures the GPU time of a row, in rounds of its own: the timer takes time of the CPU.
    fn add_gpu_times(&self, row: Row, timer: &LayerFolder, measured: &mut [Measured]) {
        let start = |(entry, measured): (&PeerEntry, &mut Measured)| {
            if measured.reason.is_some() {
                return None;
            }
            let started = self.start(entry, row, self.class, Some(timer));
            started.map_err(|reason| measured.fail_gpu(&*reason)).ok()
        };
        let mut peers: Vec<_> = self.entries.iter().zip(measured.iter_mut()).map(start).collect();
        self.take_turns(self.rounds.div_ceil(2), |which, counts| {
            let Some(process) = &mut peers[which] else { return };
            match process.gpu_time() {
                Ok(time) if counts => measured[which].gpu.push(time),
                Ok(_) => {}
                Err(reason) => {
                    measured[which].fail_gpu(&*reason);
                    peers[which] = None;
                }
            }
        });
    }

    /// Starts a child. All have to open the same device.
    fn start(
        &self,
        entry: &PeerEntry,
        row: Row,
        class: WorkClass,
        timer: Option<&LayerFolder>,
    ) -> Result<PeerProcess, Failure> {
        let process = self.launch.start(&self.args.child(entry.name, row, class), timer)?;
        let name = &process.device.name;
        if self.device.starts_with(name) {
            return Ok(process);
        }
        let first = self.entries[0].name;
        Err(format!(
            "its device is '{name}', and that of {first} '{}'; VK_DRIVER_FILES can hide one",
            self.device
        )
        .into())
    }

    fn running(&self, entry: &PeerEntry, row: Row) -> RunningPeer {
        let mut measured = Measured::default();
        let started = self.start(entry, row, self.class, None);
        let process = started.map_err(|reason| measured.fail(&*reason)).ok();
        RunningPeer { process, measured }
    }
}

/// A peer in a row.
struct RunningPeer {
    /// `None` once it has failed.
    process: Option<PeerProcess>,
    measured: Measured,
}

impl RunningPeer {
    fn sample(&mut self, counts: bool) {
        let Some(process) = &mut self.process else { return };
        match process.sample() {
            Ok(sample) if counts => self.measured.samples.push(sample),
            Ok(_) => {}
            Err(reason) => {
                self.measured.fail(&*reason);
                self.process = None;
            }
        }
    }

    fn finish(mut self) -> Measured {
        match self.process.as_mut().map(PeerProcess::result) {
            Some(Ok(result)) => self.measured.result = result,
            Some(Err(reason)) => self.measured.fail(&*reason),
            None => {}
        }
        self.measured
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peers::own_peers;

    #[test]
    fn the_reference_is_always_among_the_chosen_peers() {
        let all = own_peers();
        let names = |names: &[&str]| {
            let names: Vec<_> = names.iter().map(|name| (*name).to_owned()).collect();
            chosen(&all, &names).map(|found| found.iter().map(|entry| entry.name).collect::<Vec<_>>())
        };
        assert_eq!(names(&[]).unwrap(), ["ash", "lvk", "lvk-sw"]);
        assert_eq!(names(&["lvk"]).unwrap(), ["ash", "lvk"]);
        assert_eq!(names(&["ash"]).unwrap(), ["ash"]);
        assert!(names(&["gfx"]).unwrap_err().to_string().contains("ash, lvk, lvk-sw"));
    }
}
