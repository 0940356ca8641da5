//! Entry points of fuzz targets: the code that reads bytes from outside, without a device.
//!
//! Checksums keep random bytes out of the code behind them. Each entry therefore takes bytes as they are, or seals them with
//! the checksum that a file of these contents has. Each reader returns true for bytes that are accepted.

use std::collections::HashMap;

use crate::accel::blas_file;
use crate::bindless::index_checks::{CheckPlan, WordRange};
use crate::context::serialize::{driver_structure_bytes, part_plans_from_file};
use crate::error::Result;
use crate::gpu::caps::features::Features;
use crate::pipeline::cache_file::{self, CacheOwner};
use crate::pipeline::stage_interface_check::interface_difference;
use crate::shader::disk_file;
use crate::shader::layout_comparison::compare_layout;
use crate::shader::shader_layout::{NestedLayout, StructLayout, StructMember};
use crate::shader::spirv::lower::{HitShaders, Lowering, StageModule, Traversal, lower};
use crate::shader::spirv::passes::merge_sampled_image::merge_sampled_images;
use crate::shader::spirv::passes::strip_primitive_culling::strip_primitive_culling;
use crate::shader::spirv::passes::strip_unused_bindings::strip_unused_bindings;
use crate::shader::spirv::reflect::reflect;
use crate::shader::{
    CompileFiles, CompileOptions, Reflection, ShaderModuleDesc, ShaderSource, ShaderStage,
    check_capabilities, check_stage, compile, with_checked_indices,
};

/// Reads words as the creation of a shader module and its pipelines does, and runs each pass that rewrites modules.
/// `choice` chooses the stage.
pub fn read_spirv(choice: u8, words: &[u32]) -> bool {
    let stage = ShaderStage::ALL[usize::from(choice) % ShaderStage::ALL.len()];
    run_passes(words);
    lower_alone(stage, words);
    let desc = ShaderModuleDesc {
        stage,
        source: ShaderSource::Spirv(words),
        debug_name: "outside",
        ..ShaderModuleDesc::default()
    };
    let module = compile(&desc, &CompileOptions::default(), CompileFiles::default())
        .and_then(|words| reflect(desc.debug_name, stage, &words));
    match &module {
        Ok(module) => use_reflection(stage, module),
        Err(error) => drop(error.to_string()),
    }
    module.is_ok()
}

/// Lowers a ray tracing pipeline whose only shader are these words, in every role.
fn lower_alone(stage: ShaderStage, words: &[u32]) {
    let hit = HitShaders { closest_hit: Some(0), any_hit: Some(0), intersection: Some(0) };
    let modules = [StageModule { name: "fuzzed", stage, words, specialization: &[(0, 1)] }];
    let lowered = lower(&Lowering {
        traversal: Traversal::Query,
        is_for_swiftshader: true,
        modules: &modules,
        ray_gen: 0,
        miss: &[0],
        hit: &[hit, HitShaders { intersection: None, ..hit }],
        callable: &[0],
        strides: [16; 3],
        push_constant_bytes: 64,
        launch_offset: 120,
        max_recursion: 2,
        max_callable_depth: 1,
    });
    drop(lowered.map_err(|error| error.message));
}

fn run_passes(words: &[u32]) {
    let range = WordRange { first: 16, count: 4 };
    let plan = CheckPlan { address: 1 << 40, shader: 1, arrays: [range; 4], declarations: 90 };
    drop(with_checked_indices(words, &plan));
    let stripped = strip_unused_bindings(words.to_vec());
    drop(merge_sampled_images(strip_primitive_culling(&stripped)));
    #[cfg(feature = "glsl")]
    {
        let texts = [("a.glsl".to_owned(), "void main() {}".to_owned())];
        drop(crate::shader::spirv::debug_source::embed_source(words, &texts));
    }
}

