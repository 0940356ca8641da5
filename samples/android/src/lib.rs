//! The samples as an Android application: a native activity that runs one of them in its window. `docs/android.md` says
//! how it is built, and how a sample is chosen.
#![cfg(target_os = "android")]

use std::ffi::OsString;
use std::thread::sleep;
use std::time::Duration;

use lvk_samples::app::input_file::{self, FileKind};
use lvk_samples::catalogue::run_line;
use winit::event_loop::EventLoop;
use winit::platform::android::EventLoopBuilderExtAndroid;
use winit::platform::android::activity::AndroidApp;

/// File in the application's folder on the shared storage: the name of a sample, and its arguments.
const LINE_FILE: &str = "sample.txt";
/// The line where there is no such file.
const DEFAULT_LINE: &str = "hello_triangle";
/// Time for the thread that copies standard error to the system's log.
const LOG_DELAY: Duration = Duration::from_millis(300);

/// The program of the activity, on a thread of its own. What samples print goes to the system's log.
#[unsafe(no_mangle)]
fn android_main(app: AndroidApp) {
    let line = app
        .external_data_path()
        .and_then(|folder| input_file::read(&folder.join(LINE_FILE), FileKind::Line).ok());
    let line = line.and_then(|bytes| String::from_utf8(bytes).ok());
    let line = line.filter(|line| !line.trim().is_empty()).unwrap_or_else(|| DEFAULT_LINE.to_owned());
    let mut more = vec![OsString::from("--window")];
    if let Some(folder) = app.internal_data_path() {
        more.extend(["--cache".into(), folder.join("cache").into()]);
    }
    let status = run_line(&line, more, EventLoop::builder().with_android_app(app));
    eprintln!("'{}' has ended: {status:?}", line.trim());
    sleep(LOG_DELAY);
    // Android keeps the process for the next start, but a process has only one event loop.
    std::process::exit(0);
}
