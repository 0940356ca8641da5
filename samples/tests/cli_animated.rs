//! The animated programs as a user meets them: help, pictures, sequences and Ctrl-C.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod missing_features;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use lvk_dev_driver::{DriverRequest, prepare_unless_skipped};

/// A program, and the arguments that make it quick.
struct Program {
    path: &'static str,
    quick: &'static [&'static str],
    /// Options in the program's help besides those of all samples.
    own: &'static [&'static str],
    /// Text that the program prints about the image.
    said: &'static [&'static str],
    /// Arguments for each way to draw it.
    ways: &'static [&'static [&'static str]],
}

/// The ways of samples that trace rays.
const RAYS: &[&[&str]] = &[&["--rt", "pipeline"], &["--rt", "query"]];

const PROGRAMS: &[Program] = &[
    Program {
        path: env!("CARGO_BIN_EXE_reflections"),
        quick: &["--samples", "1"],
        own: &["--samples", "--min-angle", "--compare-culling"],
        said: &["g-buffers, then reflected rays", "instances kept", "opaque rays", "transparent rays"],
        ways: RAYS,
    },
    Program {
        path: env!("CARGO_BIN_EXE_hybrid_oit"),
        quick: &["--supersampling", "1", "--shadow-rays", "1"],
        own: &["--supersampling", "--shadow-rays", "--nodes", "--time"],
        said: &["list of glass", "spheres of glass", "composite", "nodes"],
        ways: RAYS,
    },
    Program {
        path: env!("CARGO_BIN_EXE_large_scene"),
        quick: &["--triangles", "4000", "--copies", "20", "--samples", "1"],
        own: &[
            "--triangles",
            "--copies",
            "--layout",
            "--scene",
            "--archive",
            "--camera",
            "--show",
            "--no-compaction",
        ],
        said: &[
            "valley",
            "with all instances",
            "instances 21",
            "5 built",
            "structures 5 in ",
            "compacted from",
            "rays",
        ],
        ways: RAYS,
    },
    Program {
        path: env!("CARGO_BIN_EXE_sponza"),
        quick: &["--shadow-size", "256"],
        own: &["--msaa", "--no-culling", "--draws", "--shadow-size", "--filter", "--scene", "--camera"],
        said: &["atrium: ", "draws  ", "culling", "shadow map", "surfaces", "draws in the picture"],
        ways: &[&["--msaa", "1"], &["--draws", "padded"]],
    },
    Program {
        path: env!("CARGO_BIN_EXE_rtx_ao"),
        quick: &["--passes", "1", "--rays", "1"],
        own: &["--passes", "--rays", "--radius", "--scene", "--camera"],
        said: &["town: 14962 triangles", "depth", "surfaces", "cache"],
        ways: RAYS,
    },
    Program {
        path: env!("CARGO_BIN_EXE_rtx_hello"),
        quick: &[],
        own: &["--list-scenes"],
        said: &["37 triangles", "TLAS update", "rays"],
        ways: RAYS,
    },
    Program {
        path: env!("CARGO_BIN_EXE_rtx_pipeline"),
        quick: &["--depth", "1"],
        own: &["--depth", "--scene", "--camera"],
        said: &["courtyard: ", "rays mirrored 1 times at most", "rays"],
        ways: RAYS,
    },
    Program {
        path: env!("CARGO_BIN_EXE_rtx_textures"),
        quick: &[],
        own: &["--list-scenes"],
        said: &["170 instances", "6 textures", "TLAS build", "rays"],
        ways: RAYS,
    },
    Program {
        path: env!("CARGO_BIN_EXE_omni_shadows"),
        quick: &["--shadow-size", "64"],
        own: &["--faces", "--filter", "--shadow-size", "--lamp-radius", "--haze", "--show-cube"],
        said: &["a lamp in a lattice", "cube of 64 texels", "shadow cube", "surfaces"],
        ways: &[&[], &["--faces", "single", "--show-cube"]],
    },
    Program {
        path: env!("CARGO_BIN_EXE_yuv"),
        quick: &[],
        own: &["--format", "--model", "--range", "--show-planes"],
        said: &["a moving picture of 640x360", "the device has [Nv12, I420", "picture"],
        ways: &[&[], &["--format", "i420", "--model", "bt601", "--range", "full", "--show-planes"]],
    },
    Program {
        path: env!("CARGO_BIN_EXE_deferred"),
        quick: &["--lights", "40"],
        own: &["--passes", "--lights", "--view"],
        said: &["40 lights", "triangles"],
        ways: &[&[], &["--passes", "several"]],
    },
    Program {
        path: env!("CARGO_BIN_EXE_hello_triangle"),
        quick: &[],
        own: &[],
        said: &["a turning triangle", "triangle"],
        ways: &[&[]],
    },
    Program {
        path: env!("CARGO_BIN_EXE_render_to_cube_map"),
        quick: &["--face-size", "32"],
        own: &["--faces", "--face-size", "--roughness"],
        said: &["48 blocks", "6 x 32 x 32", "cube map", "picture"],
        ways: &[&["--faces", "six-passes"], &["--faces", "one-pass"]],
    },
    Program {
        path: MESH_SHADERS,
        quick: &[],
        own: &["--no-culling"],
        said: &["a knot of 61600 triangles", "of 655 meshlets drawn", "meshlets  "],
        ways: &[&[], &["--no-culling"]],
    },
    Program {
        path: env!("CARGO_BIN_EXE_triplanar"),
        quick: &[],
        own: &["--unload"],
        said: &["7 textures", "of them unloaded", "bodies  "],
        ways: &[&[], &["--unload", "brick,leaves"]],
    },
];

