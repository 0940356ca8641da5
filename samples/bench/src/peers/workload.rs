//! The amount of work in each row, and data that all peers make alike.

use std::path::PathBuf;

/// Bytes of one upload.
pub const UPLOAD_BYTES: usize = 4096;

/// The amount of work in each row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Workload {
    /// Empty submissions in a sample.
    pub submits: u32,
    /// Buffers or textures that live at the same time.
    pub objects: u32,
    /// Draws in a render pass.
    pub draws: u32,
    /// Dispatches in a submission.
    pub dispatches: u32,
    /// Uploads of [`UPLOAD_BYTES`].
    pub uploads: u32,
    /// Meshes with a BLAS each.
    pub meshes: u32,
    /// Triangles of each mesh.
    pub mesh_triangles: u32,
    /// Instances of the TLAS.
    pub instances: u32,
    /// Frames in a row in a sample of a row of frames.
    pub frames: u32,
    /// Textures that a frame reads.
    pub textures: u32,
    /// Triangles of the traced scene without a file.
    pub scene_triangles: u32,
    /// Width and height of the traced image in pixels.
    pub image: [u32; 2],
    /// The traced scene, a Wavefront OBJ file; `None` for a generated scene.
    pub scene: Option<PathBuf>,
}

impl Workload {
    /// A GPU's work.
    pub(super) const GPU: Self = Self {
        submits: 100,
        objects: 1_000,
        draws: 100_000,
        dispatches: 10_000,
        uploads: 10_000,
        meshes: 1_000,
        mesh_triangles: 1_000,
        instances: 100_000,
        frames: 16,
        textures: 1_000,
        scene_triangles: 1_000_000,
        image: [1280, 720],
        scene: None,
    };

    /// The work of a driver that runs on the CPU: smaller meshes and images.
    pub(super) const CPU: Self =
        Self { mesh_triangles: 100, scene_triangles: 100_000, image: [160, 90], ..Self::GPU };

    /// A smoke test.
    pub(super) const QUICK: Self = Self {
        submits: 3,
        objects: 8,
        draws: 50,
        dispatches: 20,
        uploads: 12,
        meshes: 3,
        mesh_triangles: 20,
        instances: 10,
        frames: 2,
        textures: 12,
        scene_triangles: 600,
        image: [32, 18],
        scene: None,
    };

    /// Returns the positions of a mesh: triangles in a row, three corners each. `number` is the number of the mesh.
    #[must_use]
    pub fn mesh_positions(&self, number: u32) -> Vec<[f32; 3]> {
        let corner = |triangle: u32, corner: u32| {
            let [x, y] = [(triangle % 32) as f32, (triangle / 32) as f32];
            [x + (corner == 1) as u32 as f32, y + (corner == 2) as u32 as f32, 0.01 * number as f32]
        };
        (0..self.mesh_triangles).flat_map(|t| [corner(t, 0), corner(t, 1), corner(t, 2)]).collect()
    }

    /// Returns indices of a mesh, for peers that want them: three for each triangle.
    #[must_use]
    pub fn mesh_indices(&self) -> Vec<u32> {
        (0..3 * self.mesh_triangles).collect()
    }

    /// Returns the transform of an instance as three rows of four. `turn` moves all instances, so that no two builds have
    /// equal inputs.
    #[must_use]
    pub fn instance_transform(number: u32, turn: u32) -> [f32; 12] {
        let [x, y, z] = [number % 64, number / 64 % 64, number / 4096].map(|cell| 40.0 * cell as f32);
        let x = x + (turn % 16) as f32;
        [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z]
    }

    /// Returns the side of the square target in pixels on which each texture has a cell of 2 x 2 pixels.
    #[must_use]
    pub fn textured_side(&self) -> u32 {
        let cells = f64::from(self.textures).sqrt().ceil() as u32;
        2 * cells.max(1)
    }
}

/// Returns the bytes of an upload. The compiler cannot see what they are, so that it cannot write them in place.
#[must_use]
#[inline(never)]
pub fn upload_bytes(number: u64) -> [u8; UPLOAD_BYTES] {
    std::hint::black_box([number as u8; UPLOAD_BYTES])
}

/// Returns the four bytes of each texel of a texture.
#[must_use]
pub fn texel(number: u32) -> [u8; 4] {
    [(number % 256) as u8, (number / 256) as u8, 7, 255]
}

/// Returns the column and the row of a texture's cell on a target of `side` pixels.
#[must_use]
pub fn texture_cell(number: u32, side: u32) -> [u32; 2] {
    [number % (side / 2), number / (side / 2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_texture_has_a_cell_of_its_own() {
        for work in [Workload::QUICK, Workload::GPU] {
            let side = work.textured_side();
            let cells: std::collections::HashSet<_> =
                (0..work.textures).map(|number| texture_cell(number, side)).collect();
            assert_eq!(cells.len(), work.textures as usize);
            assert!(cells.iter().flatten().all(|cell| 2 * cell + 1 < side));
        }
    }

    #[test]
    fn instances_lie_apart_and_move() {
        let first = Workload::instance_transform(0, 0);
        assert_ne!(first, Workload::instance_transform(1, 0));
        assert_ne!(first, Workload::instance_transform(4096, 0));
        assert_ne!(first, Workload::instance_transform(0, 1));
    }

    #[test]
    fn triangles_of_a_mesh_have_an_area() {
        let work = Workload { mesh_triangles: 40, ..Workload::QUICK };
        let positions = work.mesh_positions(3);
        assert_eq!(positions.len(), 120);
        for [a, b, c] in positions.as_chunks::<3>().0 {
            assert!(a != b && b != c && c != a);
        }
    }
}
