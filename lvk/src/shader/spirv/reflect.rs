//! Reflection of a SPIR-V module, and checks against the library's descriptor sets.

use ::spirv::{Capability, Decoration, ExecutionMode, ExecutionModel, Op, StorageClass};

use super::atomics::{Atomic, find_atomics};
use super::blocks::Blocks;
use super::input_attachments::{InputRead, output_locations, read_input_attachment};
use super::parsed::{KnownSizes, Mode, ParsedModule, Type, Variable};
use super::ray_interface::RayInterface;
use super::stage_interface::StageInterface;
use super::words;
use super::workgroup_memory::SharedMemory;
use crate::bindless::layout;
use crate::error::{Error, Result};
use crate::shader::ShaderStage;

/// Kind of primitives that a geometry stage takes or a tessellation stage emits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Primitive {
    Points,
    Lines,
    Triangles,
    /// Primitives with adjacent vertices, for which the library has no topology.
    Adjacent,
}

/// Facts of one entry point that pipelines need.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Reflection {
    /// Bytes of push constants: the end of the block's last member, rounded up to 4; 0 without a block.
    pub(crate) push_constant_bytes: u32,
    /// The blocks whose bytes the application writes.
    pub(crate) blocks: Blocks,
    /// The module uses ray queries, by the device or by the library.
    pub(crate) ray_query: bool,
    /// The module uses ray queries by the device.
    pub(crate) hardware_ray_query: bool,
    /// The module is for a ray tracing pipeline.
    pub(crate) ray_tracing: bool,
    /// Sizes of payloads and hit attributes.
    pub(crate) ray_interface: RayInterface,
    /// Workgroup size (compute, task, mesh), with the defaults of specialization constants; zeros in other stages.
    pub(crate) local_size: [u32; 3],
    /// For each axis, the specialization constant that overrides [`local_size`](Self::local_size).
    pub(crate) local_size_ids: [Option<u32>; 3],
    /// The primitives that a geometry stage takes, or that a tessellation evaluation stage emits.
    pub(crate) primitive: Option<Primitive>,
    /// A stage before rasterisation writes `gl_Layer`.
    pub(crate) writes_layer: bool,
    /// A fragment stage has an output of index 1, the second source of blending.
    pub(crate) second_output: bool,
    /// Maximum vertices and primitives that a workgroup of a mesh stage emits; zeros in other stages.
    pub(crate) mesh_outputs: [u32; 2],
    /// Memory that the invocations of a workgroup share (compute, task, mesh).
    pub(crate) shared_memory: SharedMemory,
    /// Specialization constants: id and bytes (1 to 8; booleans take 4), sorted by id.
    pub(crate) specialization: Vec<(u32, u32)>,
    /// Bindings that the module declares, sorted, each once.
    pub(crate) bindings: Vec<u32>,
    /// SPIR-V capabilities by number, sorted.
    pub(crate) capabilities: Vec<u32>,
    /// Atomic operations that need a device feature.
    pub(crate) atomics: Vec<Atomic>,
    /// Input attachments that a fragment stage reads, sorted by index.
    pub(crate) input_reads: Vec<InputRead>,
    /// Locations of the outputs of a fragment stage, a bit for each.
    pub(crate) outputs: u32,
    /// First locations of the inputs; in a vertex stage, its attributes.
    pub(crate) inputs: Vec<u32>,
    /// The values that the stage takes from the stage before it, and those that it passes on.
    pub(crate) interface: StageInterface,
}

/// Reads `words` for `stage` with the entry point `main`. The words may be invalid.
pub(crate) fn reflect(name: &str, stage: ShaderStage, words: &[u32]) -> Result<Reflection> {
    reflect_words(stage, words).map_err(|log| Error::Shader { name: name.to_owned(), log })
}

