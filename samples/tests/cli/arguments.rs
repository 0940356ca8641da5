//! Arguments: errors of the command line, the help, and lists of scenes.

use std::fs;
use std::process::Command;

use crate::program::{Outcome, assert_names, has_device, hybrid};

#[test]
fn wrong_arguments_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for (line, parts) in [
        ("--width 0", ["--width", "1..=16384"]),
        ("--width 1000000", ["--width", "1..=16384"]),
        ("--height 0", ["--height", "1..=16384"]),
        ("--width -5", ["-5", "Usage"]),
        ("--depth 17", ["--depth", "0..=16"]),
        ("--camera 0", ["--camera", "1..=5"]),
        ("--camera 6", ["--camera", "1..=5"]),
        ("--frames 0", ["--frames", "'0'"]),
        ("--method raster", ["--method", "standalone, hybrid"]),
        ("--rt mesh", ["--rt", "auto, pipeline, query"]),
        ("--profile pixel", ["--profile", "mali-g715, mali-g720"]),
        ("--sceen a.obj", ["--sceen", "--scene"]),
        ("a.obj", ["a.obj", "Usage"]),
    ] {
        let mut command = hybrid(&line.split(' ').collect::<Vec<_>>());
        command.current_dir(folder.path());
        Outcome::from_command(command).assert_usage_error(&parts);
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn the_help_lists_every_option() {
    let help = Outcome::from_command(hybrid(&["--help"]));
    help.assert_success();
    assert_names(
        &help.out,
        &[
            "--scene",
            "--method",
            "--rt",
            "--width",
            "--height",
            "--frames",
            "--camera",
            "--depth",
            "--out",
            "--device",
            "--profile",
            "--validate",
            "--list-devices",
            "--cameras",
            "--scale",
            "Exit status",
        ],
    );
}

#[test]
fn samples_with_one_scene_list_it_and_all_list_devices() {
    if !has_device() {
        return;
    }
    for (program, scene) in [
        (env!("CARGO_BIN_EXE_hybrid_oit"), "room  built in"),
        (env!("CARGO_BIN_EXE_reflections"), "hall  built in"),
    ] {
        let mut command = Command::new(program);
        command.arg("--list-scenes");
        let outcome = Outcome::from_command(command);
        outcome.assert_success();
        assert!(outcome.out.starts_with(scene), "{}", outcome.out);
        let mut command = Command::new(program);
        command.arg("--list-devices");
        let outcome = Outcome::from_command(command);
        outcome.assert_success();
        assert!(outcome.out.starts_with("[0] "), "{}", outcome.out);
    }
}
