//! Takes the place of `window` in builds without the feature of that name.

use lvk::ValidationSink;

use super::cli::{ReadySample, SampleSetup};
use super::run_args::RunArgs;
use super::run_error::RunError;

/// The event loop of no window.
pub type EventLoopBuilder = ();

/// Returns the event loop of a program without windows.
pub fn event_loop() -> EventLoopBuilder {}

/// Fails: the program has no windows.
pub(super) fn run<S, M>(
    (): &mut EventLoopBuilder,
    name: &str,
    _: &RunArgs,
    _: &ValidationSink,
    _: M,
) -> Result<(), RunError>
where
    M: FnOnce(&mut SampleSetup<'_>) -> Result<ReadySample<S>, RunError>,
{
    Err(RunError::BuiltWithoutWindows { name: name.to_owned() })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test")]
mod tests {
    use crate::hello_triangle::HelloTriangle;

    /// `cargo test -p lvk-samples --lib without_windows`: the tests of the whole workspace have windows.
    #[test]
    fn a_build_without_windows_refuses_one_with_the_remedy() {
        let args: crate::app::run_args::RunArgs =
            crate::app::cli::parse_line::<HelloTriangle>("--window").unwrap().run;
        let sink = lvk::ValidationSink::default();
        let make = |_: &mut super::SampleSetup<'_>| -> Result<super::ReadySample<HelloTriangle>, _> {
            unreachable!("no device is opened")
        };
        let error = super::run(&mut super::event_loop(), "hello_triangle", &args, &sink, make).unwrap_err();
        assert_eq!(error.status(), 2);
        assert!(error.to_string().contains("--features window --bin hello_triangle"), "{error}");
    }
}