/// The sample that has tests of its own (`cli`), for those of all samples.
const HYBRID: Program = Program {
    path: env!("CARGO_BIN_EXE_hybrid"),
    quick: &["--samples", "1"],
    own: &[],
    said: &[],
    ways: RAYS,
};

/// The one program that cannot do without something that devices lack.
const MESH_SHADERS: &str = env!("CARGO_BIN_EXE_mesh_shaders");

const SHARED: [&str; 15] = [
    "--frames",
    "--round",
    "--resume",
    "--width",
    "--height",
    "--out",
    "--device",
    "--profile",
    "--list-devices",
    "--validate",
    "--check-indices",
    "--no-cache",
    "Examples:",
    "Exit status: 0",
    "130 after Ctrl-C",
];

const SIZE: [u32; 2] = [48, 27];

struct Outcome {
    status: Option<i32>,
    out: String,
    err: String,
}

impl Program {
    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(self.path);
        command.args(args).env_remove("LVK_DEVICE").env("LVK_CACHE", "");
        command
    }

    /// The program with small pictures in `folder`.
    fn small(&self, folder: &Path, name: &str, args: &[&str]) -> Command {
        let mut command = self.command(args);
        command.args(self.quick).args(["--width", &SIZE[0].to_string(), "--height", &SIZE[1].to_string()]);
        command.arg("--out").arg(folder.join(name));
        command
    }
}

impl Outcome {
    fn from_command(mut command: Command) -> Self {
        let Output { status, stdout, stderr } = command.output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Self { status: status.code(), out: text(stdout), err: text(stderr) }
    }

    fn assert_success(&self) {
        assert_eq!(self.status, Some(0), "{}{}", self.out, self.err);
    }
}

fn assert_names(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no `{part}` in: {text}");
    }
}

/// True if a device was found. Returns false and prints a line without a device, if `LVK_SKIP_GPU_TESTS` allows that.
fn has_device() -> bool {
    prepare_unless_skipped(&DriverRequest { validation: true, quick_compilation: true }).unwrap()
}

/// The programs that the device is enough for; says of the other that it is not tested.
fn possible() -> impl Iterator<Item = &'static Program> {
    let folder = tempfile::tempdir().unwrap();
    let lacks = |program: &&Program| {
        let picture = program.small(folder.path(), "a.png", &["--frames", "1"]);
        let lack = (program.path == MESH_SHADERS).then(|| missing_features::mesh_shaders(picture)).flatten();
        lack.inspect(|lack| eprintln!("NOT TESTED, {lack}")).is_some()
    };
    let all: Vec<_> = PROGRAMS.iter().filter(|program| !lacks(program)).collect();
    all.into_iter()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn the_help_teaches() {
    for program in PROGRAMS {
        let help = Outcome::from_command(program.command(&["--help"]));
        help.assert_success();
        assert_names(&help.out, &SHARED);
        assert_names(&help.out, program.own);
        assert_eq!(help.out.contains("--rt "), program.ways == RAYS, "{}", help.out);
    }
}

