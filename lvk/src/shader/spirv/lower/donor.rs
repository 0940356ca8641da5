//! The module with the traversal, with which the shaders of a pipeline are linked.

use std::collections::HashMap;

use ::spirv::Op;

use super::Traversal;
use super::constants::freeze_constants;
use super::linker::Linker;
use super::module::Module;

/// Ids of the variables and functions of `donor/lowered_pipeline.comp.glsl` in the linked module.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Donor {
    /// The donor's own block of push constants.
    pub(super) push: u32,
    pub(super) launch_id: u32,
    pub(super) launch_size: u32,
    pub(super) push_constants: u32,
    pub(super) ray_gen_record: u32,
    pub(super) miss_records: u32,
    pub(super) hit_records: u32,
    pub(super) callable_records: u32,
    pub(super) ray_tlas: u32,
    pub(super) ray_flags: u32,
    pub(super) ray_mask: u32,
    pub(super) ray_offset: u32,
    pub(super) ray_stride: u32,
    pub(super) ray_miss: u32,
    pub(super) ray_origin: u32,
    pub(super) ray_t_min: u32,
    pub(super) ray_direction: u32,
    pub(super) ray_t_max: u32,
    pub(super) is_hit: u32,
    pub(super) hit_group: u32,
    pub(super) hit_t: u32,
    pub(super) hit_kind: u32,
    pub(super) hit_instance: u32,
    pub(super) hit_custom_index: u32,
    pub(super) hit_geometry: u32,
    pub(super) hit_primitive: u32,
    pub(super) hit_barycentrics: u32,
    pub(super) hit_object_origin: u32,
    pub(super) hit_object_direction: u32,
    pub(super) hit_object_to_world: u32,
    pub(super) hit_world_to_object: u32,
    pub(super) hit_positions: u32,
    pub(super) ignores: u32,
    pub(super) ends: u32,
    pub(super) unwinds: u32,
    pub(super) limit: u32,
    pub(super) call_any_hit: u32,
    pub(super) call_intersection: u32,
    pub(super) commit_attributes: u32,
    pub(super) report: u32,
    pub(super) traverse: u32,
    pub(super) record_address: u32,
    pub(super) start: u32,
}

/// Parts of the traversal that the shaders of the pipeline need.
#[derive(Debug, Clone, Copy)]
pub(super) struct Needs {
    pub(super) candidates: bool,
    pub(super) boxes: bool,
    pub(super) object_ray: bool,
    pub(super) matrices: bool,
    pub(super) positions: bool,
    /// Flags that all rays have.
    pub(super) flags_always: u32,
    /// Flags that rays may have.
    pub(super) flags_possible: u32,
}

/// Ids of the specialization constants of the donor.
const HAS_CANDIDATES: u32 = 0;
const HAS_BOXES: u32 = 1;
const FLAGS_ALWAYS: u32 = 2;
const FLAGS_POSSIBLE: u32 = 3;

/// Returns the words of the donor for a traversal.
fn donor_words(traversal: Traversal) -> &'static [u8] {
    match traversal {
        Traversal::Query => include_bytes!("donor/query.spv"),
        #[cfg(feature = "software-ray-query")]
        Traversal::SoftwareGpu => include_bytes!("donor/software_gpu.spv"),
        #[cfg(feature = "software-ray-query")]
        Traversal::SoftwareCpu => include_bytes!("donor/software_cpu.spv"),
        #[cfg(feature = "software-ray-query")]
        Traversal::SoftwareCpuPairs => include_bytes!("donor/software_cpu_pairs.spv"),
        #[cfg(not(feature = "software-ray-query"))]
        _ => &[],
    }
}

impl Donor {
    /// Links the donor. The error is a message.
    pub(super) fn link(linker: &mut Linker, traversal: Traversal, needs: Needs) -> Result<Self, String> {
        let bytes = donor_words(traversal).as_chunks::<4>().0;
        let words: Vec<u32> = bytes.iter().map(|word| u32::from_le_bytes(*word)).collect();
        let mut module = Module::parse(&words)?;
        module.entry_points.clear();
        module.modes.clear();
        let main = module.function_named("main");
        module.functions.retain(|function| Some(function.id()) != main);
        let constants = [
            (HAS_CANDIDATES, needs.candidates.into()),
            (HAS_BOXES, needs.boxes.into()),
            (FLAGS_ALWAYS, needs.flags_always.into()),
            (FLAGS_POSSIBLE, needs.flags_possible.into()),
        ];
        freeze_constants(&mut module, &constants);
        let optional =
            [("ObjectRay", needs.object_ray), ("Matrices", needs.matrices), ("Positions", needs.positions)];
        for (what, _) in optional.iter().filter(|(_, is_needed)| !is_needed) {
            for which in ["lvkCandidate", "lvkCommitted"] {
                empty_function(&mut module, &format!("{which}{what}"));
            }
        }
        let named = |name: &str| module.function_named(name).or_else(|| module.named(name));
        let names: HashMap<&str, Option<u32>> = NAMES.iter().map(|(name, _)| (*name, named(name))).collect();
        let ids = linker.link(module).map_err(|unknown| format!("Op{:?} of the traversal", unknown.0))?;
        let mut donor = Self::default();
        for (name, field) in NAMES {
            let id = names.get(name).copied().flatten().and_then(|id| ids.get(&id));
            *field(&mut donor) = *id.ok_or_else(|| format!("the traversal has no '{name}'"))?;
        }
        Ok(donor)
    }

