//! The program of the `omni_shadows` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::omni_shadows::OmniShadows>()
}
