//! Culling and opacity rules: mask and flags of a ray, flags of geometry and instance.

use crate::ray_tracer::{
    CULL_BACK, CULL_FRONT, CULL_NO_OPAQUE, CULL_OPAQUE, How, NO_OPAQUE, OPAQUE, SKIP_TRIANGLES,
};

/// A ray's cull mask and flags, as Vulkan numbers them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rules {
    /// Cull mask.
    pub mask: u8,
    /// Ray flags.
    pub flags: u32,
}

/// Flags of a geometry in an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Surface {
    /// The geometry is opaque.
    pub(super) is_opaque: bool,
    /// Opacity that the instance forces.
    pub(super) force_opaque: Option<bool>,
    /// True if the instance disables face culling.
    pub(super) no_cull: bool,
}

impl Rules {
    /// Returns the rules of a mask without flags.
    pub fn of_mask(mask: u8) -> Self {
        Self { mask, flags: 0 }
    }

    /// True if hits of the surface need no any-hit shader.
    pub(super) fn is_opaque(self, surface: Surface) -> bool {
        match self.flags & (OPAQUE | NO_OPAQUE) {
            OPAQUE => true,
            NO_OPAQUE => false,
            _ => surface.force_opaque.unwrap_or(surface.is_opaque),
        }
    }

    /// True if rays may hit this side of a triangle of the surface.
    pub(super) fn admits(self, surface: Surface, is_front: bool) -> bool {
        let side = if is_front { CULL_FRONT } else { CULL_BACK };
        let kind = if self.is_opaque(surface) { CULL_OPAQUE } else { CULL_NO_OPAQUE };
        let has = |flag| self.flags & flag != 0;
        !has(SKIP_TRIANGLES) && !has(kind) && (surface.no_cull || !has(side))
    }
}

impl From<How> for Rules {
    fn from(how: How) -> Self {
        Self { mask: how.mask, flags: how.flags }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rules(flags: u32) -> Rules {
        Rules { mask: 0xff, flags }
    }

    #[test]
    fn the_ray_overrules_the_instance_and_the_instance_the_geometry() {
        let surface = |is_opaque, force_opaque| Surface { is_opaque, force_opaque, no_cull: false };
        assert!(rules(0).is_opaque(surface(true, None)) && !rules(0).is_opaque(surface(false, None)));
        assert!(rules(0).is_opaque(surface(false, Some(true))));
        assert!(!rules(0).is_opaque(surface(true, Some(false))));
        assert!(rules(OPAQUE).is_opaque(surface(false, Some(false))));
        assert!(!rules(NO_OPAQUE).is_opaque(surface(true, Some(true))));
    }

    #[test]
    fn culling_goes_by_side_by_kind_and_by_shape() {
        let solid = Surface { is_opaque: true, ..Surface::default() };
        assert!(rules(CULL_BACK).admits(solid, true) && !rules(CULL_BACK).admits(solid, false));
        assert!(!rules(CULL_FRONT).admits(solid, true) && rules(CULL_FRONT).admits(solid, false));
        let never = Surface { no_cull: true, ..solid };
        assert!(rules(CULL_FRONT).admits(never, true) && rules(CULL_BACK).admits(never, false));
        assert!(!rules(CULL_OPAQUE).admits(never, true) && rules(CULL_NO_OPAQUE).admits(never, true));
        assert!(!rules(SKIP_TRIANGLES).admits(never, true));
    }
}
