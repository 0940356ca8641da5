//! Lists of triangles from the other arrangements of triangles.

use gltf::json::mesh::Mode;

use super::budget::Budget;
use crate::Problem;

/// Indices of a list of triangles.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct TriangleList {
    /// Three indices for each triangle.
    pub(super) indices: Vec<u32>,
    /// Whether vertices are left over that make no whole triangle.
    pub(super) has_rest: bool,
}

/// Turns the indices of triangles, of a strip or of a fan into those of a list. Other modes have no triangles.
pub(super) fn triangle_list(
    mode: Mode,
    mut indices: Vec<u32>,
    budget: &Budget,
    place: &dyn Fn() -> String,
) -> Result<TriangleList, Problem> {
    let count = indices.len();
    let triangles = match mode {
        Mode::Triangles => {
            indices.truncate(count / 3 * 3);
            return Ok(TriangleList { has_rest: !count.is_multiple_of(3), indices });
        }
        Mode::TriangleStrip | Mode::TriangleFan => count.saturating_sub(2),
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => 0,
    };
    let mut list = budget.list(3 * triangles as u64, place)?;
    for triangle in 0..triangles {
        let corners = match mode {
            // Every second triangle of a strip is turned, so that all have the same front.
            Mode::TriangleStrip if triangle % 2 == 1 => [triangle, triangle + 2, triangle + 1],
            Mode::TriangleStrip => [triangle, triangle + 1, triangle + 2],
            _ => [triangle + 1, triangle + 2, 0],
        };
        list.extend(corners.map(|corner| indices[corner]));
    }
    Ok(TriangleList { indices: list, has_rest: triangles == 0 && count > 0 })
}

/// Returns the name of a mode in the specification.
pub(super) fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Points => "POINTS",
        Mode::Lines => "LINES",
        Mode::LineLoop => "LINE_LOOP",
        Mode::LineStrip => "LINE_STRIP",
        Mode::Triangles => "TRIANGLES",
        Mode::TriangleStrip => "TRIANGLE_STRIP",
        Mode::TriangleFan => "TRIANGLE_FAN",
    }
}
