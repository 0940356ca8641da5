//! The manual's page `shader_interface` against the preamble, the files of the library, and the compiler.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

use super::glsl_names::{Declared, declared_names, tested_macros};
use super::interface_page::{Entry, Module, column, entries, parameter_name, with_blocks};
use super::*;
use crate::bindless::input_attachments::InputAttachment;
use crate::bindless::layout;
use crate::shader::preamble;

const PAGE: &str = include_str!("../../manual/shader_interface.md");

/// Files that modules include; the others are parts of them.
const FILES: [Option<&str>; 5] = [
    None,
    Some("lvk/ray_query.glsl"),
    Some("lvk/ray_flags.glsl"),
    Some("lvk/tlas.glsl"),
    Some("lvk/hit_remap.glsl"),
];

/// Beginnings of the names of the library's traversal.
const INTERNAL: [&str; 4] = ["lvkSoft", "LvkSoft", "kLvkSoft", "LVK_SOFT_"];

/// Types that parameters and results have.
const TYPES: [&str; 12] =
    ["bool", "int", "uint", "float", "vec2", "vec3", "vec4", "ivec2", "ivec3", "ivec4", "uvec4", "mat4x3"];

fn options(module: &Module) -> CompileOptions {
    let others = module.formatless;
    CompileOptions {
        formatless_read: module.formatless,
        position_fetch: module.position_fetch,
        software_ray_query: module.software,
        helpers_lose_arrays: others,
        is_cpu: others,
        gathers_pairs: others,
    }
}

/// Returns every combination of stage, device and file.
fn all_modules() -> Vec<Module> {
    let mut modules = Vec::new();
    for stage in ShaderStage::ALL {
        for bits in 0..8 {
            let [software, position_fetch, formatless] = [1, 2, 4].map(|bit| bits & bit != 0);
            modules.extend(FILES.map(|file| Module { stage, software, position_fetch, formatless, file }));
        }
    }
    modules
}

fn names_of(module: &Module) -> BTreeMap<String, Declared> {
    let mut text = preamble::preamble(module.stage, &options(module), &[]);
    if let Some(file) = module.file {
        let _ = writeln!(text, "#include <{file}>");
    }
    declared_names(&text)
}

fn is_internal(name: &str, listed: &BTreeSet<&str>) -> bool {
    let is_guard = name.starts_with("LVK_") && name.ends_with("_GLSL");
    is_guard || listed.contains(name) || INTERNAL.iter().any(|start| name.starts_with(start))
}

/// Returns what the page says wrongly about a module.
fn complaints(module: &Module, entries: &[Entry], internal: &BTreeSet<&str>) -> Vec<String> {
    let names = names_of(module);
    let mut wrong = Vec::new();
    let public = names.iter().filter(|(name, _)| !is_internal(name, internal) && !is_generated(name));
    for (name, declared) in public {
        match entries.iter().find(|entry| entry.name == *name && entry.is_in(module)) {
            None => wrong.push(format!("{name} is missing")),
            Some(entry) if !entry.agrees(declared) => {
                wrong.push(format!("'{}' is declared as {declared:?}", entry.text));
            }
            Some(_) => {}
        }
    }
    let extra = entries.iter().filter(|entry| entry.is_in(module) && !names.contains_key(&entry.name));
    wrong.extend(extra.map(|entry| format!("{} does not exist", entry.name)));
    wrong
}

/// True for the macros of the generated tables.
fn is_generated(name: &str) -> bool {
    let binding = layout::BINDINGS.iter().any(|binding| binding.macro_name == name);
    let stage = ShaderStage::ALL.into_iter().any(|stage| preamble::stage_macro(stage) == name);
    binding || stage || ["LVK_SET", "LVK_INPUT_SET"].contains(&name)
}

