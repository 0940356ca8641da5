//! A headless X server (Xvfb) for programs that open windows.

use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::error::DriverError;
use crate::layout::{KEYBOARDS, X_SERVER};

/// A running X server, stopped on drop. The server also stops when its last client disconnects.
#[derive(Debug)]
pub struct VirtualDisplay {
    name: String,
    server: Child,
    install_folder: Option<PathBuf>,
}

impl VirtualDisplay {
    /// Returns the display name as in `DISPLAY`: `:` and a number.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Sets the environment of `program` so that it opens its windows on this display.
    pub fn attach(&self, program: &mut Command) {
        program.envs(self.variables());
    }

    /// Returns the environment variables of programs that open their windows on this display. If the server was downloaded, so are
    /// the client libraries and the keyboard descriptions.
    pub fn variables(&self) -> Vec<(&'static str, OsString)> {
        // An empty name is none.
        let mut variables = vec![
            ("DISPLAY", OsString::from(&self.name)),
            ("WAYLAND_DISPLAY", OsString::new()),
            ("WAYLAND_SOCKET", OsString::new()),
        ];
        if let Some(folder) = &self.install_folder {
            variables.push(("LD_LIBRARY_PATH", folder.join("lib").into()));
            variables.push(("XKB_CONFIG_ROOT", folder.join(KEYBOARDS).into()));
        }
        variables
    }

    /// Starts the system's Xvfb; `None` if Xvfb or xkbcomp is not installed.
    pub(super) fn from_system() -> Option<Result<Self, DriverError>> {
        let server = Path::new("/usr/bin/Xvfb");
        let complete = server.is_file() && Path::new("/usr/bin/xkbcomp").is_file();
        complete.then(|| Self::start(Command::new(server), server))
    }

    /// Starts the Xvfb of a downloaded component folder.
    pub(super) fn from_folder(folder: &Path) -> Result<Self, DriverError> {
        let server = folder.join(X_SERVER);
        let mut command = Command::new(&server);
        command.current_dir(folder).arg("-xkbdir").arg(folder.join(KEYBOARDS));
        command.env("LD_LIBRARY_PATH", folder.join("lib"));
        let mut display = Self::start(command, &server)?;
        display.install_folder = Some(folder.to_path_buf());
        Ok(display)
    }

    fn start(mut command: Command, path: &Path) -> Result<Self, DriverError> {
        let broken = |reason: String| DriverError::Broken { path: path.to_path_buf(), reason };
        // The server picks a free display number and writes it to standard output when it is ready.
        command.args(["-displayfd", "1", "-screen", "0", "2048x1536x24", "-nolisten", "tcp"]);
        command.args(["-terminate", "-extension", "GLX"]);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut server = command.spawn().map_err(|error| broken(error.to_string()))?;
        let mut number = String::new();
        if let Some(out) = server.stdout.take() {
            // A server that exits writes nothing.
            let _ = BufReader::new(out).read_line(&mut number);
        }
        let mut display = Self { name: format!(":{}", number.trim()), server, install_folder: None };
        if !number.trim().is_empty() {
            return Ok(display);
        }
        let mut message = String::new();
        if let Some(err) = &mut display.server.stderr {
            let _ = err.read_to_string(&mut message);
        }
        Err(broken(format!("the X server did not start: {}", message.trim())))
    }
}

impl Drop for VirtualDisplay {
    fn drop(&mut self) {
        // The server may have exited already.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
