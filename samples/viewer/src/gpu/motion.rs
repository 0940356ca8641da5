//! The motion of a scene: its pose, and what the GPU does to come from one pose to the next.

use lvk::{AccelStructHandle, BuildMode, CommandBuffer, Context};
use lvk_gltf::{Model, Pose};
use lvk_samples::app::frame::Frame;

use super::deformation::Deformation;
use super::instances::SceneInstances;

/// Poses of a model whose animations can play.
pub(super) struct SceneMotion {
    deformation: Option<Deformation>,
    /// Structures of meshes whose vertices move.
    refitted: Vec<AccelStructHandle>,
    pose: Pose,
    /// True if the pose is another one than that of the last frame.
    is_new: bool,
    /// True if the pose of the last frame was another one than that before.
    was_new: bool,
    /// Transforms of instances in the last frame.
    transforms_before: Vec<[f32; 12]>,
}

impl SceneMotion {
    /// The structures of `refitted` stand in `pose`; buffers need the pose still.
    pub(super) fn new(
        deformation: Option<Deformation>,
        refitted: Vec<AccelStructHandle>,
        pose: Pose,
    ) -> Self {
        Self { deformation, refitted, pose, is_new: true, was_new: false, transforms_before: Vec::new() }
    }

    /// Takes another pose over. Returns false if it is that of before.
    pub(super) fn set_pose(&mut self, pose: &Pose) -> bool {
        let is_other = self.pose != *pose;
        if is_other {
            self.pose.clone_from(pose);
            self.is_new = true;
        }
        is_other
    }

    /// True if the next frame shows something elsewhere than the last one.
    pub(super) fn moves(&self) -> bool {
        self.is_new
    }

    /// The transforms of instances in the frame before, which are those of now where there is none.
    pub(super) fn transforms_before(&self, now: Vec<[f32; 12]>, is_first: bool) -> Vec<[f32; 12]> {
        if is_first || self.transforms_before.len() != now.len() {
            now
        } else {
            self.transforms_before.clone()
        }
    }

    /// Records what moves vertices and structures to the pose.
    pub(super) fn record(
        &self,
        frame: &mut Frame<'_>,
        (model, instances): (&Model, &SceneInstances),
        tlas: AccelStructHandle,
        is_first: bool,
    ) -> lvk::Result<()> {
        let Self { deformation, pose, is_new, was_new, .. } = self;
        // Where motion has ended, positions of the frame before follow once more.
        if let Some(deformation) = deformation.as_ref().filter(|_| *is_new || *was_new) {
            frame.pass("vertices", |cmd| deformation.record(cmd, model, pose, is_first))?;
        }
        if *is_new {
            frame.pass("structures", |cmd| self.record_structures(cmd, instances, tlas))?;
        }
        Ok(())
    }

    fn record_structures(
        &self,
        cmd: &mut CommandBuffer,
        instances: &SceneInstances,
        tlas: AccelStructHandle,
    ) -> lvk::Result<()> {
        if !self.refitted.is_empty() {
            cmd.build_blas(&self.refitted, BuildMode::Refit)?;
        }
        cmd.update_tlas(tlas, &instances.structures(), BuildMode::Rebuild)
    }

    /// The frame is recorded: what is shown becomes what was shown before.
    pub(super) fn end_frame(&mut self, instances: &SceneInstances, is_first: bool) {
        self.was_new = self.is_new && !is_first;
        self.is_new = false;
        self.transforms_before = instances.transforms();
    }

    /// Buffers that vertices are moved in.
    pub(super) fn written(&self) -> Vec<lvk::BufferHandle> {
        self.deformation.iter().flat_map(Deformation::written).collect()
    }

    /// Reads the positions of moved vertices.
    pub(super) fn positions(&self, ctx: &Context) -> lvk::Result<Vec<Vec<[f32; 3]>>> {
        self.deformation.as_ref().map_or(Ok(Vec::new()), |deformation| deformation.download(ctx))
    }
}
