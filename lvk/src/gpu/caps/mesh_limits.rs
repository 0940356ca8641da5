//! Limits of task and mesh shaders.

use ash::vk;

/// Limits of `VK_EXT_mesh_shader`; all 0 where the device has no mesh shaders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MeshLimits {
    /// Maximum task workgroups of a draw along each axis (`maxTaskWorkGroupCount`).
    pub max_task_workgroups: [u32; 3],
    /// Maximum task workgroups of a draw in total (`maxTaskWorkGroupTotalCount`).
    pub max_task_workgroups_total: u32,
    /// Maximum mesh workgroups of a draw, or of one task workgroup, along each axis
    /// (`maxMeshWorkGroupCount`).
    pub max_mesh_workgroups: [u32; 3],
    /// Maximum mesh workgroups of a draw, or of one task workgroup, in total (`maxMeshWorkGroupTotalCount`).
    pub max_mesh_workgroups_total: u32,
    /// Maximum size of a task workgroup along each axis (`maxTaskWorkGroupSize`).
    pub max_task_workgroup_size: [u32; 3],
    /// Maximum invocations of a task workgroup (`maxTaskWorkGroupInvocations`).
    pub max_task_invocations: u32,
    /// Maximum payload of a task workgroup in bytes (`maxTaskPayloadSize`).
    pub max_task_payload_bytes: u32,
    /// Maximum shared memory of a task workgroup in bytes (`maxTaskSharedMemorySize`).
    pub max_task_shared_bytes: u32,
    /// Maximum sum of payload and shared memory of a task workgroup in bytes
    /// (`maxTaskPayloadAndSharedMemorySize`).
    pub max_task_payload_and_shared_bytes: u32,
    /// Maximum size of a mesh workgroup along each axis (`maxMeshWorkGroupSize`).
    pub max_mesh_workgroup_size: [u32; 3],
    /// Maximum invocations of a mesh workgroup (`maxMeshWorkGroupInvocations`).
    pub max_mesh_invocations: u32,
    /// Maximum shared memory of a mesh workgroup in bytes (`maxMeshSharedMemorySize`).
    pub max_mesh_shared_bytes: u32,
    /// Maximum sum of shared memory and received payload of a mesh workgroup in bytes
    /// (`maxMeshPayloadAndSharedMemorySize`).
    pub max_mesh_payload_and_shared_bytes: u32,
    /// Maximum output vertices of a mesh workgroup (`maxMeshOutputVertices`).
    pub max_output_vertices: u32,
    /// Maximum output primitives of a mesh workgroup (`maxMeshOutputPrimitives`).
    pub max_output_primitives: u32,
}

impl MeshLimits {
    /// Returns the limits in `found`, which are all 0 unless they were queried.
    pub(crate) fn from_properties(found: &vk::PhysicalDeviceMeshShaderPropertiesEXT<'_>) -> Self {
        Self {
            max_task_workgroups: found.max_task_work_group_count,
            max_task_workgroups_total: found.max_task_work_group_total_count,
            max_mesh_workgroups: found.max_mesh_work_group_count,
            max_mesh_workgroups_total: found.max_mesh_work_group_total_count,
            max_task_workgroup_size: found.max_task_work_group_size,
            max_task_invocations: found.max_task_work_group_invocations,
            max_task_payload_bytes: found.max_task_payload_size,
            max_task_shared_bytes: found.max_task_shared_memory_size,
            max_task_payload_and_shared_bytes: found.max_task_payload_and_shared_memory_size,
            max_mesh_workgroup_size: found.max_mesh_work_group_size,
            max_mesh_invocations: found.max_mesh_work_group_invocations,
            max_mesh_shared_bytes: found.max_mesh_shared_memory_size,
            max_mesh_payload_and_shared_bytes: found.max_mesh_payload_and_shared_memory_size,
            max_output_vertices: found.max_mesh_output_vertices,
            max_output_primitives: found.max_mesh_output_primitives,
        }
    }
}