fn reflect_words(stage: ShaderStage, words: &[u32]) -> Result<Reflection, String> {
    words::validate(words)?;
    let module = ParsedModule::parse(words)?;
    let entry = entry_point(&module, stage)?;
    let function = module.entries[entry].function;
    check_function(words, function)?;
    let (local_size, local_size_ids) = local_size(&module, function);
    let (mut bindings, mut inputs, mut input_reads) = (Vec::new(), Vec::new(), Vec::new());
    let (mut push_constant_bytes, mut second_output, mut colors) = (0, false, 0);
    let mut known = KnownSizes::new();
    for variable in module.variables.iter().filter(|variable| module.in_interface(entry, variable)) {
        if variable.storage == StorageClass::PushConstant as u32 {
            push_constant_bytes = push_constant_bytes.max(block_bytes(&module, variable, &mut known)?);
        } else if let Some(read) = read_input_attachment(&module, variable)? {
            input_reads.push(read);
        } else if is_descriptor(variable) {
            bindings.push(binding(&module, variable)?);
        } else if variable.storage == StorageClass::Input as u32 {
            inputs.extend(module.decoration(variable.id, Decoration::Location));
        } else if variable.storage == StorageClass::Output as u32 {
            second_output |= module.decoration(variable.id, Decoration::Index) == Some(1);
            colors |= output_locations(&module, variable);
        }
    }
    input_reads.sort_unstable_by_key(|read| read.input.index());
    bindings.sort_unstable();
    bindings.dedup();
    let hardware_ray_query = module.has_capability(Capability::RayQueryKHR);
    let ray_tracing = stage.is_ray_tracing() || module.has_capability(Capability::RayTracingKHR);
    // Only modules that trace rays in software read the table.
    let software_ray_query = !hardware_ray_query && !ray_tracing && bindings.contains(&layout::TLAS_TABLE);
    Ok(Reflection {
        push_constant_bytes,
        blocks: Blocks::from_module(&module, entry),
        ray_query: hardware_ray_query || software_ray_query,
        hardware_ray_query,
        ray_tracing,
        ray_interface: RayInterface::from_module(&module),
        local_size,
        local_size_ids,
        primitive: primitive(&module, stage, function),
        writes_layer: module.writes_layer(entry),
        second_output,
        mesh_outputs: if stage == ShaderStage::Mesh { mesh_outputs(&module, function) } else { [0; 2] },
        shared_memory: SharedMemory::from_module(words, &module, entry),
        specialization: specialization(&module),
        bindings,
        capabilities: module.capabilities(),
        atomics: find_atomics(words)?,
        input_reads,
        outputs: if stage == ShaderStage::Fragment { colors } else { 0 },
        inputs,
        interface: StageInterface::from_module(stage, &module, entry),
    })
}

fn entry_point(module: &ParsedModule, stage: ShaderStage) -> Result<usize, String> {
    let model = execution_model(stage) as u32;
    let found = module.entries.iter().position(|entry| entry.name == "main" && entry.model == model);
    found.ok_or_else(|| {
        let there: Vec<String> =
            module.entries.iter().map(|e| format!("'{}' ({})", e.name, model_name(e.model))).collect();
        let there = if there.is_empty() { "none at all".to_owned() } else { there.join(", ") };
        format!("no entry point 'main' for the {} stage; the module has {there}", stage.name())
    })
}

/// Fails unless the entry point's function exists: drivers rely on it.
fn check_function(words: &[u32], function: u32) -> Result<(), String> {
    for instruction in words::instructions(words) {
        let instruction = instruction?;
        if instruction.op == Some(Op::Function) && instruction.operand(1) == function {
            return Ok(());
        }
    }
    Err("the entry point 'main' names no function of the module".to_owned())
}

