//! The program of the `hello_triangle` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::hello_triangle::HelloTriangle>()
}
