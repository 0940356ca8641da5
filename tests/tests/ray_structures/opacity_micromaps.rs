//! Opacity micromaps: refused without the feature, and built and attached on devices that have it.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    BlasDesc, BlasGeometry, BufferDesc, BufferUsage, Context, Error, Handle, MicromapLimits, OpacityFormat,
    OpacityMap, OpacityMicromapDesc, OpacityMicromapHandle, OpacityState, OptionalFeature, TriangleOpacity,
    Triangles,
};
use lvk_tests::device;

const MAP: OpacityMap<'_> =
    OpacityMap { format: OpacityFormat::TwoStates, level: 0, states: &[OpacityState::Opaque] };
const DESC: OpacityMicromapDesc<'_> =
    OpacityMicromapDesc { maps: &[MAP], triangles: &[TriangleOpacity::Map(0)], debug_name: "leaf" };

/// Builds a BLAS of one triangle with this opacity.
fn build(ctx: &Context, opacity: OpacityMicromapHandle) -> lvk::Result<()> {
    let vertices: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let vertices = ctx.create_buffer(&BufferDesc {
        usage: BufferUsage::ACCEL_INPUT,
        data: Some(bytemuck::cast_slice(&vertices)),
        ..Default::default()
    })?;
    let blas = ctx.create_blas(&BlasDesc {
        geometries: &[BlasGeometry::Triangles(Triangles::packed(*vertices, 3))],
        opacity: &[Some(opacity)],
        debug_name: "tree",
        ..Default::default()
    })?;
    ctx.wait_idle()?;
    drop(blas);
    Ok(())
}

#[test]
fn micromaps_are_typed_errors_without_the_feature() {
    let Some(ctx) = device() else { return };
    if ctx.capabilities().has(OptionalFeature::OpacityMicromaps) {
        return;
    }
    assert_eq!(ctx.capabilities().limits.micromap, MicromapLimits::default());
    let refused = |result: lvk::Result<()>, object: &str| match result {
        Err(Error::Unsupported { what, .. }) => assert!(what.contains(object), "{what}"),
        other => panic!("{other:?}"),
    };
    refused(ctx.create_opacity_micromap(&DESC).map(drop), "opacity micromap 'leaf'");
    refused(ctx.opacity_micromap_sizes(&DESC).map(drop), "opacity micromap 'leaf'");
    if lvk_tests::accel_backend::builds_device_accel_structs(&ctx) || ctx.capabilities().ray_query {
        refused(build(&ctx, OpacityMicromapHandle::from_bits(1)), "opacity micromaps of BLAS 'tree'");
    }
}

#[test]
fn a_blas_keeps_its_micromap_alive() {
    let Some(ctx) = device() else { return };
    if !ctx.capabilities().has(OptionalFeature::OpacityMicromaps) {
        return eprintln!("NOT TESTED, {} has no opacity micromaps", ctx.capabilities().device_name);
    }
    let [bytes, _] = ctx.opacity_micromap_sizes(&DESC).unwrap();
    assert!(bytes > 0);
    let micromap = ctx.create_opacity_micromap(&DESC).unwrap();
    build(&ctx, *micromap).unwrap();
    let handle = *micromap;
    drop(micromap);
    assert!(matches!(build(&ctx, handle), Err(Error::StaleHandle { .. })));
}