pub(crate) fn execution_model(stage: ShaderStage) -> ExecutionModel {
    match stage {
        ShaderStage::Vertex => ExecutionModel::Vertex,
        ShaderStage::TessControl => ExecutionModel::TessellationControl,
        ShaderStage::TessEval => ExecutionModel::TessellationEvaluation,
        ShaderStage::Geometry => ExecutionModel::Geometry,
        ShaderStage::Fragment => ExecutionModel::Fragment,
        ShaderStage::Compute => ExecutionModel::GLCompute,
        ShaderStage::Task => ExecutionModel::TaskEXT,
        ShaderStage::Mesh => ExecutionModel::MeshEXT,
        ShaderStage::RayGen => ExecutionModel::RayGenerationNV,
        ShaderStage::Miss => ExecutionModel::MissNV,
        ShaderStage::ClosestHit => ExecutionModel::ClosestHitNV,
        ShaderStage::AnyHit => ExecutionModel::AnyHitNV,
        ShaderStage::Intersection => ExecutionModel::IntersectionNV,
        ShaderStage::Callable => ExecutionModel::CallableNV,
    }
}

fn model_name(model: u32) -> String {
    let stage = ShaderStage::ALL.into_iter().find(|stage| execution_model(*stage) as u32 == model);
    stage.map_or_else(|| format!("execution model {model}"), |stage| stage.name().to_owned())
}

/// Returns the workgroup size. The `WorkgroupSize` built-in takes precedence over both execution modes.
fn local_size(module: &ParsedModule, function: u32) -> ([u32; 3], [Option<u32>; 3]) {
    if let Some(parts) = module.workgroup_size() {
        return parts_of(module, parts);
    }
    for mode in module.modes.iter().filter(|mode| mode.function == function) {
        let parts = [mode.operands[0], mode.operands[1], mode.operands[2]];
        if mode.mode == ExecutionMode::LocalSizeId as u32 {
            return parts_of(module, parts);
        }
        if mode.mode == ExecutionMode::LocalSize as u32 {
            return (parts, [None; 3]);
        }
    }
    ([0; 3], [None; 3])
}

fn mesh_outputs(module: &ParsedModule, function: u32) -> [u32; 2] {
    [ExecutionMode::OutputVertices, ExecutionMode::OutputPrimitivesEXT].map(|wanted| {
        let of_function = |mode: &&Mode| mode.function == function && mode.mode == wanted as u32;
        module.modes.iter().find(of_function).map_or(0, |mode| mode.operands[0])
    })
}

/// Returns the primitives of a stage before rasterisation, which execution modes declare.
fn primitive(module: &ParsedModule, stage: ShaderStage, function: u32) -> Option<Primitive> {
    use ExecutionMode as Mode;
    let has = |wanted: ExecutionMode| {
        module.modes.iter().any(|mode| mode.function == function && mode.mode == wanted as u32)
    };
    let table: &[(ExecutionMode, Primitive)] = match stage {
        ShaderStage::Geometry => &[
            (Mode::InputPoints, Primitive::Points),
            (Mode::InputLines, Primitive::Lines),
            (Mode::Triangles, Primitive::Triangles),
            (Mode::InputLinesAdjacency, Primitive::Adjacent),
            (Mode::InputTrianglesAdjacency, Primitive::Adjacent),
        ],
        ShaderStage::TessEval => &[
            (Mode::PointMode, Primitive::Points),
            (Mode::Isolines, Primitive::Lines),
            (Mode::Triangles, Primitive::Triangles),
            (Mode::Quads, Primitive::Triangles),
        ],
        _ => &[],
    };
    table.iter().find(|(mode, _)| has(*mode)).map(|(_, primitive)| *primitive)
}

fn parts_of(module: &ParsedModule, ids: [u32; 3]) -> ([u32; 3], [Option<u32>; 3]) {
    let size = ids.map(|id| module.constants.get(&id).map_or(1, |constant| constant.value));
    (size, ids.map(|id| module.decoration(id, Decoration::SpecId)))
}

fn specialization(module: &ParsedModule) -> Vec<(u32, u32)> {
    let spec = module.constants.iter().filter(|(_, constant)| constant.is_spec);
    let mut found: Vec<(u32, u32)> = spec
        .filter_map(|(id, constant)| {
            let bytes = match module.types.get(&constant.ty)? {
                Type::Bool => 4,
                Type::Number { bytes, .. } => *bytes,
                _ => return None,
            };
            Some((module.decoration(*id, Decoration::SpecId)?, bytes))
        })
        .collect();
    found.sort_unstable();
    found.dedup();
    found
}

