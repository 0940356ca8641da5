//! `.gltf` and `.glb`, with buffers inside and beside them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Mutex;

use lvk_gltf::{Error, LoadOptions, MemoryLimit, Model, Problem, Progress};
use serde_json::json;

use crate::glb::{Glb, load};

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |group: &[u8]| {
        let bits =
            group.iter().chain(&[0; 2]).take(3).fold(0_usize, |bits, byte| bits << 8 | usize::from(*byte));
        let digit = |place: usize| {
            if place > group.len() { '=' } else { DIGITS[bits >> (18 - 6 * place) & 63].into() }
        };
        (0..4).map(digit).collect::<String>()
    };
    bytes.chunks(3).map(group).collect()
}

fn load_file(path: &Path) -> Result<Model, Error> {
    Model::load(path, &LoadOptions::default())
}

#[test]
fn all_forms_of_a_file_give_the_same_model() {
    let glb = Glb::triangle();
    let wanted = glb.load_cleanly();
    assert_eq!(wanted.meshes[0].primitives[0].vertex_count(), 3);
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    write("tri angle.bin", &glb.bin);
    let data = format!("data:application/octet-stream;base64,{}", base64(&glb.bin));
    let percent: String = glb.bin.iter().map(|byte| format!("%{byte:02x}")).collect();
    let plain = format!("data:,{percent}");
    for path in [
        write("triangle.glb", &glb.to_glb()),
        write("embedded.gltf", glb.to_gltf(&data).as_bytes()),
        write("percent.gltf", glb.to_gltf(&plain).as_bytes()),
        write("external.gltf", glb.to_gltf("tri%20angle.bin").as_bytes()),
        write("wrong_name.gltf", &glb.to_glb()),
    ] {
        assert_eq!(load_file(&path).unwrap(), wanted, "{}", path.display());
    }
}

/// A strip of so many vertices that a file of them is read in several parts: interleaved, and some of them replaced.
fn large() -> Glb {
    const COUNT: usize = 60_000;
    Glb::with_primitive(|glb| {
        let place = |vertex: usize| [vertex as f32, (vertex % 2) as f32, 0.25 * vertex as f32];
        let interleaved: Vec<[f32; 6]> = (0..COUNT)
            .map(|vertex| {
                let [x, y, z] = place(vertex);
                [x, y, z, 0.6, 0.0, 0.8]
            })
            .collect();
        let view = glb.view(bytemuck::cast_slice(interleaved.as_flattened()));
        glb.json["bufferViews"][view]["byteStride"] = json!(24);
        let replaced: Vec<u32> = (0..COUNT as u32).step_by(3).collect();
        let indices = glb.view(bytemuck::cast_slice(&replaced));
        let values: Vec<[f32; 3]> = replaced.iter().map(|vertex| [-(*vertex as f32), 1.0, 2.0]).collect();
        let values = glb.view(bytemuck::cast_slice(values.as_flattened()));
        let sparse = json!({ "count": replaced.len(), "indices": { "bufferView": indices, "componentType": 5125 },
                             "values": { "bufferView": values } });
        let accessor = json!({ "bufferView": view, "componentType": 5126, "type": "VEC3", "count": COUNT });
        let mut positions = accessor.clone();
        positions["sparse"] = sparse;
        let positions = glb.push("accessors", positions);
        let mut normals = accessor;
        normals["byteOffset"] = json!(12);
        let normals = glb.push("accessors", normals);
        json!({ "attributes": { "POSITION": positions, "NORMAL": normals }, "mode": 5 })
    })
}

#[test]
fn a_large_file_is_read_in_parts_as_its_bytes_are() {
    let glb = large();
    let wanted = glb.load_cleanly();
    let positions = &wanted.meshes[0].primitives[0].positions;
    assert_eq!(positions.get(59_998), Some([59_998.0, 0.0, 14_999.5]));
    assert_eq!(positions.get(59_997), Some([-59_997.0, 1.0, 2.0]));
    let folder = tempfile::tempdir().unwrap();
    let (path, bytes) = (folder.path().join("large.glb"), glb.to_glb());
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(load_file(&path).unwrap(), wanted);
    std::fs::write(folder.path().join("large.bin"), &glb.bin).unwrap();
    let external = folder.path().join("large.gltf");
    std::fs::write(&external, glb.to_gltf("large.bin")).unwrap();
    assert_eq!(load_file(&external).unwrap(), wanted);
    for length in [13, 500, bytes.len() / 2, bytes.len() - 1] {
        std::fs::write(&path, &bytes[..length]).unwrap();
        let (of_file, of_bytes) = (load_file(&path).unwrap_err(), load(&bytes[..length]).unwrap_err());
        assert_eq!(of_file.problem.to_string(), of_bytes.to_string());
    }
}

#[test]
fn errors_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.gltf");
    std::fs::write(&path, Glb::triangle().to_gltf("missing.bin")).unwrap();
    let message = load_file(&path).unwrap_err().to_string();
    assert!(message.contains("broken.gltf: cannot read"), "{message}");
    assert!(message.contains("missing.bin, which is buffer 0"), "{message}");
    let error = load_file(&folder.path().join("nothing.glb")).unwrap_err();
    assert!(matches!(error.problem, Problem::File { .. }), "{error}");
    assert!(matches!(load_file(folder.path()).unwrap_err().problem, Problem::File { .. }));
}

