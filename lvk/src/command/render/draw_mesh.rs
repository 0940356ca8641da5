//! Draws of mesh pipelines.

use ash::vk;

use super::pass::RenderPass;
use crate::error::{Result, check_limit};
use crate::gpu::caps::mesh_limits::MeshLimits;
use crate::handle::BufferHandle;
use crate::pipeline::FrontEnd;

impl RenderPass<'_> {
    /// Runs `groups` workgroups along x, y and z of the task shader of the bound pipeline, or of its mesh shader if it
    /// has no task shader (`vkCmdDrawMeshTasksEXT`).
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) unless a pipeline with a mesh shader is bound, with its push
    /// constants, and while a query of [`PipelineStatistics`](crate::QueryKind::PipelineStatistics) is open;
    /// [`LimitExceeded`](crate::Error::LimitExceeded) for more workgroups than [`MeshLimits`] allows.
    pub fn draw_mesh_tasks(&mut self, groups: [u32; 3]) -> Result<()> {
        self.check_mesh_draw()?;
        let pipeline = self.bound_pipeline("draw_mesh_tasks")?;
        check_groups(&pipeline.name, groups, pipeline.front_end, &self.cmd.shared.gpu.caps.limits.mesh)?;
        let (ext, [x, y, z]) = (self.cmd.shared.gpu.mesh_functions()?, groups);
        // SAFETY: a mesh pipeline is bound with its push constants, and the counts are within the limits.
        unsafe { ext.cmd_draw_mesh_tasks(self.cmd.raw(), x, y, z) };
        Ok(())
    }

    /// Draws `draw_count` times with arguments (`VkDrawMeshTasksIndirectCommandEXT`, three `u32`) from a buffer with
    /// [`BufferUsage::INDIRECT`](crate::BufferUsage::INDIRECT), `stride` bytes apart (`vkCmdDrawMeshTasksIndirectEXT`).
    ///
    /// The caller keeps the counts in the buffer within [`MeshLimits`]; the library does not check them.
    pub fn draw_mesh_tasks_indirect(
        &mut self,
        arguments: BufferHandle,
        offset: u64,
        draw_count: u32,
        stride: u32,
    ) -> Result<()> {
        self.check_mesh_draw()?;
        let size = size_of::<vk::DrawMeshTasksIndirectCommandEXT>();
        let command = self.cmd.shared.gpu.mesh_functions()?.fp().cmd_draw_mesh_tasks_indirect_ext;
        self.draw_indirect_with(arguments, offset, draw_count, stride, size, command)
    }
}

/// Fails if a draw has more workgroups than its first stage may have.
fn check_groups(pipeline: &str, groups: [u32; 3], front_end: FrontEnd, limits: &MeshLimits) -> Result<()> {
    let (axes, total) = match front_end {
        FrontEnd::TaskAndMesh => (limits.max_task_workgroups, limits.max_task_workgroups_total),
        _ => (limits.max_mesh_workgroups, limits.max_mesh_workgroups_total),
    };
    for (count, limit) in groups.into_iter().zip(axes) {
        check_limit(pipeline, "workgroup count along an axis", count.into(), limit.into())?;
    }
    let all = groups.iter().fold(1_u64, |all, count| all.saturating_mul((*count).into()));
    check_limit(pipeline, "workgroup count", all, total.into())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]
    use super::*;
    use crate::error::Error;

    const LIMITS: MeshLimits = MeshLimits {
        max_task_workgroups: [8, 4, 2],
        max_task_workgroups_total: 16,
        max_mesh_workgroups: [100, 100, 100],
        max_mesh_workgroups_total: 1_000,
        max_task_workgroup_size: [0; 3],
        max_task_invocations: 0,
        max_task_payload_bytes: 0,
        max_task_shared_bytes: 0,
        max_task_payload_and_shared_bytes: 0,
        max_mesh_workgroup_size: [0; 3],
        max_mesh_invocations: 0,
        max_mesh_shared_bytes: 0,
        max_mesh_payload_and_shared_bytes: 0,
        max_output_vertices: 0,
        max_output_primitives: 0,
    };

    fn refused(groups: [u32; 3], front_end: FrontEnd) -> Option<(u64, u64)> {
        match check_groups("p", groups, front_end, &LIMITS) {
            Ok(()) => None,
            Err(Error::LimitExceeded { requested, limit, .. }) => Some((requested, limit)),
            Err(other) => unreachable!("{other}"),
        }
    }

    #[test]
    fn groups_are_limited_along_each_axis_and_altogether() {
        assert_eq!(refused([8, 2, 1], FrontEnd::TaskAndMesh), None);
        assert_eq!(refused([0, 4, 2], FrontEnd::TaskAndMesh), None);
        assert_eq!(refused([1, 5, 1], FrontEnd::TaskAndMesh), Some((5, 4)));
        assert_eq!(refused([8, 3, 1], FrontEnd::TaskAndMesh), Some((24, 16)));
        assert_eq!(refused([8, 3, 1], FrontEnd::Mesh), None);
        assert_eq!(refused([u32::MAX; 3], FrontEnd::Mesh), Some((u32::MAX.into(), 100)));
        assert_eq!(refused([100, 100, 100], FrontEnd::Mesh), Some((1_000_000, 1_000)));
    }
}
