//! The shaders of a pipeline in the linked module, and which of them wait for rays.

use std::collections::{HashMap, HashSet};

use ::spirv::Op;

use super::attributes::check_barycentrics;
use super::block_pointers::read_block_by_address;
use super::donor::{Donor, Needs};
use super::instruction::Inst;
use super::judges::rewrite_judge;
use super::linker::Linker;
use super::module::{Function, functions_that_reach};
use super::passed::Passed;
use super::push_constants::merge_push_constants;
use super::sampled_images::repeat_sampled_images;
use super::stage::{Shader, link_stage};
use super::structure_arguments::pass_indices;
use super::switches::narrow_switches;
use super::traces::{TraceVariables, hide_remap_table, is_trace, rewrite_traces, skips_closest_hit};
use super::{HitShaders, Lowering, LoweringError, Traversal};
use crate::shader::ShaderStage;

/// The linked shaders, by their index in [`Lowering::modules`]; shaders that no group of the pipeline names are left out.
pub(super) struct Shaders {
    pub(super) linked: HashMap<usize, Shader>,
    /// Variables with the addresses of the shaders' records.
    pub(super) records: HashMap<usize, u32>,
    /// Functions that wait for a ray or a callable shader, themselves or through calls.
    pub(super) waiting: HashSet<u32>,
    /// True if callable shaders call others.
    pub(super) callables_wait: bool,
    /// True if rays that run no closest-hit shader are traced where they stand.
    traces_shadows_in_place: bool,
}

const RAY_FLAG_OPAQUE: u32 = 0x1;
const RAY_FLAG_NO_OPAQUE: u32 = 0x2;
/// Flags that tell opaque geometries from others.
const RAY_FLAGS_OF_OPACITY: u32 = RAY_FLAG_NO_OPAQUE | 0x40 | 0x80;

impl Shaders {
    /// Links all shaders that the launch may run.
    pub(super) fn link(linker: &mut Linker, lowering: &Lowering<'_>) -> Result<Self, LoweringError> {
        let hits = lowering.hit.iter().flat_map(|HitShaders { closest_hit, any_hit, intersection }| {
            [closest_hit, any_hit, intersection].into_iter().flatten().copied()
        });
        let all = [lowering.ray_gen].into_iter().chain(lowering.miss.iter().copied()).chain(hits);
        let mut linked = HashMap::new();
        for index in all.chain(lowering.callable.iter().copied()) {
            let Some(module) = lowering.modules.get(index).filter(|_| !linked.contains_key(&index)) else {
                continue;
            };
            let shader = link_stage(linker, module)
                .map_err(|message| LoweringError { shader: module.name.to_owned(), message })?;
            let is_of_triangles = |group: &HitShaders| {
                group.intersection.is_none() && [group.closest_hit, group.any_hit].contains(&Some(index))
            };
            if let Some(attributes) = shader.attributes
                && lowering.hit.iter().any(is_of_triangles)
            {
                check_barycentrics(linker, attributes)
                    .map_err(|message| LoweringError { shader: module.name.to_owned(), message })?;
            }
            repeat_sampled_images(linker, &shader.functions);
            narrow_switches(linker, &shader.functions);
            pass_indices(linker, &shader.functions);
            linked.insert(index, shader);
        }
        let callables_wait = lowering.callable.iter().any(|index| {
            linked.get(index).is_some_and(|shader: &Shader| {
                contains(linker, shader, |inst| inst.op == Op::ExecuteCallableKHR)
            })
        });
        Ok(Self {
            linked,
            records: HashMap::new(),
            waiting: HashSet::new(),
            callables_wait,
            traces_shadows_in_place: false,
        })
    }

    /// Returns what the shaders need of the traversal.
    pub(super) fn needs(&self, linker: &Linker, lowering: &Lowering<'_>) -> Needs {
        use ::spirv::BuiltIn;
        let reads = |wanted: &[BuiltIn]| {
            let builtins = self.linked.values().flat_map(|shader| &shader.builtins);
            builtins.into_iter().any(|(builtin, _)| wanted.contains(builtin))
        };
        let boxes = lowering.hit.iter().any(|group| group.intersection.is_some());
        let judges = lowering.hit.iter().any(|group| group.any_hit.is_some());
        // Flags that are no constant may be any.
        let flags = self.ray_flags(linker);
        let always = flags.iter().fold(u32::MAX, |all, flags| all & flags.unwrap_or(0));
        let possible = flags.iter().fold(0, |all, flags| all | flags.unwrap_or(u32::MAX));
        let all_opaque = always & RAY_FLAG_OPAQUE != 0;
        let candidates = boxes || possible & RAY_FLAGS_OF_OPACITY != 0 || (judges && !all_opaque);
        Needs {
            candidates,
            boxes,
            flags_always: always & possible | if candidates { 0 } else { RAY_FLAG_OPAQUE },
            flags_possible: possible,
            object_ray: reads(&[BuiltIn::ObjectRayOriginKHR, BuiltIn::ObjectRayDirectionKHR]),
            matrices: reads(&[BuiltIn::ObjectToWorldKHR, BuiltIn::WorldToObjectKHR]),
            positions: reads(&[BuiltIn::HitTriangleVertexPositionsKHR]),
        }
    }

