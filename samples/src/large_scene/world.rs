//! The scene of the sample: pieces of one large scene, and transforms of their instances.

use crate::app::sample_error::SampleError;
use std::ops::Range;

use glam::{Affine3A, Vec3, Vec3A};

use super::merge::{bake, merge};
use super::street;
use crate::app::progress::Progress;
use crate::hybrid::textures_needed;
use crate::scene::{Scene, Valley};

/// Most triangles that are put into one mesh.
const MOST_COMBINED: u64 = 1 << 25;

/// The scene of the sample.
#[derive(Debug, Clone)]
pub struct World {
    pub(super) scene: Scene,
    pub(super) pieces: Vec<Piece>,
    pub(super) instances: Vec<Instance>,
}

/// Triangles that share a bottom-level structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Piece {
    /// The scene they come from.
    pub name: String,
    /// Their numbers in the world's scene.
    pub triangles: Range<u32>,
    /// Vertices that they name are in this range.
    pub vertices: Range<u32>,
    /// True if light passes through them.
    pub is_refractive: bool,
}

/// A piece where it stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instance {
    /// Index of the piece.
    pub piece: usize,
    /// Transform from piece to world coordinates: rotation, translation and uniform scale.
    pub place: Affine3A,
}

impl World {
    /// A wooded valley made by code: about `triangles` triangles in ground, water and a few kinds of trees, of which `copies`
    /// are shown, or as many as find room. The same everywhere.
    ///
    /// # Errors
    /// [`SampleError::Stopped`].
    pub fn valley(triangles: u32, copies: u32, progress: &mut Progress) -> Result<Self, SampleError> {
        let Valley { ground, trees, places } = Valley::new(triangles, copies, progress)?;
        let mut placed = vec![(0, Affine3A::IDENTITY)];
        placed.extend(places.into_iter().map(|(kind, place)| (kind + 1, place)));
        Ok(Self::from_scenes(std::iter::once(ground).chain(trees).collect(), &placed))
    }

    /// Rows of plots along streets, in each a scene, turned to another side from plot to plot; `copies` of each scene. Scenes
    /// are scaled to their plots, and rooms are opened above to let the sun in.
    ///
    /// # Errors
    /// [`SampleError::NoScenes`].
    pub fn street(scenes: Vec<Scene>, copies: u32) -> Result<Self, SampleError> {
        if scenes.is_empty() || copies == 0 {
            return Err(SampleError::NoScenes);
        }
        let street::Street { scenes, places } = street::Street::new(scenes, copies);
        Ok(Self::from_scenes(scenes, &places))
    }

    /// Scenes of which the first has the lights and cameras, and the index and place of each that is shown.
    pub(super) fn from_scenes(scenes: Vec<Scene>, places: &[(usize, Affine3A)]) -> Self {
        let (scene, pieces) = merge(scenes);
        let of_scene = |number: usize| pieces.iter().enumerate().filter(move |(_, (of, _))| *of == number);
        let stand = |(scene, place): &(usize, Affine3A)| {
            let place = *place;
            of_scene(*scene).map(move |(piece, _)| Instance { piece, place }).collect::<Vec<_>>()
        };
        let instances = places.iter().flat_map(stand).collect();
        Self { scene, instances, pieces: pieces.into_iter().map(|(_, piece)| piece).collect() }
    }

    /// The same world as one mesh, whose triangles stand where the instances were: one piece, and a second where light passes
    /// through some.
    ///
    /// # Errors
    /// [`SampleError::MeshTooLarge`].
    pub fn combined(&self) -> Result<Self, SampleError> {
        let (count, limit) = (self.instanced_triangle_count(), MOST_COMBINED);
        if count > limit {
            return Err(SampleError::MeshTooLarge { count, limit });
        }
        Ok(bake(self))
    }

    /// Name of the world.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.scene.name
    }

    /// Triangles, materials, textures and cameras of all pieces.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Number of descriptor slots for textures that the world needs.
    pub(super) fn textures_needed(&self) -> u32 {
        textures_needed(&self.scene)
    }

    /// The scene, to make its textures fit a device.
    pub(super) fn scene_mut(&mut self) -> &mut Scene {
        &mut self.scene
    }

    /// The pieces, those first that light does not pass through.
    #[must_use]
    pub fn parts(&self) -> &[Piece] {
        &self.pieces
    }

    /// The instances.
    #[must_use]
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// Triangles that lie in memory.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        self.scene.triangles.len() as u64
    }

    /// Triangles of all instances.
    #[must_use]
    pub fn instanced_triangle_count(&self) -> u64 {
        self.instances.iter().map(|instance| self.pieces[instance.piece].triangles.len() as u64).sum()
    }

    /// The largest coordinate of what is shown, without its sign.
    #[must_use]
    pub fn farthest(&self) -> f32 {
        let boxes: Vec<_> = self.pieces.iter().map(|piece| self.bounds(piece)).collect();
        let of_instance = |instance: &Instance| {
            let (low, high) = boxes[instance.piece];
            let corner = |i: u32| Vec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low);
            let reach = |i| instance.place.transform_point3a(Vec3A::from(corner(i))).abs().max_element();
            (0..8).map(reach).fold(0.0_f32, f32::max)
        };
        self.instances.iter().map(of_instance).fold(0.0, f32::max)
    }

    fn bounds(&self, piece: &Piece) -> (Vec3, Vec3) {
        let range = piece.vertices.start as usize..piece.vertices.end as usize;
        let points = self.scene.positions[range].iter().map(|position| Vec3::from(*position));
        points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), point| {
            (low.min(point), high.max(point))
        })
    }
}
