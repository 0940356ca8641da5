//! Shaders that reorder invocations: refused by name where the device lacks the feature, accepted where it has it.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{Error, OptionalFeature, ShaderModuleDesc, ShaderSource, ShaderStage};
use lvk_tests::device;

/// A ray generation shader that reorders by a hint, in the words of one of the extensions.
fn source(vendor: &str) -> String {
    format!(
        "#extension GL_{vendor}_shader_invocation_reorder : require
         void main() {{ reorderThread{vendor}(gl_LaunchIDEXT.x & 1, 1); }}"
    )
}

#[test]
fn shaders_need_the_feature_of_their_extension() {
    let Some(ctx) = device() else { return };
    let cases = [("EXT", OptionalFeature::InvocationReorder), ("NV", OptionalFeature::InvocationReorderNv)];
    for (vendor, feature) in cases {
        let text = source(vendor);
        let desc = ShaderModuleDesc {
            stage: ShaderStage::RayGen,
            source: ShaderSource::Glsl(&text),
            debug_name: "sorted rays",
            ..Default::default()
        };
        let made = ctx.create_shader_module(&desc).map(drop);
        if ctx.capabilities().has(feature) {
            made.unwrap();
            continue;
        }
        eprintln!("NOT TESTED, {} has no {}", ctx.capabilities().device_name, feature.vulkan_name());
        match made {
            Err(Error::Unsupported { what, .. }) => assert!(what.contains("sorted rays"), "{what}"),
            other => panic!("{vendor}: {other:?}"),
        }
        assert!(
            !ctx.capabilities().limits.reorders_invocations
                || cases.iter().any(|(_, one)| ctx.capabilities().has(*one))
        );
    }
}