/// Reads a reflection as checks of modules and pipelines do.
fn use_reflection(stage: ShaderStage, module: &Reflection) {
    const INNER: StructLayout = StructLayout { name: "Inner", size_bytes: 16, members: &[] };
    const MEMBERS: [StructMember; 2] = [
        StructMember { name: "last", block_name: "last", offset: 0, size_bytes: 4, nested: None },
        StructMember {
            name: "s",
            block_name: "s",
            offset: 16,
            size_bytes: 32,
            nested: Some(NestedLayout { layout: &INNER, count: 2 }),
        },
    ];
    const OUTER: StructLayout = StructLayout { name: "Outer", size_bytes: 48, members: &MEMBERS };
    let features = Features::default();
    let checked = check_stage("outside", stage, &features)
        .and_then(|()| check_capabilities("outside", stage, module, &features, &[]));
    drop(checked.map_err(|error| error.to_string()));
    let constants: HashMap<u32, u32> =
        module.specialization.iter().map(|(id, bytes)| (*id, *bytes)).collect();
    _ = module.shared_memory.bytes(&constants);
    _ = module.blocks.record_bytes();
    for block in module.blocks.list.iter().take(4) {
        drop(compare_layout(&OUTER, &module.blocks, block.ty).map(|found| format!("{found:?}")));
    }
    let (inputs, outputs) = (&module.interface.inputs, &module.interface.outputs);
    for (to, from) in [(inputs, outputs), (outputs, outputs)] {
        if let Some((input, output)) = interface_difference(to, from) {
            drop((input.description(), output.map(|output| output.description())));
        }
    }
}

/// Returns the words of a shader of each kind that the SPIR-V passes rewrite, with the choice of its stage.
///
/// # Errors
/// A shader does not compile.
#[cfg(feature = "glsl")]
pub fn example_spirv() -> Result<Vec<(u8, Vec<u32>)>> {
    const TEXTS: [(ShaderStage, &str); 4] = [
        (
            ShaderStage::Compute,
            "layout(local_size_x_id = 1) in; layout(constant_id = 2) const uint n = 4; shared uvec4 m[2 * n];
             struct S { vec3 a; mat3 b[2]; };
             layout(push_constant, std430) uniform Push { S s[2]; float last; uint i; };
             void main() { m[i] = uvec4(i); imageStore(kImages2D[i], ivec2(0), textureBindless2D(i, n, vec2(last))); }",
        ),
        (
            ShaderStage::Vertex,
            "layout(buffer_reference, scalar) readonly buffer B { vec3 p[]; };
             layout(push_constant) uniform Push { B b; }; layout(location = 0) in mat2x3 a;
             layout(location = 2) out Block { vec2 c; flat uint d; } block;
             void main() { gl_Position = vec4(b.p[gl_VertexIndex] + a[1], 1); block.c = vec2(0); block.d = 1; }",
        ),
        (
            ShaderStage::ClosestHit,
            "layout(location = 0) rayPayloadInEXT vec4 p; hitAttributeEXT vec2 h;
             layout(shaderRecordEXT, scalar) buffer R { vec3 color; uint texture; } r;
             void main() { p = vec4(r.color, h.x); }",
        ),
        (
            ShaderStage::Fragment,
            "#include <lvk/ray_query.glsl>
             layout(location = 0) in vec2 uv; layout(location = 0) out vec4 c;
             void main() { LvkRayQuery q; lvkRayQueryInitialize(q, 0, 0u, 255u, vec3(uv, 0), 0.0, vec3(1), 9.0);
                 c = vec4(lvkRayQueryProceed(q) ? 1 : 0); }",
        ),
    ];
    let compiled = |(stage, text): (ShaderStage, &str)| {
        let source = ShaderSource::Glsl(text);
        let desc = ShaderModuleDesc { stage, source, ..ShaderModuleDesc::default() };
        let words = compile(&desc, &CompileOptions::default(), CompileFiles::default())?;
        let choice = ShaderStage::ALL.iter().take_while(|known| **known != stage).count();
        Ok((choice as u8, words))
    };
    TEXTS.into_iter().map(compiled).collect()
}

