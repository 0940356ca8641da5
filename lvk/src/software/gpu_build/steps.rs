//! Which kernels run in which order, and which of them side by side.

use super::plan::{BuildSource, GpuBuildPlan, SORT_BLOCK};
use super::refit_plan::{GpuRefitPlan, NodeFormat};
use crate::kernel::Kernel;

/// Invocations of a workgroup, `kGroup` of `kernel/build/job.glsl`.
const GROUP: u32 = 128;
const MOST_PASSES: u32 = 16;

/// One dispatch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Step {
    /// Steps of a phase run side by side; a phase waits for the one before.
    pub(crate) phase: u32,
    pub(crate) kernel: Kernel,
    /// Which job, or the first of several that a workgroup each works on.
    pub(crate) job: u32,
    pub(crate) sort_pass: u32,
    pub(crate) groups: u32,
}

/// The steps of builds, by phases. Job `i` is build `order[i]`: those that one workgroup makes come first, so that one
/// dispatch has them all.
pub(crate) fn build_steps(builds: &[(&GpuBuildPlan, &BuildSource)]) -> (Vec<usize>, Vec<Step>) {
    let mut order: Vec<usize> = (0..builds.len()).collect();
    order.sort_by_key(|build| !builds[*build].0.is_small());
    let small = builds.iter().filter(|(plan, _)| plan.is_small()).count() as u32;
    let mut steps = Vec::new();
    if small > 0 {
        steps.push(Step { phase: 0, kernel: Kernel::BuildSmall, job: 0, sort_pass: 0, groups: small });
    }
    for (job, build) in (0..).zip(&order).skip(small as usize) {
        let (plan, source) = builds[*build];
        large_build(job, plan, source.count(plan), &mut steps);
    }
    steps.sort_by_key(|step| (step.phase, step.kernel));
    (order, steps)
}

fn large_build(job: u32, plan: &GpuBuildPlan, count: u32, steps: &mut Vec<Step>) {
    let groups = |invocations: u32| invocations.div_ceil(GROUP).max(1);
    let mut add =
        |phase, kernel, sort_pass, groups| steps.push(Step { phase, kernel, job, sort_pass, groups });
    let read = match plan.leaf_kind {
        super::job::LeafKind::Instances => Kernel::BuildInstances,
        _ => Kernel::BuildPrimitives,
    };
    add(0, Kernel::BuildReset, 0, 1);
    add(1, read, 0, groups(count));
    add(2, Kernel::BuildCodes, 0, groups(count));
    let blocks = count.div_ceil(SORT_BLOCK).max(1);
    for pass in 0..if plan.long_codes { MOST_PASSES } else { MOST_PASSES / 2 } {
        add(3 + pass * 3, Kernel::SortCount, pass, blocks);
        add(4 + pass * 3, Kernel::SortScan, pass, 1);
        add(5 + pass * 3, Kernel::SortScatter, pass, blocks);
    }
    let written = count.max(plan.geometry_count).max(plan.vertex_count);
    add(3 + MOST_PASSES * 3, Kernel::BuildTree, 0, groups(written));
    add(4 + MOST_PASSES * 3, Kernel::FitBinary, 0, groups(plan.node_capacity()));
}

/// The steps of refits, by phases; job `i` is refit `i`.
pub(crate) fn refit_steps(refits: &[GpuRefitPlan]) -> Vec<Step> {
    let mut steps = Vec::new();
    for (job, plan) in (0..).zip(refits) {
        let written = plan.primitive_count.max(plan.node_count).max(plan.vertex_count);
        let fit = match plan.format {
            NodeFormat::Wide => Kernel::FitWide,
            NodeFormat::Binary => Kernel::FitBinary,
        };
        for (phase, kernel, invocations) in [(0, Kernel::RefitLeaves, written), (1, fit, plan.node_count)] {
            let groups = invocations.div_ceil(GROUP).max(1);
            steps.push(Step { phase, kernel, job, sort_pass: 0, groups });
        }
    }
    steps.sort_by_key(|step| (step.phase, step.kernel));
    steps
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::job::LeafKind;
    use super::super::plan::BlasShape;
    use super::*;

    fn plan(primitive_count: u32) -> GpuBuildPlan {
        let shape = BlasShape {
            leaf_kind: LeafKind::Triangles,
            primitive_count,
            vertex_count: 0,
            geometry_count: 1,
            leaf_size: 2,
            refit: true,
        };
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
                let covers = |step: &&Step| match step.kernel {
                    Kernel::BuildSmall => job < step.groups as usize,
                    _ => step.job as usize == job,
                };
                let own: Vec<_> = steps.iter().filter(covers).collect();
                let expected = match counts[*build] {
                    0..=2048 => 1,
                    2049..=4096 => 5 + 8 * 3,
                    _ => 5 + 16 * 3,
                };
                prop_assert_eq!(own.len(), expected);
            }
        }
    }
}