fn block_bytes(module: &ParsedModule, variable: &Variable, known: &mut KnownSizes) -> Result<u32, String> {
    let Some(Type::Pointer { target }) = module.types.get(&variable.ty) else {
        return Err("the push constants have no pointer type".to_owned());
    };
    let bytes = module.size_of(*target, known).map_err(|why| format!("push constants: {why}"))?;
    u32::try_from(bytes).ok().and_then(|bytes| bytes.checked_next_multiple_of(4)).ok_or_else(|| {
        format!("the push constants take {bytes} bytes; put the data into a buffer and push its address")
    })
}

fn is_descriptor(variable: &Variable) -> bool {
    use StorageClass::{StorageBuffer, Uniform, UniformConstant};
    [UniformConstant, Uniform, StorageBuffer].iter().any(|class| *class as u32 == variable.storage)
}

/// Returns the binding of a descriptor variable, if it is a binding of the library and of its kind.
fn binding(module: &ParsedModule, variable: &Variable) -> Result<u32, String> {
    let what = module.names.get(&variable.id).map_or("a resource".to_owned(), |name| format!("'{name}'"));
    let (Some(set), Some(binding)) = (
        module.decoration(variable.id, Decoration::DescriptorSet),
        module.decoration(variable.id, Decoration::Binding),
    ) else {
        return Err(format!("{what} has no descriptor set or no binding; {}", remedy()));
    };
    if variable.storage == StorageClass::StorageBuffer as u32 && (set, binding) == TLAS_TABLE {
        return Ok(binding);
    }
    if variable.storage != StorageClass::UniformConstant as u32 {
        return Err(format!(
            "{what} (set {set}, binding {binding}) is a buffer descriptor; there are none: declare a buffer_reference \
             and push the buffer's address"
        ));
    }
    if set != layout::SET {
        return Err(format!("{what} is in set {set}, binding {binding}; {}", remedy()));
    }
    let wanted = descriptor_kind(module, variable.ty);
    match layout::BINDINGS.iter().find(|known| known.number == binding) {
        Some(_) if wanted == Some(binding) => Ok(binding),
        Some(known) => {
            let holds = known.holds;
            Err(format!("{what} is in set {set}, binding {binding}, which holds {holds}; {}", remedy()))
        }
        None => Err(format!("{what} is in set {set}, binding {binding}, which does not exist; {}", remedy())),
    }
}

/// Set and binding of the one buffer descriptor, which `<lvk/hit_remap.glsl>` declares.
const TLAS_TABLE: (u32, u32) = (layout::SET, layout::TLAS_TABLE);

/// Returns the binding for resources of this type.
fn descriptor_kind(module: &ParsedModule, pointer: u32) -> Option<u32> {
    let Type::Pointer { target } = module.types.get(&pointer)? else { return None };
    let element = match module.types.get(target)? {
        Type::Array { element, .. } | Type::RuntimeArray { element } => element,
        _ => target,
    };
    match module.types.get(element)? {
        Type::Opaque(Op::TypeSampler) => Some(layout::SAMPLERS),
        Type::Opaque(Op::TypeSampledImage) => Some(layout::YCBCR),
        Type::Opaque(Op::TypeAccelerationStructureKHR) => Some(layout::ACCEL_STRUCTS),
        Type::Image { storage: false } => Some(layout::SAMPLED_IMAGES),
        Type::Image { storage: true } => Some(layout::STORAGE_IMAGES),
        _ => None,
    }
}

fn remedy() -> String {
    let holds = layout::BINDINGS.map(|binding| format!("{} {}", binding.number, binding.holds)).join(", ");
    format!("resources live in set {} at bindings {holds}; use the library's arrays and helpers", layout::SET)
}
