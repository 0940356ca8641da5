//! The pixels and layers that a render pass covers.

use ash::vk;

use super::desc::RenderPassDesc;
use crate::error::{Error, Result, check_limit};
use crate::gpu::Gpu;

/// A rectangle of pixels inside the targets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct PassArea {
    pub(super) offset: [u32; 2],
    pub(super) extent: [u32; 2],
}

impl PassArea {
    /// Returns the given area, or that of the whole targets for `None`.
    pub(super) fn new(area: Option<[u32; 4]>, targets: [u32; 2]) -> Result<Self> {
        let Some([x, y, width, height]) = area else {
            return Ok(Self { offset: [0, 0], extent: targets });
        };
        let area = Self { offset: [x, y], extent: [width, height] };
        let whole = Self { offset: [0, 0], extent: targets };
        if width > 0 && height > 0 && whole.contains(area) {
            return Ok(area);
        }
        let message = format!(
            "the area [x, y, width, height] = {:?} has no pixels, or some outside of the targets' {targets:?}",
            [x, y, width, height]
        );
        Err(Error::usage("begin_rendering", message))
    }

    /// True if all pixels of `other` are in this area.
    pub(super) fn contains(self, other: Self) -> bool {
        (0..2).all(|axis| {
            let end = other.offset[axis].checked_add(other.extent[axis]);
            let own_end = u64::from(self.offset[axis]) + u64::from(self.extent[axis]);
            other.offset[axis] >= self.offset[axis] && end.is_some_and(|end| u64::from(end) <= own_end)
        })
    }

    pub(super) fn raw(self) -> vk::Rect2D {
        let ([x, y], [width, height]) = (self.offset, self.extent);
        let offset = vk::Offset2D { x: x as i32, y: y as i32 };
        vk::Rect2D { offset, extent: vk::Extent2D { width, height } }
    }
}

/// The layers that a pass draws to in each target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PassLayers {
    count: u32,
    pub(super) view_mask: u32,
}

impl PassLayers {
    /// Returns the layers of the pass: the number it gives, or the layers of its view mask.
    pub(super) fn new(gpu: &Gpu, desc: &RenderPassDesc<'_>) -> Result<Self> {
        let RenderPassDesc { layers, view_mask, .. } = *desc;
        if view_mask == 0 {
            let limit = gpu.caps.limits.max_target_layers;
            check_limit("begin_rendering", "count of layers", layers.into(), limit.into())?;
            return Ok(Self { count: layers.max(1), view_mask });
        }
        gpu.check_view_mask("begin_rendering", view_mask)?;
        if layers > 1 {
            let message = "the view mask sets the number of layers; leave layers 0";
            return Err(Error::usage("begin_rendering", message));
        }
        Ok(Self { count: u32::BITS - view_mask.leading_zeros(), view_mask })
    }

    pub(super) fn layer_count(self) -> u32 {
        self.count
    }

    /// True if the targets are arrays.
    pub(super) fn is_layered(self) -> bool {
        self.count > 1 || self.view_mask != 0
    }

    /// Returns the number of queries that one query command uses in the pass: the number of views, at least one.
    pub(super) fn query_count(self) -> u32 {
        self.view_mask.count_ones().max(1)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]
    use super::*;

    #[test]
    fn an_area_lies_inside_the_targets() {
        let whole = PassArea::new(None, [8, 4]).unwrap();
        assert_eq!(PassArea::new(Some([0, 0, 8, 4]), [8, 4]).unwrap(), whole);
        let part = PassArea::new(Some([7, 3, 1, 1]), [8, 4]).unwrap();
        assert!(whole.contains(part) && !part.contains(whole));
        for area in [[0, 0, 0, 4], [0, 0, 8, 0], [1, 0, 8, 4], [0, 4, 1, 1], [u32::MAX, 0, 2, 1]] {
            assert!(PassArea::new(Some(area), [8, 4]).is_err(), "{area:?}");
        }
    }
}
