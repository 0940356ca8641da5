//! Each sample shows the same image in a window as without one.

use crate::missing_features;
use crate::session::{BESIDE_PANEL, SIZE, assert_success, desktop, differing, read_image, sample, texts};

/// Shows a few frames, and compares the last with the same frame of a sequence without a window.
fn assert_window_matches_sequence(program: &str, args: &[&str]) {
    let Some(desktop) = desktop() else { return };
    let folder = tempfile::tempdir().unwrap();
    let windowed = [&["--window", "--frames", "3", "--validate", "--out", "window.png"], args].concat();
    let mut windowed_sample = sample(program, &windowed, folder.path());
    desktop.attach(&mut windowed_sample);
    let output = windowed_sample.output().unwrap();
    assert_success(&output);
    assert!(texts(&output).0.contains("validation messages: 0"), "{}", texts(&output).0);
    let headless = [&["--frames", "2..3", "--out", "frame_#.png"], args].concat();
    assert_success(&sample(program, &headless, folder.path()).output().unwrap());
    let (window, frame) =
        (read_image(&folder.path().join("window.png")), read_image(&folder.path().join("frame_2.png")));
    assert_eq!(window.dimensions(), (SIZE[0], SIZE[1]));
    let beside = differing(&window, &frame, BESIDE_PANEL);
    assert!(beside < 1e-3, "{beside} of the picture beside the panel");
    assert!(differing(&window, &frame, 0) > 0.1, "there is no panel");
}

/// Declares a test for each sample: its name, the program and the arguments.
macro_rules! tests_of_windows {
    ($($test:ident: $program:literal, $args:expr;)*) => {$(
        #[test]
        fn $test() {
            assert_window_matches_sequence(env!(concat!("CARGO_BIN_EXE_", $program)), $args);
        }
    )*};
}

tests_of_windows! {
    deferred_has_a_window: "deferred", &["--lights", "60"];
    hello_triangle_has_a_window: "hello_triangle", &[];
    render_to_cube_map_has_a_window: "render_to_cube_map", &["--face-size", "64"];
    omni_shadows_has_a_window: "omni_shadows", &["--show-cube"];
    yuv_has_a_window: "yuv", &[];
    triplanar_has_a_window: "triplanar", &[];
    rtx_hello_has_a_window: "rtx_hello", &[];
    rtx_textures_has_a_window: "rtx_textures", &[];
    rtx_pipeline_has_a_window: "rtx_pipeline", &[];
    rtx_ao_has_a_window: "rtx_ao", &["--passes", "1"];
    sponza_has_a_window: "sponza", &["--shadow-size", "512"];
    large_scene_has_a_window: "large_scene", &["--triangles", "20000", "--copies", "30", "--samples", "1"];
    hybrid_has_a_window: "hybrid", &["--depth", "1"];
    hybrid_oit_has_a_window: "hybrid_oit", &["--supersampling", "1"];
    reflections_has_a_window: "reflections", &["--samples", "1"];
}

#[test]
fn mesh_shaders_has_a_window() {
    let program = env!("CARGO_BIN_EXE_mesh_shaders");
    let folder = tempfile::tempdir().unwrap();
    match missing_features::mesh_shaders(sample(program, &["--frames", "1"], folder.path())) {
        None => assert_window_matches_sequence(program, &[]),
        Some(lack) => eprintln!("NOT TESTED, {lack}"),
    }
}