#[test]
fn wrong_arguments_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for program in PROGRAMS {
        for (line, part) in [("--frames 3..3", "--frames"), ("--width 0", "--width"), ("x", "Usage")] {
            let mut command = program.command(&line.split(' ').collect::<Vec<_>>());
            command.current_dir(folder.path());
            let outcome = Outcome::from_command(command);
            assert_eq!(outcome.status, Some(2), "{}", outcome.err);
            assert_names(&outcome.err, &["error: ", part]);
        }
        let unnumbered = Outcome::from_command(program.small(folder.path(), "a.png", &["--frames", "0..2"]));
        assert_eq!(unnumbered.status, Some(2), "{}", unnumbered.err);
    }
    assert!(files(folder.path()).is_empty());
}

#[test]
fn every_method_writes_an_image_under_validation() {
    if !has_device() {
        return;
    }
    for program in possible() {
        for way in program.ways {
            let folder = tempfile::tempdir().unwrap();
            let args = [&["--frames", "1", "--validate"], *way].concat();
            let outcome = Outcome::from_command(program.small(folder.path(), "a.png", &args));
            outcome.assert_success();
            assert_names(&outcome.out, &["device  ", "GPU ms", "total", "validation messages: 0", "wrote "]);
            assert_names(&outcome.out, program.said);
            let [picture] = &files(folder.path())[..] else { panic!("one picture") };
            assert_eq!(image::open(picture).unwrap().into_rgba8().dimensions(), SIZE.into());
        }
    }
}

#[test]
#[ignore = "minutes: .ci/slow indices"]
fn every_method_uses_live_and_declared_objects() {
    for program in possible().chain([&HYBRID]) {
        for way in program.ways {
            let folder = tempfile::tempdir().unwrap();
            let args = [&["--frames", "1", "--check-indices"], *way].concat();
            let outcome = Outcome::from_command(program.small(folder.path(), "a.png", &args));
            outcome.assert_success();
            assert_names(&outcome.out, &["index faults: 0"]);
        }
    }
}

/// The condition for which the other tests skip a program.
#[test]
fn a_device_without_mesh_shaders_is_distinguished_from_other_errors() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let program = PROGRAMS.iter().find(|program| program.path == MESH_SHADERS).unwrap();
    let small = |args: &[&str]| program.small(folder.path(), "a.png", args);
    let without = ["--frames", "1", "--profile", "core-only"];
    let outcome = Outcome::from_command(small(&without));
    assert_eq!(outcome.status, Some(1), "{}", outcome.err);
    let lack = missing_features::mesh_shaders(small(&without)).unwrap();
    assert_names(&lack, &["mesh shaders", "--device"]);
    assert!(files(folder.path()).is_empty());
    assert_eq!(missing_features::mesh_shaders(small(&["--frames", "1", "--device", "no such device"])), None);
}

#[test]
fn the_gain_of_culling_is_printed() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let outcome = Outcome::from_command(PROGRAMS[0].small(folder.path(), "a.png", &["--compare-culling"]));
    outcome.assert_success();
    assert_names(&outcome.out, &["culling   ", "TLAS build ", " ms instead of ", "rays of a sample "]);
}

/// Frame 3 of a round of three is frame 0, and ranges of two processes make the files of one.
#[test]
fn sequences_repeat_and_can_be_shared_among_processes() {
    if !has_device() {
        return;
    }
    for program in possible() {
        let (whole, parts) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let play = |folder: &Path, frames: &str| {
            let args = ["--round", "3", "--frames", frames];
            Outcome::from_command(program.small(folder, "frame_##.png", &args)).assert_success();
        };
        play(whole.path(), "0..4");
        play(parts.path(), "2..4");
        play(parts.path(), "0..2");
        let read = |folder: &Path| -> Vec<Vec<u8>> {
            files(folder).iter().map(|file| std::fs::read(file).unwrap()).collect()
        };
        let (whole, parts) = (read(whole.path()), read(parts.path()));
        assert_eq!(whole.len(), 4);
        assert!(whole == parts, "{}: a frame depends on the range it is in", program.path);
        assert!(whole[0] == whole[3], "{}: a round has a seam", program.path);
        assert!(whole[0] != whole[1] && whole[1] != whole[2], "{}: nothing moves", program.path);
    }
}

