//! The meshes of a frame as one list of vertices and indices, and the draws of their parts.

use std::ops::Range;
use std::sync::Arc;

use egui::epaint::{ClippedPrimitive, Mesh, PaintCallbackInfo, Primitive, Vertex};
use egui::{PaintCallback, Rect, TextureId};

use crate::callback::Callback;
use crate::error::{Error, Result};

/// The vertices, indices and draws of a frame. Their memory is reused.
#[derive(Default)]
pub(crate) struct FrameMeshes {
    pub(crate) vertices: Vec<Vertex>,
    pub(crate) indices: Vec<u32>,
    pub(crate) draws: Vec<Draw>,
}

/// A part of the interface inside of one clip rectangle.
pub(crate) struct Draw {
    pub(crate) scissor: Scissor,
    pub(crate) content: Content,
}

pub(crate) enum Content {
    /// Triangles with one texture.
    Triangles { texture: TextureId, indices: Range<u32>, base_vertex: i32 },
    /// Draws of the application.
    Callback { callback: Arc<Callback>, info: PaintCallbackInfo },
}

/// A rectangle in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Scissor {
    pub(crate) offset: [u32; 2],
    pub(crate) extent: [u32; 2],
}

impl FrameMeshes {
    /// Replaces the contents by `primitives` on a target of `size_px` pixels. On failure there is nothing to draw.
    pub(crate) fn fill(
        &mut self,
        primitives: &[ClippedPrimitive],
        per_point: f32,
        size_px: [u32; 2],
    ) -> Result<()> {
        self.clear();
        let filled = primitives.iter().try_for_each(|primitive| self.add(primitive, per_point, size_px));
        filled.inspect_err(|_| self.clear())
    }

    fn clear(&mut self) {
        self.vertices.clear();
        self.indices.clear();
        self.draws.clear();
    }

    fn add(&mut self, clipped: &ClippedPrimitive, per_point: f32, size_px: [u32; 2]) -> Result<()> {
        let ClippedPrimitive { clip_rect, primitive } = clipped;
        let content = match (primitive, scissor(*clip_rect, per_point, size_px)) {
            (_, None) => None,
            (Primitive::Mesh(mesh), Some(scissor)) => Some((scissor, self.add_mesh(mesh)?)),
            (Primitive::Callback(callback), Some(scissor)) => {
                let info = PaintCallbackInfo {
                    viewport: callback.rect,
                    clip_rect: *clip_rect,
                    pixels_per_point: per_point,
                    screen_size_px: size_px,
                };
                Some((scissor, Some(callback_content(callback, info)?)))
            }
        };
        if let Some((scissor, Some(content))) = content {
            self.draws.push(Draw { scissor, content });
        }
        Ok(())
    }

    /// Adds the triangles of a mesh; `None` if it has none.
    fn add_mesh(&mut self, mesh: &Mesh) -> Result<Option<Content>> {
        if mesh.indices.is_empty() {
            return Ok(None);
        }
        let vertices = mesh.vertices.len();
        if !mesh.is_valid() {
            let beyond = |index: &&u32| **index as usize >= vertices;
            let index = mesh.indices.iter().find(beyond).copied().unwrap_or(u32::MAX);
            return Err(Error::InvalidMesh { vertices, index });
        }
        let base_vertex = checked_end("vertices", self.vertices.len(), vertices, i32::MAX as usize)?.start;
        let indices = checked_end("indices", self.indices.len(), mesh.indices.len(), u32::MAX as usize)?;
        self.vertices.extend_from_slice(&mesh.vertices);
        self.indices.extend_from_slice(&mesh.indices);
        let indices = indices.start as u32..indices.end as u32;
        Ok(Some(Content::Triangles { texture: mesh.texture_id, indices, base_vertex: base_vertex as i32 }))
    }
}

/// Returns the places of `count` more elements, which end at `limit` at most.
fn checked_end(what: &'static str, start: usize, count: usize, limit: usize) -> Result<Range<usize>> {
    let end = start.saturating_add(count);
    if end > limit { Err(Error::TooLarge { what, count: end, limit }) } else { Ok(start..end) }
}

fn callback_content(callback: &PaintCallback, info: PaintCallbackInfo) -> Result<Content> {
    let own = Arc::clone(&callback.callback).downcast::<Callback>();
    own.map(|callback| Content::Callback { callback, info }).map_err(|_| Error::ForeignCallback)
}