#[test]
fn files_outside_of_the_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    let glb = Glb::triangle();
    std::fs::write(folder.path().join("secret.bin"), &glb.bin).unwrap();
    for uri in
        ["../secret.bin", "%2e%2e/secret.bin", "/secret.bin", "file:secret.bin", "http://host/secret.bin"]
    {
        let path = inner.join("model.gltf");
        std::fs::write(&path, glb.to_gltf(uri)).unwrap();
        let error = load_file(&path).unwrap_err();
        assert!(matches!(&error.problem, Problem::Uri { uri: found, .. } if found == uri), "{error}");
    }
    let error = load(glb.to_gltf("secret.bin").as_bytes()).unwrap_err();
    assert!(matches!(error, Problem::Uri { .. }), "{error}");
}

#[test]
#[cfg(unix)]
fn a_named_pipe_is_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let made = std::process::Command::new("mkfifo").arg(folder.path().join("pipe.bin")).status();
    assert!(made.unwrap().success());
    let path = folder.path().join("model.gltf");
    std::fs::write(&path, Glb::triangle().to_gltf("pipe.bin")).unwrap();
    let message = load_file(&path).unwrap_err().to_string();
    assert!(message.contains("not a regular file"), "{message}");
}

#[test]
fn cut_files_and_other_formats_are_refused() {
    let bytes = Glb::triangle().to_glb();
    for length in 0..bytes.len() {
        assert!(load(&bytes[..length]).is_err(), "{length}");
    }
    assert!(matches!(load(&bytes[..bytes.len() - 1]), Err(Problem::Container { .. })));
    assert!(matches!(load(b"mtllib x.mtl\n"), Err(Problem::NotGltf)));
    assert!(matches!(load(br#"{"asset":{"version":"1.0"}}"#), Err(Problem::Version { .. })));
    assert!(matches!(
        load(br#"{"asset":{"version":"2.0","minVersion":"2.1"}}"#),
        Err(Problem::Version { .. })
    ));
    assert!(matches!(load(b"{}"), Err(Problem::Version { .. })));
    assert!(matches!(load(b"{\"asset\":"), Err(Problem::Json { .. })));
    let mut short = Glb::triangle();
    short.json["buffers"] = json!([{ "byteLength": 1000 }]);
    short.expect_problem(&["buffer 0 ends at byte 1000 of its data, which has 36", "cut off"]);
    let mut lone = Glb::new();
    lone.json["buffers"] = json!([{ "byteLength": 4 }]);
    lone.expect_problem(&["buffer 0", "neither a URI nor the data of a GLB"]);
}

#[test]
fn an_empty_file_is_an_empty_model() {
    let model = Glb::new().load_cleanly();
    assert_eq!(model, Model::default());
}

#[test]
fn memory_has_a_bound() {
    let mut glb = Glb::triangle();
    let options =
        LoadOptions { memory: MemoryLimit { fixed_bytes: 1000, multiple: 1 }, ..LoadOptions::default() };
    let error = Model::from_bytes(&glb.to_glb(), None, &options).unwrap_err();
    assert!(matches!(error.problem, Problem::Memory { .. }), "{error}");
    // An accessor without a buffer view takes no byte of the file.
    let sparse = json!({ "count": 1, "indices": { "bufferView": 0, "componentType": 5125 }, "values": { "bufferView": 0 } });
    glb.json["accessors"][0] =
        json!({ "componentType": 5126, "type": "VEC3", "count": 4_000_000_000_u32, "sparse": sparse });
    let problem = glb.expect_problem(&["mesh 0 'Body', primitive 0, accessor 0", "48000000000 bytes"]);
    assert!(matches!(problem, Problem::Memory { .. }));
}

#[test]
fn progress_tells_of_meshes_and_images_and_stops_the_load() {
    let bytes = Glb::triangle().to_glb();
    let steps = Mutex::new(Vec::new());
    let record = |progress: Progress| {
        steps.lock().unwrap().push((progress.step, progress.total));
        ControlFlow::Break(())
    };
    let options = LoadOptions { on_progress: Some(&record), ..LoadOptions::default() };
    let error = Model::from_bytes(&bytes, None, &options).unwrap_err();
    assert!(matches!(error.problem, Problem::Stopped));
    assert_eq!(*steps.lock().unwrap(), [("meshes", 1)]);
}

#[test]
fn unknown_extensions_are_warned_of_and_refused_if_they_are_required() {
    let mut glb = Glb::triangle();
    glb.uses("VENDOR_magic");
    assert_eq!(glb.warnings(), ["the extension VENDOR_magic is ignored"]);
    glb.push("extensionsRequired", json!("VENDOR_magic"));
    let problem = glb.expect_problem(&["requires the extension VENDOR_magic, which is not supported"]);
    assert!(matches!(problem, Problem::RequiredExtension { .. }));
    let mut draco = Glb::triangle();
    draco.push("extensionsRequired", json!("KHR_draco_mesh_compression"));
    draco.expect_problem(&["KHR_draco_mesh_compression", "EXT_meshopt_compression"]);
}
