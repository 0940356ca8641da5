//! Tests of texts: includes, the lines in errors, and debug information.

use ::spirv::Op;

use std::path::Path;

use super::*;

#[test]
fn errors_carry_the_callers_lines() {
    let plain = error(ShaderStage::Compute, "void main() {\n    int a = 1;\n    foo = 2;\n}");
    assert!(plain.starts_with("line 3: 'foo' : undeclared identifier"), "{plain}");
    assert!(!plain.contains("ERROR") && !plain.contains("compilation"), "{plain}");
    let versioned =
        error(ShaderStage::Fragment, "// é\r\n#version 460 core\r\nvoid main() {\r\n    foo = 2;\r\n}");
    assert!(versioned.starts_with("line 4: 'foo'"), "{versioned}");
    let ray_gen = error(ShaderStage::RayGen, "void main() { foo = 2; }");
    assert!(ray_gen.starts_with("line 1: 'foo'"), "{ray_gen}");
    let late = error(ShaderStage::Compute, "int a;\n#version 460\nvoid main() {}");
    assert!(late.starts_with("line 2: "), "{late}");
}

#[test]
fn errors_in_included_files_name_file_and_line() {
    let includes =
        [("brdf/a.glsl", "// first\n#include \"b.glsl\"\n"), ("brdf/b.glsl", "int ok;\n\nint bad = foo;\n")];
    let text = "\n#include \"brdf/a.glsl\"\nvoid main() { bar = 1; }\n";
    let module = ShaderModuleDesc { includes: &includes, ..desc(ShaderStage::Compute, text) };
    let found = log(build(&module));
    assert!(found.contains("brdf/b.glsl:3: 'foo'"), "{found}");
    let good = [includes[0], ("brdf/b.glsl", "int ok;")];
    let found = log(build(&ShaderModuleDesc { includes: &good, ..module }));
    assert!(found.starts_with("line 3: 'bar'"), "{found}");
}

#[test]
fn includes_come_from_beside_the_includer_and_from_the_folders() {
    let dir = std::env::temp_dir().join(format!("lvk-include-{}", std::process::id()));
    std::fs::create_dir_all(dir.join("sub")).unwrap();
    std::fs::write(dir.join("sub/a.glsl"), "#pragma once\n#include \"b.glsl\"\nint a() { return b(); }\n")
        .unwrap();
    std::fs::write(dir.join("sub/b.glsl"), "int b() { return LISTED; }\n").unwrap();
    std::fs::write(dir.join("bad.glsl"), "int x;\nint y = z;\n").unwrap();
    let dirs: [&Path; 1] = [&dir];
    let text = "#include \"sub/a.glsl\"\n#include <sub/a.glsl>\n#include \"listed.glsl\"\nvoid main() { int c = a(); }";
    let includes = [("listed.glsl", "int listed;")];
    let module = ShaderModuleDesc {
        includes: &includes,
        include_dirs: &dirs,
        defines: &[("LISTED", "7")],
        ..desc(ShaderStage::Compute, text)
    };
    let result = build(&module);
    let bad = build(&ShaderModuleDesc {
        source: ShaderSource::Glsl("#include \"bad.glsl\"\nvoid main(){}"),
        ..module
    });
    std::fs::remove_dir_all(&dir).unwrap();
    result.unwrap();
    assert!(log(bad).contains("bad.glsl:2: 'z'"));
}

#[test]
fn debug_info_holds_the_texts_as_written() {
    let text = "// first line\n#include \"one.glsl\"\n#include \"one.glsl\"\nvoid main() { one(); }\n";
    let one = "#pragma once\nvoid one() {}\n";
    let desc = ShaderModuleDesc {
        includes: &[("one.glsl", one)],
        debug_info: true,
        debug_name: "textful",
        ..desc(ShaderStage::Vertex, text)
    };
    let words = build(&desc).unwrap();
    let code: Vec<_> = words::instructions(&words).map(Result::unwrap).collect();
    let sources: Vec<_> = code.iter().filter(|i| i.op == Some(Op::Source)).collect();
    let name = |id: u32| {
        let is_named = |i: &&words::Instruction<'_>| i.op == Some(Op::String) && i.operand(0) == id;
        code.iter().find(is_named).unwrap().string(1).0
    };
    let found: Vec<_> = sources.iter().map(|i| (name(i.operand(2)), i.string(3).0)).collect();
    let owned = |(a, b): (&str, &str)| (a.to_owned(), b.to_owned());
    let once = one.replace("#pragma once", "");
    assert_eq!(found, [owned(("textful", text)), owned(("one.glsl", &once))]);
    assert!(reflect("textful", ShaderStage::Vertex, &words).is_ok());
    let bare = build(&ShaderModuleDesc { debug_info: false, ..desc }).unwrap();
    assert!(bare.len() + text.len() / 4 < words.len());
}

#[test]
fn a_missing_include_names_the_places_and_the_chain() {
    let includes = [("a.glsl", "\n\n#include \"nothing.glsl\"\n")];
    let module = ShaderModuleDesc {
        includes: &includes,
        ..desc(ShaderStage::Compute, "#include \"a.glsl\"\nvoid main() {}")
    };
    let found = log(build(&module));
    assert!(
        found.contains("a.glsl:3: include 'nothing.glsl' not found in the listed includes (a.glsl)"),
        "{found}"
    );
    assert!(found.contains("included by a.glsl"), "{found}");
    let found = error(ShaderStage::Compute, "\n#include <lvk/nothing.glsl>\nvoid main() {}");
    assert!(
        found.starts_with(
            "line 2: the library has no <lvk/nothing.glsl>; it has <lvk/hardware_ray_query.glsl>"
        ),
        "{found}"
    );
    let found = error(ShaderStage::Compute, "#include \"x\"\nvoid main() {}");
    assert_eq!(found, "line 1: include 'x' not found: the module lists no includes and no include_dirs");
    let found = error(ShaderStage::Compute, "\n\n#include <y>\nvoid main() {}");
    assert!(found.starts_with("line 3: include 'y' not found"), "{found}");
}

#[test]
fn include_cycles_end_in_an_error_with_the_chain() {
    let cycle = [("a", "#include \"b\"\n"), ("b", "#include \"a\"\n")];
    let module =
        ShaderModuleDesc { includes: &cycle, ..desc(ShaderStage::Compute, "#include \"a\"\nvoid main() {}") };
    let found = log(build(&module));
    assert!(
        found.contains("'a' includes itself") && found.contains("included by b, included by a"),
        "{found}"
    );
    let guarded = [
        ("a", "#ifndef A\n#define A\n#include \"b\"\n#endif\n"),
        ("b", "#pragma once\n#include \"a\"\nint b;\n"),
    ];
    build(&ShaderModuleDesc { includes: &guarded, ..module }).unwrap();
}

#[test]
fn own_extensions_may_follow_the_preamble() {
    let text = "#version 460\n#extension GL_EXT_ray_query : require\n#extension GL_EXT_fragment_shader_barycentric : enable\n\
                void main() { rayQueryEXT rq; }";
    words(ShaderStage::Fragment, text);
}

#[test]
fn many_threads_compile_at_once() {
    let text = shader(ShaderStage::Compute, "#include <lvk/ray_query.glsl>", QUERY);
    let expected = words(ShaderStage::Compute, &text);
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let (text, expected) = (&text, &expected);
            scope.spawn(move || {
                for round in 0..4 {
                    assert_eq!(&words(ShaderStage::Compute, text), expected, "{thread} {round}");
                    assert!(error(ShaderStage::Miss, "void main() { foo = 1; }").starts_with("line 1"));
                }
            });
        }
    });
}
