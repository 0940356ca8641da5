//! Descriptions of opacity micromaps, and their encoding as the bytes that a build reads.

use std::collections::BTreeMap;

use ash::vk;

use crate::error::{Error, Result, check_limit};
use crate::gpu::caps::limits::MicromapLimits;

/// States that the micro-triangles of an opacity map may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum OpacityFormat {
    /// Transparent and opaque: one bit for each micro-triangle (`VK_OPACITY_MICROMAP_FORMAT_2_STATE_EXT`).
    TwoStates,
    /// All of [`OpacityState`]: two bits for each micro-triangle (`VK_OPACITY_MICROMAP_FORMAT_4_STATE_EXT`).
    FourStates,
}

impl OpacityFormat {
    fn raw(self) -> u16 {
        let raw = match self {
            Self::TwoStates => vk::OpacityMicromapFormatEXT::TYPE_2_STATE,
            Self::FourStates => vk::OpacityMicromapFormatEXT::TYPE_4_STATE,
        };
        raw.as_raw() as u16
    }

    fn bits(self) -> usize {
        match self {
            Self::TwoStates => 1,
            Self::FourStates => 2,
        }
    }

    fn max_level(self, limits: &MicromapLimits) -> u32 {
        match self {
            Self::TwoStates => limits.max_two_state_level,
            Self::FourStates => limits.max_four_state_level,
        }
    }
}

/// Opacity of a micro-triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OpacityState {
    /// Rays pass.
    Transparent = 0,
    /// Rays hit without an any-hit shader.
    Opaque = 1,
    /// The any-hit shader decides; rays that force two states pass. Not in maps of [`OpacityFormat::TwoStates`].
    UnknownTransparent = 2,
    /// The any-hit shader decides; rays that force two states hit. Not in maps of [`OpacityFormat::TwoStates`].
    UnknownOpaque = 3,
}

/// The opacity of the micro-triangles of a triangle. Several triangles may have the same map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OpacityMap<'a> {
    /// The states that occur.
    pub format: OpacityFormat,
    /// Number of subdivisions: each divides a triangle into four. The largest is in
    /// [`Limits::micromap`](crate::Limits::micromap).
    pub level: u32,
    /// 4 to the power of `level` states, along the space-filling curve of the Vulkan specification (chapter
    /// "Micromap Encoding").
    pub states: &'a [OpacityState],
}

/// The opacity of one triangle of a geometry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TriangleOpacity {
    /// The map with this index in [`OpacityMicromapDesc::maps`].
    Map(u32),
    /// One state for the whole triangle.
    Uniform(OpacityState),
}

impl TriangleOpacity {
    /// Returns the index that a build reads: that of a map, or a special negative one.
    fn index(self) -> i32 {
        match self {
            Self::Map(map) => map as i32,
            Self::Uniform(state) => match state {
                OpacityState::Transparent => vk::OpacityMicromapSpecialIndexEXT::FULLY_TRANSPARENT,
                OpacityState::Opaque => vk::OpacityMicromapSpecialIndexEXT::FULLY_OPAQUE,
                OpacityState::UnknownTransparent => {
                    vk::OpacityMicromapSpecialIndexEXT::FULLY_UNKNOWN_TRANSPARENT
                }
                OpacityState::UnknownOpaque => vk::OpacityMicromapSpecialIndexEXT::FULLY_UNKNOWN_OPAQUE,
            }
            .as_raw(),
        }
    }
}

/// Describes the opacity of the triangles of one geometry, for
/// [`Context::create_opacity_micromap`](crate::Context::create_opacity_micromap).
#[derive(Debug, Clone, Copy)]
pub struct OpacityMicromapDesc<'a> {
    /// The maps. Default: empty.
    pub maps: &'a [OpacityMap<'a>],
    /// The opacity of each triangle, in the order of the geometry. Default: empty.
    pub triangles: &'a [TriangleOpacity],
    /// Name in error messages, validation messages and debuggers. Default: `"opacity micromap"`.
    pub debug_name: &'a str,
}

impl Default for OpacityMicromapDesc<'_> {
    fn default() -> Self {
        Self { maps: &[], triangles: &[], debug_name: "opacity micromap" }
    }
}

