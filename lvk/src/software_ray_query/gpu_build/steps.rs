//! The order of the build kernels, and their parallel phases.

use crate::kernels::Kernel;
use crate::software_ray_query::gpu_build::layout::{
    BuildSource, DIGIT_TOTAL_WORDS, DIGITS, GpuBuildPlan, SORT_BLOCK,
};
use crate::software_ray_query::gpu_build::refit_layout::{GpuRefitPlan, NodeFormat};
use crate::software_ray_query::layout::{LeafKind, MAX_BVH8_DEPTH};

/// Invocations of a workgroup, `kGroup` of `software_ray_query/kernels/build_params.glsl`.
const WORKGROUP_SIZE: u32 = 128;

/// Most workgroups that collapse the nodes of a level: about as many as a large GPU runs at a time.
const MOST_COLLAPSE_GROUPS: u32 = 1024;
/// Invocations of a workgroup that merges clusters, `LVK_GROUP` of `software_ray_query/kernels/cluster_group.glsl`.
const CLUSTER_GROUP_SIZE: u32 = 32;
/// Children of a wide node.
const BVH8_CHILDREN: u32 = 8;
/// Bits of a digit, and passes over the first word of codes. Large builds have at most eight passes.
const DIGIT_BITS: u32 = 8;
const FIRST_WORD_PASSES: u32 = 4;
const MAX_PASSES: u32 = 8;

/// One dispatch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BuildStep {
    /// Steps of a phase run side by side. A phase waits for the previous one.
    pub(crate) phase: u32,
    pub(crate) kernel: Kernel,
    /// Index of the job, or of the first of several jobs with a workgroup each.
    pub(crate) job: u32,
    /// Index of the sort pass or of the level, or the number of jobs of one dispatch.
    pub(crate) pass_or_jobs: u32,
    /// Workgroups of all jobs of the dispatch.
    pub(crate) groups: u32,
    /// Workgroups of each job where one dispatch has several jobs, else 0.
    pub(crate) groups_of_job: u32,
}

/// Returns the steps of builds, sorted by phase. Job `i` is build `order[i]`. Builds by one workgroup come first, by
/// kind, so that one dispatch contains all of a kind.
pub(crate) fn build_steps(builds: &[(&GpuBuildPlan, &BuildSource)]) -> (Vec<usize>, Vec<BuildStep>) {
    let mut order: Vec<usize> = (0..builds.len()).collect();
    let small = |build: &usize| {
        let (plan, source) = builds[*build];
        let kernel = match plan.leaf_kind {
            LeafKind::Instances => Kernel::BuildSmallTlas,
            _ => Kernel::BuildSmallBlas,
        };
        plan.is_small(source.element_count(plan)).then_some(kernel)
    };
    order.sort_by_key(|build| (small(build).is_none(), small(build)));
    let mut steps: Vec<BuildStep> = Vec::new();
    for (job, build) in (0..).zip(&order) {
        match (small(build), steps.last_mut()) {
            (None, _) => {
                let (plan, source) = builds[*build];
                large_build_steps(job, plan, source.element_count(plan), &mut steps);
            }
            (Some(kernel), Some(last)) if last.kernel == kernel => {
                last.groups += 1;
                last.pass_or_jobs += 1;
            }
            (Some(kernel), _) => {
                let step = BuildStep { phase: 0, kernel, job, pass_or_jobs: 1, groups: 1, groups_of_job: 0 };
                steps.push(step);
            }
        }
    }
    let small_blas = steps.iter().find(|step| step.kernel == Kernel::BuildSmallBlas).copied();
    steps.extend(small_blas.map(|step| BuildStep { phase: 2, kernel: Kernel::BuildSmallWide, ..step }));
    let small_count = order.iter().filter(|build| small(build).is_some()).count();
    let counts = order[..small_count].iter().map(|build| builds[*build].1.element_count(builds[*build].0));
    steps.extend(counts.max().map(|most| cluster_step(1, 0, small_count as u32, most)));
    steps.sort_by_key(|step| (step.phase, step.kernel));
    (order, steps)
}

fn large_build_steps(job: u32, plan: &GpuBuildPlan, count: u32, steps: &mut Vec<BuildStep>) {
    let groups = |invocations: u32| invocations.div_ceil(WORKGROUP_SIZE).max(1);
    let mut add = |phase, kernel, groups| {
        steps.push(BuildStep { phase, kernel, job, pass_or_jobs: 0, groups, groups_of_job: 0 });
    };
    let read = match plan.leaf_kind {
        LeafKind::Instances => Kernel::BuildInstances,
        _ => Kernel::BuildPrimitives,
    };
    add(0, Kernel::BuildReset, 1);
    add(1, read, count.div_ceil(SORT_BLOCK).max(1));
    add(2, Kernel::BuildCodes, groups(count.max(DIGIT_TOTAL_WORDS)));
    steps.extend(sort_steps(job, count, plan.low_bits));
    steps.push(cluster_step(3 + MAX_PASSES * 3, job, 1, count));
    if plan.leaf_kind != LeafKind::Instances {
        steps.extend(wide_steps(4 + MAX_PASSES * 3, job, plan));
    }
}

