//! The parent's side of a child process.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use lvk_layer::LayerFolder;

use super::answer::{Answer, one_line};
use super::peer::{Failure, PeerDevice, Sample};
use super::serve::{GPU_TIME, MEMORY, RESULT, SAMPLE};

/// How children are started.
pub(super) struct Launch {
    /// The program, which is that of the parent.
    pub(super) program: PathBuf,
    /// The word in front of the options.
    pub(super) subcommand: Option<&'static str>,
    /// File for messages of the validation layer; `None` without it.
    pub(super) validation_log: Option<PathBuf>,
}

impl Launch {
    /// Starts a child with these options, and waits until the row is prepared. With `timer` the child can tell its GPU time.
    ///
    /// # Errors
    /// The reason that the child gives, or how it ended.
    pub(super) fn start(&self, args: &[String], timer: Option<&LayerFolder>) -> Result<PeerProcess, Failure> {
        let mut command = Command::new(&self.program);
        command.args(self.subcommand).args(args);
        if let Some(timer) = timer {
            timer.enable(&mut command);
        }
        if let Some(log) = &self.validation_log {
            command
                .env("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation")
                .env("VK_LAYER_VALIDATE_SYNC", "1")
                .env("VK_LAYER_REPORT_FLAGS", "error,warn")
                .env("VK_LAYER_DEBUG_ACTION", "VK_DBG_LAYER_ACTION_LOG_MSG")
                .env("VK_LAYER_LOG_FILENAME", log);
        }
        PeerProcess::new(&mut command)
    }
}

/// A child process with an open peer.
pub(super) struct PeerProcess {
    child: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    errors: tempfile::NamedTempFile,
    /// Milliseconds that the peer took to open its device.
    pub(super) opened_ms: f64,
    /// The device.
    pub(super) device: PeerDevice,
}

impl PeerProcess {
    fn new(command: &mut Command) -> Result<Self, Failure> {
        let errors = tempfile::NamedTempFile::new()?;
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(File::create(errors.path())?)
            .spawn()?;
        let requests = child.stdin.take();
        let answers = BufReader::new(child.stdout.take().ok_or("the child has no standard output")?);
        let device = PeerDevice { name: String::new(), is_cpu: false };
        let mut made = Self { child, requests, answers, errors, opened_ms: f64::NAN, device };
        loop {
            match made.next_answer()? {
                Answer::Opened { milliseconds, device } => {
                    (made.opened_ms, made.device) = (milliseconds, device);
                }
                Answer::Ready => return Ok(made),
                other => return Err(unexpected(&other)),
            }
        }
    }

    /// Takes a sample.
    pub(super) fn sample(&mut self) -> Result<Sample, Failure> {
        match self.ask(SAMPLE)? {
            Answer::Times(times) => Ok(times),
            other => Err(unexpected(&other)),
        }
    }

    /// Returns the result of the last sample.
    pub(super) fn result(&mut self) -> Result<Option<f64>, Failure> {
        match self.ask(RESULT)? {
            Answer::Result(result) => Ok(result),
            other => Err(unexpected(&other)),
        }
    }

    /// Takes a sample, and returns the milliseconds in which the GPU worked for it.
    pub(super) fn gpu_time(&mut self) -> Result<f64, Failure> {
        self.take_gpu_time()?;
        self.sample()?;
        // A loader that did not find the layer opens none, and the library of the child knows no device.
        Ok(self
            .take_gpu_time()?
            .ok_or("the layer saw no submission: the loader did not find it, or there was none")?)
    }

    fn take_gpu_time(&mut self) -> Result<Option<f64>, Failure> {
        match self.ask(GPU_TIME)? {
            Answer::GpuTime(milliseconds) => Ok(milliseconds),
            other => Err(unexpected(&other)),
        }
    }

    /// Returns the resident memory of the process in megabytes.
    pub(super) fn memory(&mut self) -> Result<Option<f64>, Failure> {
        match self.ask(MEMORY)? {
            Answer::Memory(megabytes) => Ok(megabytes),
            other => Err(unexpected(&other)),
        }
    }

    fn ask(&mut self, request: &str) -> Result<Answer, Failure> {
        let requests = self.requests.as_mut().ok_or("the child has no standard input")?;
        // A child that has ended gives no answer, which says more than the broken pipe.
        let _ = writeln!(requests, "{request}").and_then(|()| requests.flush());
        self.next_answer()
    }

    fn next_answer(&mut self) -> Result<Answer, Failure> {
        let mut line = String::new();
        loop {
            line.clear();
            if self.answers.read_line(&mut line)? == 0 {
                return Err(self.ending().into());
            }
            if let Some(answer) = Answer::from_line(&line) {
                return Ok(answer);
            }
        }
    }

    /// Describes how the process ended, with the last lines of its standard error.
    fn ending(&mut self) -> String {
        let status = self.child.wait().map_or_else(|error| error.to_string(), |status| status.to_string());
        let text = std::fs::read_to_string(self.errors.path()).unwrap_or_default();
        let kept = text.lines().filter(|line| !line.starts_with("note:")).collect::<Vec<_>>().join(" ");
        let kept = one_line(&kept);
        let end = kept.char_indices().nth(240).map_or(kept.len(), |(end, _)| end);
        format!("the process ended with {status}: {}", &kept[..end])
    }
}

impl Drop for PeerProcess {
    fn drop(&mut self) {
        // The child ends when its standard input does.
        drop(self.requests.take());
        let _ = self.child.wait();
    }
}

fn unexpected(answer: &Answer) -> Failure {
    match answer {
        Answer::Cannot(reason) => reason.clone().into(),
        other => format!("an answer that was not asked for: {other}").into(),
    }
}
