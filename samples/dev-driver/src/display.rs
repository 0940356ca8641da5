//! An X server without a screen, for as long as somebody needs windows.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use super::error::DriverError;
use super::prefix::{KEYBOARDS, X_SERVER};

/// A running X server, stopped on drop. It also stops by itself when its last client has gone.
#[derive(Debug)]
pub struct VirtualDisplay {
    name: String,
    server: Child,
    fetched: Option<PathBuf>,
}

impl VirtualDisplay {
    /// What programs call it: `:` and a number, as in `DISPLAY`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Has `program` show its windows here. Where the server was fetched, the libraries that come with it are found too.
    pub fn show(&self, program: &mut Command) {
        program.env("DISPLAY", &self.name).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        if let Some(folder) = &self.fetched {
            program.env("LD_LIBRARY_PATH", folder.join("lib")).env("XKB_CONFIG_ROOT", folder.join(KEYBOARDS));
        }
    }

    /// The machine's own server, where it is complete.
    pub(super) fn of_machine() -> Option<Result<Self, DriverError>> {
        let server = Path::new("/usr/bin/Xvfb");
        let complete = server.is_file() && Path::new("/usr/bin/xkbcomp").is_file();
        complete.then(|| Self::start(Command::new(server), server))
    }

    /// The server of a fetched folder, which finds all it needs there.
    pub(super) fn of_folder(folder: &Path) -> Result<Self, DriverError> {
        let server = folder.join(X_SERVER);
        let mut command = Command::new(&server);
        command.current_dir(folder).arg("-xkbdir").arg(folder.join(KEYBOARDS));
        command.env("LD_LIBRARY_PATH", folder.join("lib"));
        let mut display = Self::start(command, &server)?;
        display.fetched = Some(folder.to_path_buf());
        Ok(display)
    }

    fn start(mut command: Command, path: &Path) -> Result<Self, DriverError> {
        let broken = |reason: String| DriverError::Broken { path: path.to_path_buf(), reason };
        // The server chooses a free number and writes it to its standard output when it is ready.
        command.args(["-displayfd", "1", "-screen", "0", "2048x1536x24", "-nolisten", "tcp"]);
        command.args(["-terminate", "-extension", "GLX"]);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut server = command.spawn().map_err(|error| broken(error.to_string()))?;
        let mut number = String::new();
        if let Some(out) = server.stdout.take() {
            // A server that ends says nothing.
            let _ = BufReader::new(out).read_line(&mut number);
        }
        let mut display = Self { name: format!(":{}", number.trim()), server, fetched: None };
        if !number.trim().is_empty() {
            return Ok(display);
        }
        let mut complaint = String::new();
        if let Some(err) = &mut display.server.stderr {
            let _ = err.read_to_string(&mut complaint);
        }
        Err(broken(format!("it did not start: {}", complaint.trim())))
    }
}

impl Drop for VirtualDisplay {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
