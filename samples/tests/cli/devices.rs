//! Devices, drivers and profiles: lists, choices and errors.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use lvk_samples::app::metrics;

use crate::program::{
    Desk, HEIGHT, Outcome, TRIANGLE, WIDTH, assert_names, desk_with_device, has_device, hybrid,
};

#[test]
fn a_driver_wish_that_is_not_understood_is_wrong_input() {
    let desk = Desk::new();
    let mut command = desk.command(&["--scene", &desk.file("triangle.obj", TRIANGLE)]);
    command.env("LVK_DRIVER", "fast");
    Outcome::from_command(command).assert_error(2, &["LVK_DRIVER=fast", "`system` or `software`"]);
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn devices_are_listed_a_line_each() {
    if !has_device() {
        return;
    }
    let outcome = Outcome::from_command(hybrid(&["--list-devices"]));
    outcome.assert_success();
    assert!(!outcome.out.is_empty());
    let devices = outcome.out.lines().take_while(|line| !line.starts_with("the system's own Vulkan"));
    for (number, line) in devices.enumerate() {
        assert!(line.starts_with(&format!("[{number}] ")), "{line}");
        assert_names(line, &["Vulkan 1.", "): ray tracing pipeline ", ", ray query "]);
    }
}

/// The program with a list of drivers, of which none can be used.
fn with_drivers(files: &Path, args: &[&str]) -> Command {
    let mut command = hybrid(args);
    command.env("VK_DRIVER_FILES", files).env_remove("VK_ICD_FILENAMES").env_remove("LVK_DRIVER");
    command
}

#[test]
fn a_machine_without_a_driver_that_works_lists_why() {
    if !has_device() {
        return;
    }
    let desk = Desk::new();
    let library =
        desk.file("libtoy.so", "a text in the place of a library, which is longer than the header of ELF");
    let broken = desk.file("toy.json", format!(r#"{{"file_format_version": "1.0.0", "ICD": {{"library_path": "{library}", "api_version": "1.3.0"}}}}"#));
    let absent = desk.input.path().join("absent.json");
    let scene = desk.file("triangle.obj", TRIANGLE);
    for (manifest, parts) in [
        (
            Path::new(&broken),
            ["toy.json", "libtoy.so", "invalid ELF header", "remedy: install the driver of"],
        ),
        (&absent, ["absent.json", "cannot be read", "No such file", "remedy: correct or remove"]),
        (desk.output.path(), ["no driver manifest in", "VK_DRIVER_FILES=", "remedy: correct", "unset it"]),
    ] {
        let listed = Outcome::from_command(with_drivers(manifest, &["--list-devices"]));
        listed.assert_success();
        assert!(listed.out.starts_with("the loader ") && listed.out.lines().count() >= 4, "{}", listed.out);
        assert_names(&listed.out, &parts);
        let run = Outcome::from_command(with_drivers(manifest, &["--scene", &scene]));
        run.assert_error(1, &parts);
        assert_names(&run.err, &["no Vulkan device on this machine: the loader "]);
    }
}

/// The software driver takes the place of a system whose loader cannot be opened.
#[test]
#[cfg(target_os = "linux")]
fn the_reason_for_the_software_driver_is_one_line_and_the_list_has_the_rest() {
    if !has_device() || std::env::var_os("VK_DRIVER_FILES").is_some() {
        return;
    }
    let desk = Desk::new();
    desk.file("libvulkan.so.1", "");
    let (out, err) = {
        let mut command = hybrid(&["--list-devices"]);
        command
            .env_remove("LVK_DRIVER")
            .env_remove("VK_ICD_FILENAMES")
            .env("LD_LIBRARY_PATH", desk.input.path());
        let std::process::Output { stdout, stderr, .. } = command.output().unwrap();
        (String::from_utf8(stdout).unwrap(), String::from_utf8(stderr).unwrap())
    };
    let note = "lvk: a software driver is used, because the Vulkan loader libvulkan.so.1 cannot be opened\n";
    assert_eq!(err, note);
    assert!(out.starts_with("[0] "), "{out}");
    assert_names(
        &out,
        &["\nthe system's own Vulkan, which", "\nthe loader libvulkan.so.1 cannot be opened: ", "\nremedy: "],
    );
}

/// Neither a loader nor a driver, and none may be fetched.
#[test]
#[cfg(target_os = "linux")]
fn a_machine_without_a_loader_lists_what_to_install() {
    let empty = tempfile::tempdir().unwrap();
    let without_vulkan = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hybrid"));
        command.args(args).env("LVK_NO_DOWNLOAD", "1").env("LVK_VULKAN_DIR", empty.path());
        for variable in ["LVK_DRIVER", "LVK_DEVICE", "VK_ICD_FILENAMES", "VK_DRIVER_FILES"] {
            command.env_remove(variable);
        }
        for variable in ["XDG_CONFIG_DIRS", "XDG_DATA_DIRS", "HOME"] {
            command.env(variable, empty.path());
        }
        // A file in the place of the loader comes before the system's.
        std::fs::write(empty.path().join("libvulkan.so.1"), "").unwrap();
        Outcome::from_command({
            command.env("LD_LIBRARY_PATH", empty.path());
            command
        })
    };
    let listed = without_vulkan(&["--list-devices"]);
    listed.assert_success();
    assert_names(
        &listed.out,
        &[
            "the loader libvulkan.so.1 cannot be opened: ",
            "remedy: ",
            "cannot be downloaded because LVK_NO_DOWNLOAD",
        ],
    );
    let run = without_vulkan(&[]);
    run.assert_error(
        1,
        &["no Vulkan driver with ray tracing", "the loader libvulkan.so.1 cannot", "LVK_NO_DOWNLOAD"],
    );
}

#[test]
fn a_device_that_is_not_there_is_device_trouble() {
    let Some((desk, scene)) = desk_with_device() else { return };
    desk.run(&["--scene", &scene, "--device", "voodoo"])
        .assert_error(1, &["'voodoo' names no device", "[0] "]);
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn a_device_without_ray_tracing_gets_a_message_of_what_it_lacks() {
    let Some((desk, scene)) = desk_with_device() else { return };
    let Some(command) = desk.without_ray_tracing(&["--scene", &scene, "--rt", "query"]) else { return };
    Outcome::from_command(command).assert_error(1, &["SwiftShader", "lacks ray queries", "--rt software"]);
    let other = desk.run(&["--scene", &scene, "--rt", "query", "--device", "voodoo"]);
    assert!(!other.err.contains("--rt software"), "{}", other.err);
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn a_device_that_finds_no_visible_triangles_traces_everything() {
    let Some((desk, scene)) = desk_with_device() else { return };
    for named in [&["--method", "hybrid"][..], &["--raster", "compute"], &["--bounces", "first"]] {
        let args = [&["--scene", &scene, "--rt", "software"], named].concat();
        let Some(command) = desk.without_ray_tracing(&args) else { return };
        Outcome::from_command(command)
            .assert_error(1, &["SwiftShader", "64-bit atomics", "--method standalone"]);
    }
    // The device compiles for minutes, so `auto` alone, which takes the path of `software`.
    let Some(command) = desk.without_ray_tracing(&["--scene", &scene, "--rt", "auto"]) else { return };
    let Outcome { status, out, err } = Outcome::from_command(command);
    assert_eq!(status, Some(0), "{out}{err}");
    assert!(out.contains("stand-alone ray tracing") && out.contains("in software"), "{out}");
    assert!(err.contains("warning: SwiftShader") && err.contains("--method standalone"), "{err}");
    assert_eq!(desk.image_size(), (WIDTH, HEIGHT));
}

#[test]
fn without_a_driver_and_a_way_to_one_the_user_learns_what_to_install() {
    let desk = Desk::new();
    let scene = desk.file("triangle.obj", TRIANGLE);
    let empty = tempfile::tempdir().unwrap();
    let mut command = desk.command(&["--scene", &scene]);
    command.env("LVK_NO_DOWNLOAD", "1").env("LVK_VULKAN_DIR", empty.path()).env("LVK_DRIVER", "software");
    command.env_remove("VK_DRIVER_FILES").env_remove("VK_ICD_FILENAMES");
    let start = Instant::now();
    Outcome::from_command(command).assert_error(1, &["LVK_NO_DOWNLOAD", "apt install mesa-vulkan-drivers"]);
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
    assert_eq!(desk.output_files(), Vec::<String>::new());
    assert_eq!(fs::read_dir(empty.path()).unwrap().count(), 0, "nothing was begun");
}

/// The software driver would end the process by a signal.
#[test]
#[cfg(target_os = "linux")]
fn a_process_without_address_space_is_refused() {
    let Some((desk, scene)) = desk_with_device() else { return };
    let sample = desk.command(&["--scene", &scene]);
    for kib in [300_000, 471_000, 800_000, 1_400_000] {
        let mut command = std::process::Command::new("sh");
        command.args(["-c", &format!("ulimit -v {kib}; exec \"$0\" \"$@\"")]);
        command.arg(sample.get_program()).args(sample.get_args()).env("LVK_DRIVER", "software");
        Outcome::from_command(command)
            .assert_error(1, &["address space", "the software driver needs", "ulimit -v unlimited"]);
        assert_eq!(desk.output_files(), Vec::<String>::new());
    }
}

/// The path follows from what the profile leaves, and the first lines say which profile and which path.
#[test]
fn a_profile_decides_the_path_and_is_printed() {
    let Some((desk, scene)) = desk_with_device() else { return };
    for (profile, path) in [("mali-g715", "ray queries"), ("no-ray-query", "ray tracing pipeline")] {
        let outcome = desk.run(&["--scene", &scene, "--frames", "1", "--profile", profile, "--validate"]);
        outcome.assert_success();
        let told = format!("profile   {profile}, ");
        assert_names(&outcome.out, &[&told, path, "validation messages: 0"]);
    }
    let wish = ["--scene", &scene, "--frames", "1", "--profile", "no-ray-tracing", "--validate", "--rt"];
    let parts = ["lacks ray queries", "hidden by the device profile 'no-ray-tracing'"];
    desk.run(&[&wish[..], &["query"]].concat()).assert_error(1, &parts);
    let lowered = desk.run(&[&wish[..], &["pipeline"]].concat());
    lowered.assert_success();
    assert_names(&lowered.out, &["validation messages: 0"]);
    let note =
        "note: --rt pipeline takes a ray tracing pipeline, lowered to software traversal in a compute shader";
    assert_names(&lowered.err, &[note]);
    for (rt, why) in
        [("software", "software was asked for"), ("auto", "the device has no ray queries of its own")]
    {
        let outcome = desk.run(&[&wish[..], &[rt]].concat());
        outcome.assert_success();
        assert_names(&outcome.out, &[&format!("in software ({why})"), "validation messages: 0"]);
    }
}

#[test]
fn a_pipeline_without_ray_tracing_makes_the_default_picture() {
    if !has_device() {
        return;
    }
    let [default, lowered] = [&[][..], &["--rt", "pipeline", "--profile", "no-ray-tracing"]].map(|args| {
        let desk = Desk::new();
        desk.run(&[&["--frames", "1"], args].concat()).assert_success();
        image::open(desk.output_path()).unwrap().into_rgba8()
    });
    let difference = metrics::compare(&lowered, &default, WIDTH, HEIGHT).unwrap();
    assert!(difference.psnr >= 60.0, "{difference}");
}

/// The phone takes the courtyard in parts only, and the picture is made all the same.
#[test]
fn a_scene_too_large_for_the_profile_is_split_and_reported() {
    if !has_device() {
        return;
    }
    let desk = Desk::new();
    let outcome = desk.run(&["--profile", "mali-g715", "--frames", "1", "--validate"]);
    outcome.assert_success();
    let told = ["profile   mali-g715", "courtyard: 276930 triangles", "validation messages: 0"];
    assert_names(&outcome.out, &told);
    // 95,700 triangles are the 256 MiB of scratch that the phone takes.
    let parts = outcome.out.split_once("2 BLAS, split into ").and_then(|(_, rest)| rest.split_once(" parts"));
    let parts: u32 = parts.and_then(|(number, _)| number.parse().ok()).unwrap_or_default();
    assert!(parts >= 4, "{}", outcome.out);
    assert_eq!(desk.image_size(), (WIDTH, HEIGHT));
}
