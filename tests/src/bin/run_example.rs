//! Runs an example of `lvk`, as `cargo run -p lvk --example NAME` does: tests start this program with the example's name.

#[path = "../../../lvk/examples/compute.rs"]
mod compute;
#[path = "../../../lvk/examples/draw.rs"]
mod draw;
#[path = "../../../lvk/examples/guest.rs"]
mod guest;
#[path = "../../../lvk/examples/ray_pipeline.rs"]
mod ray_pipeline;
#[path = "../../../lvk/examples/ray_query_fragment.rs"]
mod ray_query_fragment;
#[path = "../../../lvk/examples/triangle.rs"]
mod triangle;
#[path = "../../../lvk/examples/window.rs"]
mod window;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    match std::env::args().nth(1).as_deref() {
        Some("compute") => compute::main(),
        Some("draw") => draw::main(),
        Some("guest") => guest::main(),
        Some("ray_pipeline") => ray_pipeline::main(),
        Some("ray_query_fragment") => ray_query_fragment::main(),
        Some("triangle") => triangle::main(),
        Some("window") => window::main(),
        name => Err(format!("no example {name:?}").into()),
    }
}
