//! Sizes of the payloads and hit attributes of ray tracing shaders.

use std::collections::HashMap;

use ::spirv::StorageClass;

use super::parsed::{MAX_NESTING, ParsedModule, Type};

/// Sizes in bytes; 0 if a module declares none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct RayInterface {
    /// Bytes of the largest ray payload, incoming or outgoing.
    pub(crate) payload_bytes: u32,
    /// Bytes of the hit attributes.
    pub(crate) hit_attribute_bytes: u32,
}

impl RayInterface {
    /// Returns the sizes that the module declares. An unknown size counts as the largest.
    pub(crate) fn from_module(module: &ParsedModule) -> Self {
        let mut known = KnownExtents::new();
        let mut largest = |classes: &[StorageClass]| {
            let variables = module.variables.iter();
            let ours =
                variables.filter(|variable| classes.iter().any(|class| *class as u32 == variable.storage));
            let bytes = ours.map(|variable| match module.types.get(&variable.ty) {
                Some(Type::Pointer { target }) => type_bytes(module, *target, &mut known),
                _ => u32::MAX,
            });
            bytes.max().unwrap_or(0)
        };
        Self {
            payload_bytes: largest(&[StorageClass::RayPayloadKHR, StorageClass::IncomingRayPayloadKHR]),
            hit_attribute_bytes: largest(&[StorageClass::HitAttributeKHR]),
        }
    }
}

/// Size and largest scalar of a type, in bytes.
type Extent = (u64, u64);
/// Extents by type and alignment. One list for all variables of a module bounds their time.
type KnownExtents = HashMap<(u32, u64), Extent>;
/// Bytes of the largest scalar there is. Each alignment is one of few.
const MAX_SCALAR_BYTES: u32 = 8;

/// Returns the size of a type without offsets by Vulkan's rule: every member is aligned to the type's largest scalar
/// (`VkRayTracingPipelineInterfaceCreateInfoKHR`).
fn type_bytes(module: &ParsedModule, ty: u32, known: &mut KnownExtents) -> u32 {
    let Some((_, scalar)) = type_extent(module, ty, 1, MAX_NESTING, known) else {
        return u32::MAX;
    };
    let whole = type_extent(module, ty, scalar, MAX_NESTING, known);
    whole.and_then(|(bytes, _)| u32::try_from(bytes).ok()).unwrap_or(u32::MAX)
}

/// Returns the extent with members aligned to `alignment`; `None` for a type without a size.
fn type_extent(
    module: &ParsedModule,
    ty: u32,
    alignment: u64,
    nesting: u32,
    known: &mut KnownExtents,
) -> Option<Extent> {
    const BOOL_BYTES: u64 = 4;
    const ADDRESS_BYTES: u64 = 8;
    if let Some(extent) = known.get(&(ty, alignment)) {
        return Some(*extent);
    }
    let nesting = nesting.checked_sub(1)?;
    let mut of = |ty: u32| type_extent(module, ty, alignment, nesting, known);
    let times = |(bytes, scalar): Extent, count: u32| (bytes.saturating_mul(count.into()), scalar);
    let found = match module.types.get(&ty)? {
        Type::Bool => (BOOL_BYTES, BOOL_BYTES),
        Type::Number { bytes, .. } if *bytes > MAX_SCALAR_BYTES => return None,
        Type::Number { bytes, .. } => (u64::from(*bytes), u64::from(*bytes)),
        Type::Pointer { .. } => (ADDRESS_BYTES, ADDRESS_BYTES),
        Type::Vector { element, count } => times(of(*element)?, *count),
        Type::Matrix { column, count } => times(of(*column)?, *count),
        Type::Array { element, length } => times(of(*element)?, module.constants.get(length)?.value),
        Type::Struct { members } => members.iter().try_fold((0_u64, 0_u64), |(end, scalar), member| {
            let (bytes, own) = of(*member)?;
            let bytes = bytes.checked_next_multiple_of(alignment.max(1))?;
            Some((end.saturating_add(bytes), scalar.max(own)))
        })?,
        Type::RuntimeArray { .. } | Type::Image { .. } | Type::SubpassInput { .. } | Type::Opaque(_) => {
            return None;
        }
    };
    known.insert((ty, alignment), found);
    Some(found)
}

#[cfg(all(test, feature = "glsl"))]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

    use super::*;
    use crate::shader::spirv::reflect::reflect;
    use crate::shader::{CompileFiles, CompileOptions, ShaderModuleDesc, ShaderSource, ShaderStage, compile};

    fn sizes(stage: ShaderStage, text: &str) -> RayInterface {
        let desc = ShaderModuleDesc { stage, source: ShaderSource::Glsl(text), ..Default::default() };
        let words = compile(&desc, &CompileOptions::default(), CompileFiles::default()).unwrap();
        reflect("shader", stage, &words).unwrap().ray_interface
    }

    #[test]
    fn the_largest_payload_counts() {
        let text = "
            struct Deep { bool hit; float t[3]; };
            layout(location = 0) rayPayloadEXT vec3 small;
            layout(location = 1) rayPayloadEXT Deep large[2];
            void main() { small = vec3(1); large[1].hit = true; }";
        let expected = RayInterface { payload_bytes: 32, hit_attribute_bytes: 0 };
        assert_eq!(sizes(ShaderStage::RayGen, text), expected);
    }

    #[test]
    fn members_are_aligned_to_the_largest_scalar() {
        let text = "
            struct Wide { float first; double second; vec3 third; };
            layout(location = 0) rayPayloadInEXT Wide wide;
            hitAttributeEXT vec2 where;
            void main() { wide = Wide(where.x, 2.0LF, vec3(where.y)); }";
        let expected = RayInterface { payload_bytes: 32, hit_attribute_bytes: 8 };
        assert_eq!(sizes(ShaderStage::ClosestHit, text), expected);
    }

    #[test]
    fn other_shaders_have_none() {
        let text = "layout(local_size_x = 1) in; void main() {}";
        assert_eq!(sizes(ShaderStage::Compute, text), RayInterface::default());
    }

    #[test]
    fn numbers_wider_than_any_scalar_count_as_the_largest() {
        let mut module = ParsedModule::default();
        let numbers = crate::format::NumericFormat::Float;
        module.types.insert(1, Type::Number { bytes: 8, numbers });
        module.types.insert(2, Type::Number { bytes: 9, numbers });
        assert_eq!(type_bytes(&module, 1, &mut KnownExtents::new()), 8);
        assert_eq!(type_bytes(&module, 2, &mut KnownExtents::new()), u32::MAX);
    }

    #[test]
    fn a_type_that_contains_itself_counts_as_the_largest() {
        let mut module = ParsedModule::default();
        module.types.insert(1, Type::Struct { members: vec![1, 1] });
        assert_eq!(type_bytes(&module, 1, &mut KnownExtents::new()), u32::MAX);
        assert_eq!(type_bytes(&module, 2, &mut KnownExtents::new()), u32::MAX);
    }
}