/// Reads a pipeline cache file up to the data that the driver gets: the whole file, or the file around such data.
pub fn read_pipeline_cache(is_sealed: bool, bytes: &[u8]) -> bool {
    // The owner is that of the data, else its checks would end there.
    let word =
        |at: usize| bytes.get(at..at + 4).and_then(|word| word.try_into().ok()).map_or(0, u32::from_le_bytes);
    let uuid = bytes.get(16..32).and_then(|uuid| uuid.try_into().ok()).unwrap_or_default();
    let owner = CacheOwner { vendor: word(8), device: word(12), cache_uuid: uuid, ..CacheOwner::default() };
    let is_accepted = [owner, CacheOwner::default()].map(|owner| {
        let file = if is_sealed { cache_file::encode_file(&owner, bytes) } else { bytes.to_vec() };
        cache_file::decode_file(&owner, &file).map_err(|error| error.to_string()).is_ok()
    });
    is_accepted.contains(&true)
}

/// Returns the whole file of a pipeline cache of no device, with these data of the driver.
pub fn whole_pipeline_file(data: &[u8]) -> Vec<u8> {
    cache_file::encode_file(&CacheOwner::default(), data)
}

/// Reads a file of the shader cache: the whole file, or the file with this body. Words that it contains are reflected, as
/// those of every module are.
pub fn read_shader_cache(is_sealed: bool, bytes: &[u8]) -> bool {
    let key = disk_file::Fingerprint::from_bytes(b"key");
    let file = if is_sealed { whole_shader_file(bytes) } else { bytes.to_vec() };
    let module = disk_file::decode_file(key, &file);
    if let Ok(module) = &module {
        drop(reflect("outside", ShaderStage::Compute, &module.words));
    }
    module.is_ok()
}

/// Returns the whole file of the shader cache with this body.
pub fn whole_shader_file(body: &[u8]) -> Vec<u8> {
    disk_file::sealed(disk_file::Fingerprint::from_bytes(b"key"), body)
}

/// Reads a serialised BLAS up to what only its driver can read: the whole file, or the file with this body. The mesh is the
/// one that the file states. A BLAS of software traversal is read whole.
pub fn read_blas(is_sealed: bool, bytes: &[u8]) -> bool {
    let file = if is_sealed { whole_blas_file(bytes) } else { bytes.to_vec() };
    let blob = match blas_file::decode_blas_file(&file) {
        Ok(blob) => blob,
        Err(error) => {
            drop(error.to_string());
            return false;
        }
    };
    let counts: Vec<u32> = blob.geometries.iter().map(|geometry| geometry.primitive_count).collect();
    drop(part_plans_from_file(&blob, &counts));
    for part in &blob.parts {
        _ = (part.version_data(), driver_structure_bytes(part));
    }
    #[cfg(feature = "software-ray-query")]
    return software::read_blob(&blob, counts);
    #[cfg(not(feature = "software-ray-query"))]
    true
}

/// Returns the whole file of a serialised BLAS with this body.
pub fn whole_blas_file(body: &[u8]) -> Vec<u8> {
    blas_file::sealed(body)
}

#[cfg(feature = "software-ray-query")]
pub use software::{example_blas, example_trees, read_tree, whole_tree_file};

#[cfg(feature = "software-ray-query")]
mod software {
    use glam::Vec3;

    use crate::accel::blas_file::{BlasFile, BlasFileGeometry, BlasFileGeometryKind, BlasFilePart};
    use crate::accel::geometry::GeometryFlags;
    use crate::software_ray_query::bvh::encode_blas::{BlasBlob, encode_blas};
    use crate::software_ray_query::bvh::primitives::{Mesh, MeshPrimitives};
    use crate::software_ray_query::bvh::settings::BvhSettings;
    use crate::software_ray_query::bvh::subtrees::subtree_parts;
    use crate::software_ray_query::bvh_cache::{decode_file, encode_file};
    use crate::software_ray_query::create::SOFTWARE_BLOB_UUID;
    use crate::software_ray_query::expected_mesh::ExpectedMesh;
    use crate::software_ray_query::layout::{LeafBox, LeafTriangle};
    use crate::software_ray_query::validate_blob::validate_blob;