/// The encoded maps and indices of a micromap, with the counts that Vulkan asks for.
#[derive(Debug, Clone, Default)]
pub(crate) struct MicromapPlan {
    /// The states of all maps. Each map begins at a byte.
    pub(crate) data: Vec<u8>,
    /// The record of each map.
    pub(crate) records: Vec<vk::MicromapTriangleEXT>,
    /// The index of each triangle.
    pub(crate) indices: Vec<i32>,
    /// Number of maps of each format and level.
    pub(crate) map_counts: Vec<vk::MicromapUsageEXT>,
    /// Number of triangles with a map of each format and level.
    pub(crate) triangle_counts: Vec<vk::MicromapUsageEXT>,
}

impl MicromapPlan {
    /// Checks and encodes a description.
    pub(crate) fn new(desc: &OpacityMicromapDesc<'_>, limits: &MicromapLimits) -> Result<Self> {
        let name = desc.debug_name;
        if desc.maps.is_empty() || desc.triangles.is_empty() {
            return Err(Error::usage(name, "give the micromap at least one map and one triangle"));
        }
        let mut plan = Self::default();
        for (index, map) in desc.maps.iter().enumerate() {
            check_map(name, index, map, limits)?;
            plan.push_map(name, map)?;
        }
        for (index, triangle) in desc.triangles.iter().enumerate() {
            check_triangle(name, index, *triangle, desc.maps.len())?;
        }
        plan.indices = desc.triangles.iter().map(|triangle| triangle.index()).collect();
        plan.map_counts = usage_counts(desc.maps.iter());
        plan.triangle_counts = usage_counts(desc.triangles.iter().filter_map(|triangle| match triangle {
            TriangleOpacity::Map(map) => desc.maps.get(*map as usize),
            TriangleOpacity::Uniform(_) => None,
        }));
        Ok(plan)
    }

    fn push_map(&mut self, name: &str, map: &OpacityMap<'_>) -> Result<()> {
        let start = self.data.len();
        check_limit(name, "size of all maps in bytes", start as u64, u32::MAX.into())?;
        self.records.push(vk::MicromapTriangleEXT {
            data_offset: start as u32,
            subdivision_level: map.level as u16,
            format: map.format.raw(),
        });
        let bits = map.format.bits();
        self.data.resize(start + (map.states.len() * bits).div_ceil(8), 0);
        for (index, state) in map.states.iter().enumerate() {
            let bit = index * bits;
            self.data[start + bit / 8] |= (*state as u8) << (bit % 8);
        }
        Ok(())
    }
}

fn check_map(name: &str, index: usize, map: &OpacityMap<'_>, limits: &MicromapLimits) -> Result<()> {
    let most = map.format.max_level(limits);
    check_limit(name, "subdivision level of a map", map.level.into(), most.into())?;
    let expected = 1_usize.checked_shl(2 * map.level).unwrap_or(usize::MAX);
    if map.states.len() != expected {
        let message = format!(
            "map {index} of level {} has {} states, its level needs {expected}",
            map.level,
            map.states.len()
        );
        return Err(Error::usage(name, message));
    }
    let unknown = |state: &OpacityState| !matches!(state, OpacityState::Transparent | OpacityState::Opaque);
    if map.format == OpacityFormat::TwoStates && map.states.iter().any(unknown) {
        let message = format!("map {index} has an unknown state; give it the format FourStates");
        return Err(Error::usage(name, message));
    }
    Ok(())
}

fn check_triangle(name: &str, index: usize, triangle: TriangleOpacity, maps: usize) -> Result<()> {
    match triangle {
        TriangleOpacity::Map(map) if map as usize >= maps => {
            Err(Error::usage(name, format!("triangle {index} has map {map}, but there are {maps} maps")))
        }
        _ => Ok(()),
    }
}