#[test]
fn ctrl_c_leaves_whole_images_that_can_be_resumed() {
    if !has_device() {
        return;
    }
    for program in possible() {
        let folder = tempfile::tempdir().unwrap();
        let mut command = program.small(folder.path(), "frame_######.png", &["--frames", "0..1000000"]);
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let start = Instant::now();
        while files(folder.path()).len() < 2 {
            assert!(start.elapsed() < Duration::from_secs(300), "{}: no pictures", program.path);
            std::thread::sleep(Duration::from_millis(20));
        }
        let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let output = child.wait_with_output().unwrap();
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(130), "{err}");
        assert_names(&err, &["of 1000000 frames", "--resume"]);
        let written = files(folder.path());
        for file in &written {
            assert_eq!(
                image::open(file).unwrap().into_rgba8().dimensions(),
                SIZE.into(),
                "{}",
                file.display()
            );
        }
        let range = format!("0..{}", written.len() + 1);
        let resumed = Outcome::from_command(program.small(
            folder.path(),
            "frame_######.png",
            &["--resume", "--frames", &range],
        ));
        resumed.assert_success();
        assert_names(&resumed.out, &["wrote 1 frames", &format!("{} were there", written.len())]);
    }
}

/// Two OBJ files along a street: built by the first start, loaded by the second, and again what is damaged.
#[test]
fn accel_structs_are_kept_from_one_start_to_the_next() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    for name in ["wedge.obj", "other.obj"] {
        std::fs::write(
            folder.path().join(name),
            text.replace("0 1 0", if name == "other.obj" { "0 2 0" } else { "0 1 0" }),
        )
        .unwrap();
    }
    let program =
        Program { path: env!("CARGO_BIN_EXE_large_scene"), quick: &[], own: &[], said: &[], ways: RAYS };
    let start = |expected: &str| {
        let mut command = program.small(folder.path(), "a.png", &["--archive", "--copies", "3"]);
        command.env("LVK_CACHE", folder.path().join("cache")).env("LVK_SCENES", folder.path());
        let outcome = Outcome::from_command(command);
        outcome.assert_success();
        assert_names(&outcome.out, &["instances 7", expected]);
        assert_names(&outcome.err, &[" s] uploading the scene", " s] loading acceleration structures"]);
        outcome.err
    };
    start("0 from files, 3 built, 0 built anew");
    start("3 from files, 0 built, 0 built anew");
    let kept = files(&folder.path().join("cache/structures"));
    std::fs::write(&kept[0], "damaged").unwrap();
    let err = start("2 from files, 0 built, 1 built anew");
    assert_names(&err, &["warning: the structure", "is dropped", &kept[0].display().to_string()]);
    start("3 from files, 0 built, 0 built anew");
}

#[test]
fn scenes_that_are_not_there_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let program =
        Program { path: env!("CARGO_BIN_EXE_large_scene"), quick: &[], own: &[], said: &[], ways: RAYS };
    let empty = folder.path().display().to_string();
    for (args, part) in [
        (&["--scene", "nowhere.obj"][..], "no such file"),
        (&["--archive", &empty][..], "no OBJ file in"),
        (&["--archive"][..], "LVK_SCENES"),
        (&["--layout", "combined", "--triangles", "400000", "--copies", "2000"][..], "--layout instanced"),
    ] {
        let mut command = program.small(folder.path(), "a.png", args);
        command.env_remove("LVK_SCENES");
        let outcome = Outcome::from_command(command);
        assert_eq!(outcome.status, Some(2), "{args:?}: {}", outcome.err);
        assert_names(&outcome.err, &[part]);
    }
}
