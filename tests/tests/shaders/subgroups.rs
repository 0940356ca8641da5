//! Compute pipelines that choose the size of their subgroups, and that have only full subgroups.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::ash::vk::ShaderStageFlags;
use lvk::{
    ComputePipelineDesc, ComputePipelineHandle, Context, DeviceProfile, Error, FeatureSet, Holder,
    OptionalFeature, ShaderStage, SpecializationConstant, SpecializationValue,
};
use lvk_tests::compute::{module, run_on_words};
use lvk_tests::{device, without_software};

/// Each workgroup writes its subgroup size, its count of subgroups, and the invocations of its fullest and emptiest
/// subgroup. The size along x is the specialisation constant 3.
const SIZES: &str = "
    layout(local_size_x_id = 3, local_size_y = 2) in;
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; };
    shared uint most;
    shared uint least;
    void main() {
        if (gl_LocalInvocationIndex == 0) { most = 0; least = 1000; }
        barrier();
        uint running = subgroupAdd(1);
        atomicMax(most, running);
        atomicMin(least, running);
        barrier();
        if (gl_LocalInvocationIndex == 0) {
            words.at[0] = gl_SubgroupSize;
            words.at[1] = gl_NumSubgroups;
            words.at[2] = most;
            words.at[3] = least;
        }
    }";

fn pipeline(
    ctx: &Context,
    width: u32,
    required_subgroup_size: Option<u32>,
    full_subgroups: bool,
) -> lvk::Result<Holder<ComputePipelineHandle>> {
    let module = module(ctx, ShaderStage::Compute, SIZES);
    ctx.create_compute_pipeline(&ComputePipelineDesc {
        module: Some(*module),
        specialization: &[SpecializationConstant { id: 3, value: SpecializationValue::U32(width) }],
        required_subgroup_size,
        full_subgroups,
        layouts: &[],
        debug_name: "sizes",
    })
}

/// Returns the subgroup size, the count of subgroups, and the invocations of the fullest and emptiest subgroup.
fn sizes(ctx: &Context, pipeline: ComputePipelineHandle) -> [u32; 4] {
    run_on_words(ctx, pipeline, &[0; 4]).try_into().unwrap()
}

/// True if compute pipelines of the device may require a size. Prints a line if not.
fn chooses_size(ctx: &Context) -> bool {
    let caps = ctx.capabilities();
    let chooses = caps.has(OptionalFeature::SubgroupSizeControl)
        && caps.limits.subgroup.required_size_stages.contains(ShaderStageFlags::COMPUTE);
    if !chooses {
        eprintln!("NOT TESTED, {} does not let compute pipelines choose", caps.device_name);
    }
    chooses
}

#[test]
fn the_device_reports_its_sizes() {
    let Some(ctx) = device() else { return };
    let limits = ctx.capabilities().limits.subgroup;
    assert!(limits.min_size <= limits.size && limits.size <= limits.max_size, "{limits:?}");
    for size in [limits.size, limits.min_size, limits.max_size] {
        assert!(size.is_power_of_two(), "{limits:?}");
    }
    let controls = ctx.capabilities().has(OptionalFeature::SubgroupSizeControl);
    assert_eq!(limits.max_workgroup_subgroups > 0, controls, "{limits:?}");
}

#[test]
fn subgroups_have_the_size_that_a_pipeline_requires() {
    let Some(ctx) = device() else { return };
    if !chooses_size(&ctx) {
        return;
    }
    let limits = ctx.capabilities().limits.subgroup;
    let mut size = limits.min_size;
    while size <= limits.max_size {
        for full in [false, true] {
            let pipeline = pipeline(&ctx, 2 * size, Some(size), full).unwrap();
            assert_eq!(sizes(&ctx, *pipeline), [size, 4, size, size], "full: {full}");
        }
        size *= 2;
    }
}

#[test]
fn full_subgroups_have_no_gaps() {
    let Some(ctx) = device() else { return };
    if !ctx.capabilities().has(OptionalFeature::ComputeFullSubgroups) {
        eprintln!("NOT TESTED, {} has no full subgroups", ctx.capabilities().device_name);
        return;
    }
    let width = ctx.capabilities().limits.subgroup.max_size;
    let [size, count, most, least] = sizes(&ctx, *pipeline(&ctx, width, None, true).unwrap());
    assert_eq!([size * count, most, least], [2 * width, size, size]);
}

#[test]
fn wrong_sizes_are_refused_by_name_and_limit() {
    let Some(ctx) = device() else { return };
    if !chooses_size(&ctx) {
        return;
    }
    let limits = ctx.capabilities().limits.subgroup;
    let (least, most) = (limits.min_size, limits.max_size);
    let refusal = |width, size, full| pipeline(&ctx, width, size, full).unwrap_err();
    for size in [0, 3, least / 2] {
        let error = refusal(least, Some(size), false);
        assert!(matches!(&error, Error::InvalidUsage { object, .. } if object == "sizes"), "{size}: {error}");
    }
    match refusal(most, Some(2 * most), false) {
        Error::LimitExceeded { object, what, requested, limit, .. } => {
            assert_eq!((&*object, requested, limit), ("sizes", (2 * most).into(), most.into()));
            assert!(what.contains("maxSubgroupSize"), "{what}");
        }
        other => unreachable!("{other}"),
    }
    // The width that counts is that of the specialisation constant.
    for (size, width) in [(Some(least), least + 1), (None, most + 1)] {
        let error = refusal(width, size, true);
        let told = error.to_string();
        assert!(
            matches!(error, Error::InvalidUsage { .. }) && told.contains(&format!("not {width}")),
            "{told}"
        );
    }
    let width = ctx.capabilities().limits.max_workgroup_size[0];
    if u64::from(width) * 2 > u64::from(least) * u64::from(limits.max_workgroup_subgroups)
        && width * 2 <= ctx.capabilities().limits.max_workgroup_invocations
    {
        let error = refusal(width, Some(least), false);
        assert!(error.to_string().contains("maxComputeWorkgroupSubgroups"), "{error}");
    }
}

#[test]
fn a_profile_hides_the_choice() {
    let hidden = [OptionalFeature::SubgroupSizeControl, OptionalFeature::ComputeFullSubgroups];
    let hidden: FeatureSet = hidden.into_iter().collect();
    let profile = DeviceProfile { name: "one size".into(), hidden, ..DeviceProfile::default() };
    let Some(ctx) = without_software(|desc| desc.profile = Some(&profile)) else { return };
    let limits = ctx.capabilities().limits.subgroup;
    assert_eq!((limits.min_size, limits.max_size), (limits.size, limits.size));
    assert!(limits.required_size_stages.is_empty());
    for (size, full, name) in
        [(Some(limits.size), false, "subgroupSizeControl"), (None, true, "computeFullSubgroups")]
    {
        match pipeline(&ctx, limits.size, size, full) {
            Err(Error::Unsupported { what, why }) => {
                assert!(
                    what.contains("'sizes'") && why.contains(name) && why.contains("one size"),
                    "{what}: {why}"
                );
            }
            other => unreachable!("{other:?}"),
        }
    }
    let _ = pipeline(&ctx, limits.size, None, false).unwrap();
}