/// Counts maps by format and level.
fn usage_counts<'a>(maps: impl Iterator<Item = &'a OpacityMap<'a>>) -> Vec<vk::MicromapUsageEXT> {
    let mut counts = BTreeMap::new();
    for map in maps {
        *counts.entry((map.format, map.level)).or_insert(0) += 1;
    }
    let usage = |((format, subdivision_level), count): ((OpacityFormat, u32), u32)| vk::MicromapUsageEXT {
        count,
        subdivision_level,
        format: format.raw().into(),
    };
    counts.into_iter().map(usage).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LIMITS: MicromapLimits = MicromapLimits { max_two_state_level: 3, max_four_state_level: 2 };
    const STATES: [OpacityState; 4] = [
        OpacityState::Transparent,
        OpacityState::Opaque,
        OpacityState::UnknownTransparent,
        OpacityState::UnknownOpaque,
    ];

    fn map() -> impl Strategy<Value = (OpacityFormat, u32, Vec<OpacityState>)> {
        (any::<bool>(), 0..3_u32).prop_flat_map(|(two, level)| {
            let (format, most) =
                if two { (OpacityFormat::TwoStates, 2_usize) } else { (OpacityFormat::FourStates, 4) };
            prop::collection::vec((0..most).prop_map(|state| STATES[state]), 1 << (2 * level))
                .prop_map(move |states| (format, level, states))
        })
    }

    fn error(maps: &[OpacityMap<'_>], triangles: &[TriangleOpacity]) -> String {
        let desc = OpacityMicromapDesc { maps, triangles, debug_name: "leaf" };
        MicromapPlan::new(&desc, &LIMITS).err().map(|error| error.to_string()).unwrap_or_default()
    }

    proptest! {
        #[test]
        fn each_state_lies_where_its_record_says(
            maps in prop::collection::vec(map(), 1..6),
            triangles in prop::collection::vec(0..9_usize, 1..20),
        ) {
            let maps: Vec<_> =
                maps.iter().map(|(format, level, states)| OpacityMap { format: *format, level: *level, states }).collect();
            let triangle = |number: &usize| match maps.get(*number) {
                Some(_) => TriangleOpacity::Map(*number as u32),
                None => TriangleOpacity::Uniform(STATES[number % 4]),
            };
            let triangles: Vec<_> = triangles.iter().map(triangle).collect();
            let desc = OpacityMicromapDesc { maps: &maps, triangles: &triangles, debug_name: "leaf" };
            let plan = MicromapPlan::new(&desc, &LIMITS).unwrap_or_default();
            prop_assert_eq!(plan.records.len(), maps.len());
            for (record, map) in plan.records.iter().zip(&maps) {
                let (bits, mask) = if map.format == OpacityFormat::TwoStates { (1, 1) } else { (2, 3) };
                prop_assert_eq!(u32::from(record.format), bits);
                prop_assert_eq!(u32::from(record.subdivision_level), map.level);
                for (index, state) in map.states.iter().enumerate() {
                    let bit = index * bits as usize;
                    let byte = plan.data[record.data_offset as usize + bit / 8];
                    prop_assert_eq!(byte >> (bit % 8) & mask, *state as u8);
                }
            }
            let counted: u32 = plan.map_counts.iter().map(|usage| usage.count).sum();
            prop_assert_eq!(counted as usize, maps.len());
            let counted: u32 = plan.triangle_counts.iter().map(|usage| usage.count).sum();
            prop_assert_eq!(counted as usize, plan.indices.iter().filter(|index| **index >= 0).count());
            prop_assert_eq!(plan.indices.len(), triangles.len());
        }
    }

    #[test]
    fn uniform_triangles_have_the_special_indices_of_vulkan() {
        let indices = STATES.map(|state| TriangleOpacity::Uniform(state).index());
        assert_eq!(indices, [-1, -2, -3, -4]);
        assert_eq!(TriangleOpacity::Map(7).index(), 7);
    }

    #[test]
    fn impossible_maps_are_errors_that_name_the_micromap_and_the_number() {
        let states = [OpacityState::UnknownOpaque; 4];
        let map = OpacityMap { format: OpacityFormat::FourStates, level: 1, states: &states };
        let first = [TriangleOpacity::Map(0)];
        assert_eq!(error(&[map], &first), "");
        assert!(error(&[], &first).contains("leaf") && error(&[map], &[]).contains("at least one"));
        assert!(
            error(&[map, OpacityMap { level: 0, ..map }], &first).contains("map 1 of level 0 has 4 states")
        );
        assert!(error(&[OpacityMap { level: 3, ..map }], &first).contains("subdivision level"));
        let two = OpacityMap { format: OpacityFormat::TwoStates, ..map };
        assert!(error(&[two], &first).contains("give it the format FourStates"));
        assert!(error(&[map], &[TriangleOpacity::Map(1)]).contains("triangle 0 has map 1"));
        let desc = OpacityMicromapDesc { maps: &[two], triangles: &first, debug_name: "leaf" };
        let refused = MicromapPlan::new(&desc, &LIMITS).unwrap_err();
        assert!(matches!(&refused, Error::InvalidUsage { object, .. } if object == "leaf"), "{refused}");
        let fine = [OpacityMap { level: 3, ..map }];
        let refused = MicromapPlan::new(&OpacityMicromapDesc { maps: &fine, ..desc }, &LIMITS).unwrap_err();
        assert!(matches!(&refused, Error::LimitExceeded { object, .. } if object == "leaf"), "{refused}");
    }
}
