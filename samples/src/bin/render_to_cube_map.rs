//! The program of the `render_to_cube_map` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::render_to_cube_map::RenderToCubeMap>()
}