/// Returns the step that builds the binary trees of `jobs` jobs, from a job on, of at most `count` primitives each.
pub(crate) fn cluster_step(phase: u32, job: u32, jobs: u32, count: u32) -> BuildStep {
    let groups_of_job = count.div_ceil(CLUSTER_GROUP_SIZE).max(1);
    let groups = groups_of_job * jobs;
    BuildStep { phase, kernel: Kernel::BuildClusters, job, pass_or_jobs: jobs, groups, groups_of_job }
}

/// Returns the steps from a binary tree to the BLAS, starting at a phase. Only the last two steps know whether the wide
/// nodes fit.
pub(crate) fn wide_steps(phase: u32, job: u32, plan: &GpuBuildPlan) -> Vec<BuildStep> {
    let groups = |invocations: u32| invocations.div_ceil(WORKGROUP_SIZE).max(1);
    let step = |nth, kernel, level, invocations| BuildStep {
        phase: phase + nth,
        kernel,
        job,
        pass_or_jobs: level,
        groups: groups(invocations),
        groups_of_job: 0,
    };
    // Eight times as many nodes as in the level above, up to the capacity, with eight invocations each. Only the GPU knows how
    // many there are, and a level near the end has few, so workgroups go over many nodes.
    let most = MOST_COLLAPSE_GROUPS * (WORKGROUP_SIZE / BVH8_CHILDREN);
    let nodes =
        |level: u32| 1_u32.checked_shl(3 * level).unwrap_or(u32::MAX).min(plan.wide_capacity).min(most);
    let levels = if plan.wide_capacity > 0 { MAX_BVH8_DEPTH as u32 } else { 0 };
    let written = plan.capacity.max(plan.geometry_count).max(plan.vertex_count);
    let mut steps: Vec<_> =
        (0..levels).map(|level| step(level, Kernel::Collapse, level, nodes(level) * BVH8_CHILDREN)).collect();
    steps.push(step(levels, Kernel::WriteBlas, 0, written));
    steps.push(step(levels + 1, Kernel::FitPacked, 0, plan.wide_capacity));
    steps
}

/// Returns the steps that sort the keys of a build, the low words first.
pub(crate) fn sort_steps(job: u32, count: u32, low_bits: u32) -> Vec<BuildStep> {
    let blocks = count.div_ceil(SORT_BLOCK).max(1);
    let passes = low_bits.div_ceil(DIGIT_BITS) + FIRST_WORD_PASSES;
    let pass = |pass_or_jobs| {
        let step = |nth, kernel, groups| BuildStep {
            phase: 3 + pass_or_jobs * 3 + nth,
            kernel,
            job,
            pass_or_jobs,
            groups,
            groups_of_job: 0,
        };
        [
            step(0, Kernel::SortCount, blocks),
            step(1, Kernel::SortScan, DIGITS),
            step(2, Kernel::SortScatter, blocks),
        ]
    };
    (0..passes).flat_map(pass).collect()
}

/// Returns the steps of refits, sorted by phase; job `i` is refit `i`.
pub(crate) fn refit_steps(refits: &[GpuRefitPlan]) -> Vec<BuildStep> {
    let mut steps = Vec::new();
    for (job, plan) in (0..).zip(refits) {
        let written = plan.primitive_count.max(plan.node_count);
        let fit = match plan.format {
            NodeFormat::Wide => Kernel::FitWide,
            NodeFormat::Binary => Kernel::FitBinary,
        };
        for (phase, kernel, invocations) in [(0, Kernel::RefitLeaves, written), (1, fit, plan.node_count)] {
            let groups = invocations.div_ceil(WORKGROUP_SIZE).max(1);
            steps.push(BuildStep { phase, kernel, job, pass_or_jobs: 0, groups, groups_of_job: 0 });
        }
    }
    steps.sort_by_key(|step| (step.phase, step.kernel));
    steps
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::software_ray_query::gpu_build::layout::BlasShape;

    fn plan(primitive_count: u32) -> GpuBuildPlan {
        let shape =
            BlasShape { leaf_kind: LeafKind::Triangles, primitive_count, vertex_count: 0, geometry_count: 1 };
        GpuBuildPlan::blas("s", &shape).unwrap()
    }

    proptest! {
        #[test]
        fn every_build_has_its_steps_in_order(counts in prop::collection::vec(0..10_000_u32, 0..20)) {
            let plans: Vec<_> = counts.iter().map(|count| plan(*count)).collect();
            let source = BuildSource::Geometries(Vec::new());
            let builds: Vec<_> = plans.iter().map(|plan| (plan, &source)).collect();
            let (order, steps) = build_steps(&builds);
            let mut sorted = order.clone();
            sorted.sort_unstable();
            prop_assert!(sorted.into_iter().eq(0..counts.len()));
            prop_assert!(steps.is_sorted_by_key(|step| step.phase));
            for (job, build) in order.iter().enumerate() {
                let covers = |step: &&BuildStep| match step.kernel {
                    Kernel::BuildSmallBlas | Kernel::BuildSmallWide => job < step.groups as usize,
                    Kernel::BuildClusters => (step.job..step.job + step.pass_or_jobs).contains(&(job as u32)),
                    _ => step.job as usize == job,
                };
                let own: Vec<_> = steps.iter().filter(covers).collect();
                let expected = match counts[*build] {
                    0..=2048 => 3,
                    2049..=4096 => 4 + 4 * 3 + 34,
                    _ => 4 + 3 * (plans[*build].low_bits.div_ceil(8) as usize + 4) + 34,
                };
                prop_assert_eq!(own.len(), expected);
            }
        }
    }
}