    /// Returns the variables that tell of a hit.
    pub(super) fn hit_values(&self) -> [u32; 13] {
        [
            self.hit_group,
            self.hit_t,
            self.hit_kind,
            self.hit_instance,
            self.hit_custom_index,
            self.hit_geometry,
            self.hit_primitive,
            self.hit_barycentrics,
            self.hit_object_origin,
            self.hit_object_direction,
            self.hit_object_to_world,
            self.hit_world_to_object,
            self.hit_positions,
        ]
    }
}

/// Makes a function return at once.
fn empty_function(module: &mut Module, name: &str) {
    let Some(id) = module.function_named(name) else { return };
    for function in module.functions.iter_mut().filter(|function| function.id() == id) {
        function.blocks.truncate(1);
        if let Some(block) = function.blocks.first_mut() {
            block.code = vec![super::instruction::Inst::new(Op::Return, &[])];
        }
    }
}

type Field = fn(&mut Donor) -> &mut u32;

/// Names in the donor, with the fields of their ids.
const NAMES: [(&str, Field); 43] = [
    ("lvkPush", |d| &mut d.push),
    ("lvkLaunchId", |d| &mut d.launch_id),
    ("lvkLaunchSize", |d| &mut d.launch_size),
    ("lvkPushConstants", |d| &mut d.push_constants),
    ("lvkRayGenRecord", |d| &mut d.ray_gen_record),
    ("lvkMissRecords", |d| &mut d.miss_records),
    ("lvkHitRecords", |d| &mut d.hit_records),
    ("lvkCallableRecords", |d| &mut d.callable_records),
    ("lvkRayTlas", |d| &mut d.ray_tlas),
    ("lvkRayFlags", |d| &mut d.ray_flags),
    ("lvkRayMask", |d| &mut d.ray_mask),
    ("lvkRayOffset", |d| &mut d.ray_offset),
    ("lvkRayStride", |d| &mut d.ray_stride),
    ("lvkRayMiss", |d| &mut d.ray_miss),
    ("lvkRayOrigin", |d| &mut d.ray_origin),
    ("lvkRayTMin", |d| &mut d.ray_t_min),
    ("lvkRayDirection", |d| &mut d.ray_direction),
    ("lvkRayTMax", |d| &mut d.ray_t_max),
    ("lvkIsHit", |d| &mut d.is_hit),
    ("lvkHitGroup", |d| &mut d.hit_group),
    ("lvkHitT", |d| &mut d.hit_t),
    ("lvkHitKind", |d| &mut d.hit_kind),
    ("lvkHitInstance", |d| &mut d.hit_instance),
    ("lvkHitCustomIndex", |d| &mut d.hit_custom_index),
    ("lvkHitGeometry", |d| &mut d.hit_geometry),
    ("lvkHitPrimitive", |d| &mut d.hit_primitive),
    ("lvkHitBarycentrics", |d| &mut d.hit_barycentrics),
    ("lvkHitObjectOrigin", |d| &mut d.hit_object_origin),
    ("lvkHitObjectDirection", |d| &mut d.hit_object_direction),
    ("lvkHitObjectToWorld", |d| &mut d.hit_object_to_world),
    ("lvkHitWorldToObject", |d| &mut d.hit_world_to_object),
    ("lvkHitPositions", |d| &mut d.hit_positions),
    ("lvkIgnores", |d| &mut d.ignores),
    ("lvkEnds", |d| &mut d.ends),
    ("lvkUnwinds", |d| &mut d.unwinds),
    ("lvkLimit", |d| &mut d.limit),
    ("lvkCallAnyHit", |d| &mut d.call_any_hit),
    ("lvkCallIntersection", |d| &mut d.call_intersection),
    ("lvkCommitAttributes", |d| &mut d.commit_attributes),
    ("lvkReport", |d| &mut d.report),
    ("lvkTraverse", |d| &mut d.traverse),
    ("lvkRecordAddress", |d| &mut d.record_address),
    ("lvkStart", |d| &mut d.start),
];
