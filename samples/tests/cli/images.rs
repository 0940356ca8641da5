//! Scenes that the program reads and images that it writes.

use std::fs;
use std::path::Path;

use crate::program::{
    Desk, HEIGHT, Outcome, TRIANGLE, WIDTH, assert_names, desk_with_device, has_device, hybrid,
};

#[test]
fn a_scene_that_cannot_be_loaded_is_named_and_leaves_nothing() {
    let desk = Desk::new();
    let absent = desk.input.path().join("absent.obj").display().to_string();
    let folder = desk.input.path().display().to_string();
    for (path, parts) in [
        (absent, ["absent.obj", "no such file"]),
        (folder, ["cannot read", "directory"]),
        (desk.file("letter.obj", "Dear Sir or Madam,\n"), ["letter.obj", "not a Wavefront OBJ"]),
        (desk.file("binary.obj", [0x89, b'P', 0, 1, 2, 3, 255, 254]), ["binary.obj", "not a Wavefront OBJ"]),
        (desk.file("nothing.obj", ""), ["nothing.obj", "not a Wavefront OBJ"]),
        (desk.file("points.obj", "v 0 0 0\nv 1 0 0\n"), ["points.obj", "nothing to draw"]),
        (desk.file("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), ["line.obj", "nothing to draw"]),
        (desk.file("nan.obj", format!("{TRIANGLE}v 0 nan 0\nf 1 2 4\n")), ["nan.obj:5", "not finite"]),
        (desk.file("word.obj", format!("{TRIANGLE}v 0 zero 0\n")), ["word.obj:5", "zero"]),
        (desk.file("range.obj", format!("{TRIANGLE}f 1 2 4\n")), ["range.obj:5", "vertex 4"]),
        (desk.file("back.obj", format!("{TRIANGLE}f -1 -2 -4\n")), ["back.obj:5", "vertex -4"]),
    ] {
        desk.run(&["--scene", &path]).assert_error(2, &parts);
    }
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn a_bad_camera_file_is_named_and_leaves_nothing() {
    let desk = Desk::new();
    let scene = desk.file("triangle.obj", TRIANGLE);
    let absent = desk.input.path().join("absent.txt").display().to_string();
    for (path, parts) in [
        (absent, ["absent.txt", "no such file"]),
        (desk.file("short.txt", "scene a 0 1 2\nat 1 2 3\n"), ["short.txt:2", "expected"]),
        (desk.file("empty.txt", ""), ["empty.txt", "expected"]),
        (desk.file("word.txt", "scene a 0 1 two\n"), ["word.txt:1", "expected"]),
    ] {
        desk.run(&["--scene", &scene, "--cameras", &path]).assert_error(2, &parts);
    }
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn an_image_that_cannot_be_written_is_refused_before_any_work() {
    let desk = Desk::new();
    let absent = desk.input.path().join("absent.obj");
    for place in [desk.output.path().join("no/such/folder.png"), desk.output.path().to_path_buf()] {
        let mut command = hybrid(&["--scene", &absent.display().to_string()]);
        command.arg("--out").arg(&place);
        Outcome::from_command(command).assert_error(2, &[&place.display().to_string()]);
    }
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn an_image_never_replaces_what_is_read() {
    let desk = Desk::new();
    let scene = desk.file("scene.png", TRIANGLE);
    let cameras = desk.file("cameras.png", "scene a 0 1 2\n");
    let detour = |name: &str| desk.input.path().join(".").join(name).display().to_string();
    for (out, option) in [(&scene, "--scene"), (&detour("scene.png"), "--scene"), (&cameras, "--cameras")] {
        let outcome =
            Outcome::from_command(hybrid(&["--scene", &scene, "--cameras", &cameras, "--out", out]));
        outcome.assert_error(2, &["--out", option, "same file"]);
    }
    assert_eq!(fs::read_to_string(scene).unwrap(), TRIANGLE);
    assert_eq!(fs::read_to_string(cameras).unwrap(), "scene a 0 1 2\n");
}

#[test]
fn caches_are_kept_dropped_when_damaged_and_never_needed() {
    if !has_device() {
        return;
    }
    let desk = Desk::new();
    let (scene, cache) = (desk.file("triangle.obj", TRIANGLE), desk.input.path().join("kept"));
    let run = |cache: &Path, more: &[&str]| {
        let mut command = desk.command(&[&["--scene", scene.as_str(), "--rt", "software"], more].concat());
        command.env("LVK_CACHE", cache);
        let outcome = Outcome::from_command(command);
        outcome.assert_success();
        (fs::read(desk.output_path()).unwrap(), outcome.err)
    };
    let (picture, _) = run(&cache, &["--no-cache"]);
    assert!(!cache.exists(), "nothing is kept unasked");
    let files = |name: &str| fs::read_dir(cache.join(name)).map_or(0, Iterator::count);
    assert_eq!(run(&cache, &[]).0, picture);
    assert!(cache.join("hybrid.pipelines").is_file() && files("shaders") > 0 && files("trees") > 0);
    let (warm, said) = run(&cache, &[]);
    assert_eq!((warm, said.contains("warning")), (picture.clone(), false), "{said}");
    fs::write(cache.join("hybrid.pipelines"), "nonsense").unwrap();
    let (mended, said) = run(&cache, &[]);
    assert_eq!(mended, picture);
    assert_names(&said, &["warning: the pipeline cache", "hybrid.pipelines", "dropped"]);
    let (without, said) = run(&Path::new(&scene).join("below a file"), &[]);
    assert_eq!(without, picture);
    assert_names(&said, &["warning: nothing is kept for the next start", "below a file"]);
}

#[test]
fn an_image_that_is_not_named_as_a_png_is_refused() {
    let desk = Desk::new();
    for name in ["picture.jpg", "picture", "png"] {
        let out = desk.output.path().join(name).display().to_string();
        Outcome::from_command(hybrid(&["--out", &out]))
            .assert_error(2, &[name, "the picture is a PNG", ".png"]);
    }
    // These names pass, so the scene is what is wrong.
    let scene = desk.file("nothing.obj", "");
    for out in [desk.output.path().join("PICTURE.PNG").display().to_string(), "/dev/null".to_owned()] {
        Outcome::from_command(hybrid(&["--scene", &scene, "--out", &out])).assert_error(2, &["nothing.obj"]);
    }
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn an_earlier_image_survives_an_error() {
    let desk = Desk::new();
    fs::write(desk.output_path(), "earlier").unwrap();
    desk.run(&["--scene", &desk.file("nothing.obj", "")]).assert_error(2, &["nothing.obj"]);
    assert_eq!(fs::read(desk.output_path()).unwrap(), b"earlier");
    assert_eq!(desk.output_files(), ["picture.png"]);
}

#[test]
fn every_method_writes_the_image_and_reports_its_times() {
    if !has_device() {
        return;
    }
    let files = Desk::new();
    let scene = files.file("triangle.obj", TRIANGLE);
    for (method, said) in [("standalone", "stand-alone"), ("hybrid", "hybrid:")] {
        for (rt, path) in [
            ("hardware", "ray tracing pipeline"),
            ("pipeline", "ray tracing pipeline"),
            ("query", "ray queries"),
        ] {
            let desk = Desk::new();
            let args = ["--scene", &scene, "--method", method, "--rt", rt, "--frames", "2", "--validate"];
            let outcome = desk.run(&args);
            outcome.assert_success();
            let lowered = "note: --rt pipeline takes a ray tracing pipeline, lowered to ";
            let is_told =
                rt == "pipeline" && outcome.err.starts_with(lowered) && outcome.err.lines().count() == 1;
            assert!(is_told || outcome.err.is_empty(), "{method} {rt}: {}", outcome.err);
            assert_names(&outcome.out, &["device  ", said, path, "1 triangles", "validation messages: 0"]);
            assert_table(&outcome.out, method == "hybrid");
            assert_names(&outcome.out, &["wrote ", &desk.output_path().display().to_string()]);
            assert_eq!(desk.image_size(), (WIDTH, HEIGHT));
        }
    }
}

/// The table of GPU milliseconds: a head, then rows whose numbers grow from minimum to maximum.
fn assert_table(out: &str, has_geometry_pass: bool) {
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let mut lines = out.lines().skip_while(|line| !line.starts_with("GPU ms"));
    assert_eq!(words(lines.next().unwrap()), ["GPU", "ms", "min", "median", "max"], "{out}");
    let rows: Vec<_> = lines.take_while(|line| !line.starts_with("wrote")).map(words).collect();
    assert_eq!(rows.len(), if has_geometry_pass { 3 } else { 2 }, "{out}");
    assert_eq!(rows.last().unwrap()[0], "total", "{out}");
    for row in rows {
        let numbers: Vec<f64> = row[row.len() - 3..].iter().map(|word| word.parse().unwrap()).collect();
        assert!(numbers.is_sorted() && numbers[2] > 0.0, "{out}");
    }
}

#[test]
fn missing_textures_and_materials_are_warnings_with_names() {
    if !has_device() {
        return;
    }
    let desk = Desk::new();
    desk.file("a.mtl", "newmtl wood\nKd 1 1 1\nmap_Kd absent.png\n");
    let text = format!("mtllib a.mtl\nusemtl wood\n{TRIANGLE}usemtl nowhere\nf 1 3 2\n");
    let outcome = desk.run(&["--scene", &desk.file("a.obj", text)]);
    outcome.assert_success();
    let warnings = outcome.err.lines().filter(|line| !line.starts_with("note: --rt auto takes "));
    assert_eq!(warnings.clone().count(), 2, "{}", outcome.err);
    assert!(warnings.clone().all(|line| line.starts_with("warning: ")), "{}", outcome.err);
    assert_names(&outcome.err, &["absent.png", "no such file", "`nowhere` is not defined"]);
    assert_eq!(desk.image_size(), (WIDTH, HEIGHT));
}

/// `hybrid | head -1` must not keep the picture from being written.
#[test]
fn a_closed_pipe_does_not_cost_the_image() {
    let Some((desk, scene)) = desk_with_device() else { return };
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut command = desk.command(&["--scene", &scene]);
    let status = command.stdout(writer).status().unwrap();
    assert_eq!(status.code(), Some(0));
    assert_eq!(desk.image_size(), (WIDTH, HEIGHT));
}