    /// Returns the flags of all traces; `None` for flags that are no constant.
    fn ray_flags(&self, linker: &Linker) -> Vec<Option<u32>> {
        let functions = self.linked.values().flat_map(|shader| &shader.functions);
        let code = functions.filter_map(|id| linker.function(*id)).flat_map(|function| function.code());
        let flags = |inst: &Inst| {
            let constant = linker.global(inst.operand(1)).filter(|inst| inst.op == Op::Constant);
            constant.map(|inst| inst.operand(2))
        };
        code.filter(|inst| is_trace(inst)).map(flags).collect()
    }

    /// Rewrites the code of all shaders for the linked traversal.
    pub(super) fn rewrite(
        &mut self,
        linker: &mut Linker,
        lowering: &Lowering<'_>,
        variables: &mut TraceVariables<'_>,
        candidate_attributes: &mut Passed,
    ) -> Result<(), LoweringError> {
        let donor: Donor = *variables.donor;
        let mut indices: Vec<usize> = self.linked.keys().copied().collect();
        indices.sort_unstable();
        let shaders: Vec<&Shader> = indices.iter().filter_map(|index| self.linked.get(index)).collect();
        merge_push_constants(linker, lowering, &donor, &shaders)
            .map_err(|(shader, message)| LoweringError { shader, message })?;
        for index in indices {
            let shader = &self.linked[&index];
            let failed = |message| LoweringError { shader: shader.name.clone(), message };
            if let Some(block) = shader.record {
                let pair = linker.uvec2();
                let address = linker.private(pair);
                read_block_by_address(linker, &shader.functions, block, address).map_err(failed)?;
                self.records.insert(index, address);
            }
            let stage = lowering.modules[index].stage;
            if matches!(stage, ShaderStage::AnyHit | ShaderStage::Intersection) {
                rewrite_judge(linker, &donor, shader, candidate_attributes).map_err(failed)?;
            }
            for id in &shader.functions {
                let Some(mut function) = linker.take_function(*id) else { continue };
                if lowering.traversal != Traversal::Query {
                    hide_remap_table(linker, &mut function, &shader.tlas_tables);
                }
                let result = rewrite_traces(linker, variables, &mut function);
                linker.module.functions.push(function);
                result.map_err(failed)?;
            }
        }
        let waiting = |shaders: &Self| {
            functions_that_reach(linker.module.functions.iter(), |inst| shaders.is_wait(inst))
        };
        self.waiting = waiting(self);
        self.traces_shadows_in_place = self.can_trace_shadows_in_place(linker, lowering);
        self.waiting = waiting(self);
        Ok(())
    }

    /// True if rays that run no closest-hit shader are traced where they stand.
    ///
    /// Compilers for CPUs run every piece of code that any of eight rays needs, so few pieces and more copies of the
    /// traversal are faster. SwiftShader takes ten times as long to compile the copies.
    fn can_trace_shadows_in_place(&self, linker: &Linker, lowering: &Lowering<'_>) -> bool {
        const MOST_SHADOW_TRACES: usize = 4;
        let is_cpu = matches!(lowering.traversal, Traversal::SoftwareCpu | Traversal::SoftwareCpuPairs);
        let places =
            linker.module.functions.iter().flat_map(Function::code).filter(|inst| skips_closest_hit(inst));
        is_cpu
            && !lowering.is_for_swiftshader
            && places.count() <= MOST_SHADOW_TRACES
            && !self.misses_wait(lowering)
    }

    /// True for an instruction at which a function waits.
    pub(super) fn is_wait(&self, inst: &Inst) -> bool {
        is_trace(inst) && !(self.traces_shadows_in_place && skips_closest_hit(inst))
            || (self.callables_wait && inst.op == Op::ExecuteCallableKHR)
    }

    /// True if the shader waits for rays or callable shaders.
    pub(super) fn waits(&self, index: usize) -> bool {
        self.linked.get(&index).is_some_and(|shader| self.waiting.contains(&shader.entry))
    }

    /// True if miss shaders wait for rays or callable shaders.
    pub(super) fn misses_wait(&self, lowering: &Lowering<'_>) -> bool {
        lowering.miss.iter().any(|index| self.waits(*index))
    }

    /// Returns the number of places at which a function and those it calls wait, as if all were inlined.
    pub(super) fn wait_count(&self, linker: &Linker, function: u32) -> u32 {
        let mut counts: HashMap<u32, u32> = HashMap::new();
        // Each round counts functions whose callees were counted in the round before.
        for _ in 0..=self.waiting.len() {
            let of = |inst: &Inst| match inst.op {
                Op::FunctionCall => counts.get(&inst.operand(2)).copied().unwrap_or(0),
                _ => u32::from(self.is_wait(inst)),
            };
            let functions = self.waiting.iter().filter_map(|id| linker.function(*id));
            let count = |function: &Function| function.code().map(of).fold(0, u32::saturating_add);
            counts = functions.map(|function| (function.id(), count(function))).collect();
        }
        counts.get(&function).copied().unwrap_or(0)
    }
}

fn contains(linker: &Linker, shader: &Shader, is_it: fn(&Inst) -> bool) -> bool {
    let functions = shader.functions.iter().filter_map(|id| linker.function(*id));
    functions.into_iter().any(|function| function.code().any(is_it))
}