/// Returns the pixels of a clip rectangle in points that are on a target; `None` if there are none.
fn scissor(clip: Rect, per_point: f32, size_px: [u32; 2]) -> Option<Scissor> {
    // Casts saturate, and turn values that are not numbers to 0.
    let edge = |at: f32, side: u32| ((at * per_point).round() as u32).min(side);
    let low = [edge(clip.min.x, size_px[0]), edge(clip.min.y, size_px[1])];
    let high = [edge(clip.max.x, size_px[0]), edge(clip.max.y, size_px[1])];
    let is_seen = low[0] < high[0] && low[1] < high[1];
    is_seen.then(|| Scissor { offset: low, extent: [high[0] - low[0], high[1] - low[1]] })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

    use egui::{Color32, pos2};
    use proptest::prelude::*;

    use super::*;

    fn rect(low: [f32; 2], high: [f32; 2]) -> Rect {
        Rect { min: low.into(), max: high.into() }
    }

    fn mesh(indices: &[u32], vertices: usize) -> ClippedPrimitive {
        let vertex = Vertex { pos: pos2(0.0, 0.0), uv: pos2(0.0, 0.0), color: Color32::WHITE };
        let mesh = Mesh {
            indices: indices.to_vec(),
            vertices: vec![vertex; vertices],
            texture_id: TextureId::Managed(0),
        };
        ClippedPrimitive { clip_rect: Rect::EVERYTHING, primitive: Primitive::Mesh(mesh) }
    }

    #[test]
    fn clip_rectangles_become_pixels() {
        let found = scissor(rect([1.0, 2.0], [5.5, 4.0]), 2.0, [100, 50]);
        assert_eq!(found, Some(Scissor { offset: [2, 4], extent: [9, 4] }));
        let whole = Some(Scissor { offset: [0, 0], extent: [100, 50] });
        assert_eq!(scissor(Rect::EVERYTHING, 1.5, [100, 50]), whole);
        for nothing in
            [Rect::NOTHING, Rect::NAN, rect([7.0, 7.0], [7.2, 9.0]), rect([200.0, 0.0], [300.0, 9.0])]
        {
            assert_eq!(scissor(nothing, 1.0, [100, 50]), None, "{nothing}");
        }
        assert_eq!(scissor(Rect::EVERYTHING, 1.0, [0, 50]), None);
    }

    #[test]
    fn meshes_follow_each_other_and_empty_ones_are_left_out() {
        let mut frame = FrameMeshes::default();
        let meshes = [mesh(&[0, 1, 2], 3), mesh(&[], 4), mesh(&[1, 1, 0, 0, 1, 1], 2)];
        for _ in 0..2 {
            frame.fill(&meshes, 1.0, [10, 10]).unwrap();
            let ranges = frame.draws.iter().map(|draw| match &draw.content {
                Content::Triangles { indices, base_vertex, .. } => (indices.clone(), *base_vertex),
                Content::Callback { .. } => (0..0, -1),
            });
            assert_eq!(ranges.collect::<Vec<_>>(), [(0..3, 0), (3..9, 3)]);
            assert_eq!((frame.vertices.len(), frame.indices.len()), (5, 9));
        }
    }

    #[test]
    fn an_index_beyond_the_vertices_is_refused_and_nothing_is_drawn() {
        let mut frame = FrameMeshes::default();
        let answer = frame.fill(&[mesh(&[0, 1, 2], 3), mesh(&[0, 3, 1], 3)], 1.0, [10, 10]);
        assert!(matches!(answer, Err(Error::InvalidMesh { vertices: 3, index: 3 })), "{answer:?}");
        assert!(frame.draws.is_empty() && frame.vertices.is_empty() && frame.indices.is_empty());
    }

    #[test]
    fn more_than_32_bits_count_is_refused() {
        assert_eq!(checked_end("indices", 3, 4, 7).unwrap(), 3..7);
        for (start, count) in [(3, 5), (8, 0), (1, usize::MAX)] {
            let answer = checked_end("indices", start, count, 7);
            assert!(matches!(answer, Err(Error::TooLarge { limit: 7, .. })), "{answer:?}");
        }
    }

    #[test]
    fn callbacks_of_other_painters_are_refused() {
        let paint = |callback| ClippedPrimitive {
            clip_rect: Rect::EVERYTHING,
            primitive: Primitive::Callback(callback),
        };
        let mut frame = FrameMeshes::default();
        let foreign = PaintCallback { rect: Rect::EVERYTHING, callback: Arc::new(7) };
        let answer = frame.fill(&[paint(foreign)], 1.0, [10, 10]);
        assert!(matches!(answer, Err(Error::ForeignCallback)), "{answer:?}");
        let own = Callback::shape(rect([1.0, 1.0], [2.0, 2.0]), |_, _| Ok(()));
        frame.fill(&[paint(own)], 1.0, [10, 10]).unwrap();
        assert_eq!(frame.draws.len(), 1);
    }

    proptest! {
        #[test]
        fn no_scissor_leaves_its_target(
            corners in [-1e4_f32..1e4, -1e4_f32..1e4, -1e4_f32..1e4, -1e4_f32..1e4],
            per_point in 0.1_f32..4.0,
            size_px in [0_u32..4000, 0_u32..4000],
        ) {
            let clip = Rect::from_two_pos(pos2(corners[0], corners[1]), pos2(corners[2], corners[3]));
            if let Some(Scissor { offset, extent: found }) = scissor(clip, per_point, size_px) {
                prop_assert!((0..2).all(|axis| found[axis] > 0 && offset[axis] + found[axis] <= size_px[axis]));
            }
        }
    }
}