    /// Reads the BVH in a serialised BLAS, and splits it as TLAS do. False for a BVH that is refused.
    pub(super) fn read_blob(file: &BlasFile, counts: Vec<u32>) -> bool {
        let is_aabbs = file.geometries.first().is_some_and(|first| first.kind == BlasFileGeometryKind::Boxes);
        let expected = ExpectedMesh { is_aabbs, counts };
        let bytes = file.parts.first().and_then(|part| part.driver.strip_prefix(&SOFTWARE_BLOB_UUID[..]));
        let Some(bytes) = bytes else { return true };
        let validated = validate_blob(bytes, &expected);
        if let Ok(validated) = &validated {
            drop(subtree_parts(&BlasBlob { bytes: bytes.to_vec(), bounds: validated.bounds }));
        }
        validated.is_ok()
    }

    /// Reads a file of the tree cache, the whole file or the file around this BVH, for a mesh with these numbers of
    /// primitives, and splits the BVH as TLAS do.
    pub fn read_tree(is_sealed: bool, is_aabbs: bool, counts: &[u32], bytes: &[u8]) -> bool {
        let expected = ExpectedMesh { is_aabbs, counts: counts.to_vec() };
        let file = match is_sealed {
            true => whole_tree_file(bytes),
            false => bytes.to_vec(),
        };
        let blob = decode_file(&file, &expected);
        if let Ok(blob) = &blob {
            drop(subtree_parts(blob));
        }
        blob.is_ok()
    }

    /// Returns the whole file of the tree cache with this BVH.
    pub fn whole_tree_file(bytes: &[u8]) -> Vec<u8> {
        encode_file(bytes)
    }

    /// Returns BVHs of each encoding, with `is_aabbs` and the counts of [`read_tree`].
    pub fn example_trees() -> Vec<(bool, Vec<u32>, Vec<u8>)> {
        let mut all = vec![(
            true,
            vec![12],
            encode_blas(&boxes(12), BvhSettings { low_memory: false, refit: false }).bytes,
        )];
        for [low_memory, refit] in [[false, false], [true, false], [true, true]] {
            let settings = BvhSettings { low_memory, refit };
            let mut mesh = strip(9);
            if !settings.keeps_given_vertices() {
                mesh.vertices.clear();
            }
            all.push((false, vec![5, 4], encode_blas(&mesh, settings).bytes));
        }
        all
    }

    /// Returns the body of a serialised BLAS of software traversal.
    pub fn example_blas() -> Vec<u8> {
        let tree = encode_blas(&boxes(12), BvhSettings { low_memory: false, refit: false });
        let driver = [&SOFTWARE_BLOB_UUID[..], &tree.bytes].concat();
        let geometry = BlasFileGeometry { kind: BlasFileGeometryKind::Boxes, primitive_count: 12, flags: 0 };
        let file = BlasFile {
            flags: 0,
            geometries: vec![geometry],
            parts: vec![BlasFilePart { driver, map: None }],
        };
        crate::accel::blas_file::encode_blas_file(&file).split_off(crate::accel::blas_file::HEADER_BYTES)
    }

    fn boxes(count: u32) -> Mesh {
        let place = |primitive: u32| {
            let low = Vec3::splat(primitive as f32);
            LeafBox { low, primitive, high: low + Vec3::ONE, geometry: LeafBox::OPAQUE }
        };
        let primitives = MeshPrimitives::Boxes((0..count).map(place).collect());
        Mesh { primitives, vertices: Vec::new(), flags: vec![GeometryFlags::OPAQUE] }
    }

    /// Returns a closed strip of triangles, of two geometries in turn.
    fn strip(count: u32) -> Mesh {
        let vertices: Vec<_> =
            (0..count).map(|number| [0, 1, 2].map(|step| (number + step) % count)).collect();
        let corner = |vertex: u32| Vec3::new(vertex as f32, (vertex % 3) as f32, 0.5);
        let triangle = |(number, named): (u32, &[u32; 3])| {
            let [a, b, c] = named.map(corner);
            LeafTriangle { a, primitive: number / 2, b, geometry: number % 2, c, opaque: 1 }
        };
        let primitives = MeshPrimitives::Triangles((0..).zip(&vertices).map(triangle).collect());
        Mesh { primitives, vertices, flags: vec![GeometryFlags::OPAQUE; 2] }
    }
}

#[cfg(feature = "glsl")]
pub use crate::shader::outside_text::read_glsl;
