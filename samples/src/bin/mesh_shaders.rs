//! The program of the `mesh_shaders` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::mesh_shaders::MeshShaders>()
}