#[test]
fn the_page_lists_every_name_where_it_exists_and_no_other() {
    let entries = entries(PAGE);
    assert!(entries.len() > 110, "{} entries", entries.len());
    let internal: BTreeSet<_> = column(PAGE, "| Internal |").into_iter().collect();
    let (mut seen, mut wrong) = (BTreeSet::new(), BTreeSet::new());
    for module in all_modules() {
        seen.extend(names_of(&module).into_keys());
        wrong.extend(
            complaints(&module, &entries, &internal).into_iter().map(|why| format!("{module:?}: {why}")),
        );
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    let gone: Vec<_> = internal.iter().filter(|name| !seen.contains(**name)).collect();
    assert!(gone.is_empty(), "internal names that do not exist: {gone:?}");
}

#[test]
fn wrong_and_missing_entries_are_noticed() {
    let internal = column(PAGE, "| Internal |").into_iter().collect();
    let module = Module {
        stage: ShaderStage::Compute,
        software: false,
        position_fetch: true,
        formatless: true,
        file: Some("lvk/ray_query.glsl"),
    };
    let noticed = |from: &str, to: &str| {
        let page = PAGE.replace(from, to);
        assert_ne!(page, PAGE, "{from}");
        let wrong = complaints(&module, &entries(&page), &internal);
        assert!(!wrong.is_empty(), "{from}: {to}");
    };
    noticed("`ivec2 textureBindlessSize2D(uint tex)`", "`ivec3 textureBindlessSize2D(uint tex)`");
    noticed("`texture3D kTextures3D[]`", "`texture2D kTextures3D[]`");
    noticed("`LVK_RAY_FLAG_OPAQUE = 0x1u`", "`LVK_RAY_FLAG_OPAQUE = 0x2u`");
    noticed("`LVK_COMMITTED_NONE = 0u`", "`LVK_COMMITTED_NOTHING = 0u`");
    noticed(
        "lvkRayQueryT(LvkRayQuery rq, const bool which)",
        "lvkRayQueryT(const bool which, LvkRayQuery rq)",
    );
    noticed("Where: `<lvk/ray_query.glsl>`\n", "Where: `<lvk/tlas.glsl>`\n");
    noticed("`uint lvkRayQueryRayFlags(LvkRayQuery rq)`", "`uint lvkRayQueryFlags(LvkRayQuery rq)`");
    noticed("Where: closest hit, any hit, intersection\n", "Where: every stage\n");
}

/// Returns a statement that calls a function or macro with arguments of the declared types. It compiles only if the
/// result has exactly the declared type.
fn call(entry: &Entry) -> Option<String> {
    let (result, parameters) = (entry.result()?, entry.parameters()?);
    let (mut locals, mut arguments) = (String::new(), Vec::new());
    for parameter in &parameters {
        let name = parameter_name(parameter);
        match parameter.strip_prefix("const ") {
            Some(constant) if constant.starts_with("bool ") => arguments.push("true"),
            Some(_) => arguments.push("0"),
            None => {
                let _ = write!(locals, "{}; ", parameter.trim_start_matches("out "));
                arguments.push(name);
            }
        }
    }
    let call = format!("{}({})", entry.name, arguments.join(", "));
    Some(match result {
        "void" => format!("{{ {locals}{call}; }}\n"),
        _ => format!("{{ {locals}bool same = is_{result}({call}); }}\n"),
    })
}

/// For each type, functions that return a value for this type only.
fn type_checks() -> String {
    let mut text = String::new();
    for wanted in TYPES {
        for ty in TYPES {
            let _ = match ty == wanted {
                true => writeln!(text, "bool is_{wanted}({ty} value) {{ return true; }}"),
                false => writeln!(text, "void is_{wanted}({ty} value) {{}}"),
            };
        }
    }
    text
}

#[test]
fn every_typed_declaration_compiles_as_declared() {
    let entries = entries(PAGE);
    let mut called = BTreeSet::new();
    for stage in [ShaderStage::Compute, ShaderStage::Fragment, ShaderStage::ClosestHit] {
        for software in [false, true] {
            let file = Some("lvk/ray_query.glsl");
            let module = Module { stage, software, position_fetch: true, formatless: true, file };
            let calls: Vec<_> = entries.iter().filter(|entry| entry.is_in(&module)).collect();
            called.extend(calls.iter().filter(|entry| call(entry).is_some()).map(|entry| entry.name.clone()));
            let body: String = calls.iter().filter_map(|entry| call(entry)).collect();
            let globals = format!(
                "#include <lvk/ray_query.glsl>
                LVK_TEXTURES(textureCubeArray, kTexturesCubeArray);
                LVK_TEXTURES(texture1D, kTextures1D);
                {}",
                type_checks()
            );
            let text = shader(stage, &globals, &body);
            if let Err(error) = compile(&desc(stage, &text), &options(&module), CompileFiles::default()) {
                panic!("{stage:?}, software {software}: {error}\n{body}");
            }
        }
    }
    assert!(called.len() > 65, "{} declarations", called.len());
    let text = shader(ShaderStage::Compute, &type_checks(), "bool same = is_int(1u);");
    assert!(build(&desc(ShaderStage::Compute, &text)).is_err(), "another type is accepted");
}

#[test]
fn macros_to_define_are_tested_by_the_library() {
    let tested: BTreeSet<_> = preamble::library().flat_map(|(_, text)| tested_macros(text)).collect();
    let listed = column(PAGE, "| Macro to define |");
    assert!(!listed.is_empty() && listed.iter().all(|name| tested.contains(name)), "{listed:?}");
}

/// Names follow GLSL and SPIR-V, as the page promises.
#[test]
fn names_of_ray_queries_and_flags_are_those_of_glsl_and_spirv() {
    let file = |name: &str| preamble::library().find(|(known, _)| *known == name).unwrap().1;
    let hardware = file("lvk/hardware_ray_query.glsl");
    let functions: Vec<_> =
        entries(PAGE).into_iter().filter(|entry| entry.name.starts_with("lvkRayQuery")).collect();
    assert_eq!(functions.len(), 24);
    for Entry { name, .. } in functions {
        let (_, definition) = hardware.split_once(&format!("#define {name}(")).unwrap();
        let definition: String = definition.split("\n#define").next().unwrap().to_owned();
        let word = name.strip_prefix("lvkRayQuery").unwrap();
        let ext = |start: &str| definition.contains(&format!("rayQuery{start}{word}EXT("));
        assert!(ext("") || ext("Get") || ext("GetIntersection"), "{name}: {definition}");
    }
    let flags = declared_names(file("lvk/ray_flags.glsl"));
    let mut of_spirv: Vec<_> =
        ::spirv::RayFlags::all().iter_names().map(|(name, flag)| (name, flag.bits())).collect();
    of_spirv.push(("NONE_KHR", 0));
    let mut checked = 0;
    for (name, bits) in of_spirv.into_iter().filter(|(name, _)| name.ends_with("_KHR")) {
        let name = name.trim_end_matches("_KHR").replace("AAB_BS", "AABBS");
        assert_eq!(
            flags.get(&format!("LVK_RAY_FLAG_{name}")),
            Some(&Declared::Value(format!("{bits:#x}u"))),
            "{name}"
        );
        checked += 1;
    }
    assert_eq!(checked, flags.keys().filter(|name| name.starts_with("LVK_RAY_FLAG_")).count());
}

/// Returns the blocks of the page that tables of the library decide.
fn blocks() -> [(&'static str, String); 4] {
    [("stages", stages()), ("extensions", extensions()), ("bindings", bindings()), ("inputs", inputs())]
}

fn stages() -> String {
    let mut text = String::from("| Stage | Macro | Execution model of SPIR-V |\n|---|---|---|\n");
    for stage in ShaderStage::ALL {
        let model = format!("{:?}", crate::shader::spirv::reflect::execution_model(stage));
        let model = model.replace("NV", "KHR");
        let _ = writeln!(text, "| {} | `{}` | `{model}` |", stage.name(), preamble::stage_macro(stage));
    }
    text
}

fn extensions() -> String {
    let mut text = String::new();
    for extension in preamble::EXTENSIONS {
        let _ = writeln!(text, "* `{extension}`");
    }
    for stage in [ShaderStage::Mesh, ShaderStage::RayGen] {
        let stages = if stage.is_ray_tracing() { "ray tracing stages" } else { "task and mesh stages" };
        let extension = preamble::stage_extensions(stage).unwrap();
        let _ = writeln!(text, "* `{extension}` in {stages}");
    }
    text + "* `GL_EXT_shader_image_load_formatted` if `LVK_FORMATLESS_READ` is defined\n\
            * `GL_EXT_ray_tracing_position_fetch` in ray tracing stages if `LVK_POSITION_FETCH` is defined\n"
}

fn bindings() -> String {
    let mut text =
        String::from("| `LVK_SET` | Binding | Macro | Descriptor type | Content |\n|---|---|---|---|---|\n");
    for binding in layout::BINDINGS {
        let (number, ty) = (binding.number, binding.descriptor_type);
        let _ = writeln!(
            text,
            "| {} | {number} | `{}` | `VK_DESCRIPTOR_TYPE_{ty:?}` | {} |",
            layout::SET,
            binding.macro_name,
            binding.holds
        );
    }
    text
}

fn inputs() -> String {
    let mut text = String::from(
        "| `LVK_INPUT_SET` | Binding and `InputAttachmentIndex` | Input attachment |\n|---|---|---|\n",
    );
    for index in 0..InputAttachment::COUNT {
        let input = InputAttachment::from_index(index).unwrap();
        let _ = writeln!(text, "| {} | {index} | {input} |", layout::INPUT_SET);
    }
    text
}

/// `LVK_WRITE_DOCS=1 cargo test -p lvk --lib shader::tests::interface` rewrites the blocks.
#[test]
fn generated_blocks_are_those_of_the_tables() {
    let page = with_blocks(PAGE, &blocks());
    if std::env::var_os("LVK_WRITE_DOCS").is_some() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/manual/shader_interface.md");
        std::fs::write(path, page).unwrap();
    } else {
        assert!(page == PAGE, "set LVK_WRITE_DOCS=1 once");
    }
}

/// Returns the set and binding of each line of the header that declares a name.
fn header_bindings() -> Vec<(u32, u32, &'static str)> {
    let lines = HLSL_HEADER.lines().filter_map(|line| line.strip_prefix("[[vk::binding("));
    lines
        .map(|line| {
            let (numbers, rest) = line.split_once(")]]").unwrap();
            let (binding, set) = numbers.split_once(", ").unwrap();
            let name = rest.trim_end_matches(['[', ']', ';']).rsplit(' ').next().unwrap();
            (set.parse().unwrap(), binding.parse().unwrap(), name)
        })
        .collect()
}

#[test]
fn the_header_for_hlsl_has_the_arrays_of_glsl() {
    let bindings: BTreeMap<_, _> =
        header_bindings().into_iter().map(|(set, at, name)| (name, (set, at))).collect();
    let text = preamble::preamble(ShaderStage::Compute, &CompileOptions::default(), &[])
        + "#include <lvk/tlas.glsl>\n#include <lvk/tlas_table.glsl>\n";
    let arrays = declared_names(&text).into_iter().filter_map(|(name, declared)| {
        let Declared::Exactly(text) = declared else { return None };
        let ty = text.strip_suffix(&format!(" {name}[]"))?.to_owned();
        Some((name, ty))
    });
    let mut expected: BTreeMap<_, _> = arrays
        .map(|(name, ty)| {
            let binding = match ty.as_str() {
                "accelerationStructureEXT" => layout::ACCEL_STRUCTS,
                ty if ty.contains("texture") => layout::SAMPLED_IMAGES,
                ty if ty.contains("image") => layout::STORAGE_IMAGES,
                _ => layout::SAMPLERS,
            };
            (name, (layout::SET, binding))
        })
        .collect();
    expected.insert("kLvkTlasTable".to_owned(), (layout::SET, layout::TLAS_TABLE));
    assert!(bindings.iter().map(|(name, at)| (name.to_string(), *at)).eq(expected), "{bindings:?}");
    let input = |input: InputAttachment| format!("({}, type, name)", input.index());
    for text in [
        format!("[[vk::binding({}, {})]] type name[]", layout::SAMPLED_IMAGES, layout::SET),
        format!("[[vk::binding({}, {})]] [[vk::image_format(format)]]", layout::STORAGE_IMAGES, layout::SET),
        format!("[[vk::binding(place, {})]] type name", layout::INPUT_SET),
        format!("LVK_INPUT(target, type, name) LVK_INPUT_AT({} + target", InputAttachment::Color(0).index()),
        format!("LVK_DEPTH_INPUT(type, name) LVK_INPUT_AT{}", input(InputAttachment::Depth)),
        format!("LVK_STENCIL_INPUT(type, name) LVK_INPUT_AT{}", input(InputAttachment::Stencil)),
    ] {
        assert!(HLSL_HEADER.contains(&text), "{text}");
    }
}
