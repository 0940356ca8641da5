//! What task and mesh shaders may ask for.

use ash::vk;

/// Limits of `VK_EXT_mesh_shader`; all 0 where the device has no mesh shaders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MeshLimits {
    /// Most task workgroups of a draw for each axis (`maxTaskWorkGroupCount`).
    pub max_task_groups: [u32; 3],
    /// Most task workgroups of a draw altogether (`maxTaskWorkGroupTotalCount`).
    pub max_task_groups_total: u32,
    /// Most mesh workgroups of a draw, or of one task workgroup, for each axis (`maxMeshWorkGroupCount`).
    pub max_mesh_groups: [u32; 3],
    /// Most mesh workgroups of a draw, or of one task workgroup, altogether (`maxMeshWorkGroupTotalCount`).
    pub max_mesh_groups_total: u32,
    /// Most invocations of a task workgroup for each axis (`maxTaskWorkGroupSize`).
    pub max_task_group_size: [u32; 3],
    /// Most invocations of a task workgroup altogether (`maxTaskWorkGroupInvocations`).
    pub max_task_invocations: u32,
    /// Bytes a task workgroup may hand to its mesh workgroups (`maxTaskPayloadSize`).
    pub max_task_payload_bytes: u32,
    /// Bytes that the invocations of a task workgroup may share (`maxTaskSharedMemorySize`).
    pub max_task_shared_bytes: u32,
    /// Bytes of both together (`maxTaskPayloadAndSharedMemorySize`).
    pub max_task_payload_and_shared_bytes: u32,
    /// Most invocations of a mesh workgroup for each axis (`maxMeshWorkGroupSize`).
    pub max_mesh_group_size: [u32; 3],
    /// Most invocations of a mesh workgroup altogether (`maxMeshWorkGroupInvocations`).
    pub max_mesh_invocations: u32,
    /// Bytes that the invocations of a mesh workgroup may share (`maxMeshSharedMemorySize`).
    pub max_mesh_shared_bytes: u32,
    /// Bytes of those and of the payload it takes (`maxMeshPayloadAndSharedMemorySize`).
    pub max_mesh_payload_and_shared_bytes: u32,
    /// Most vertices a mesh workgroup puts out (`maxMeshOutputVertices`).
    pub max_output_vertices: u32,
    /// Most primitives a mesh workgroup puts out (`maxMeshOutputPrimitives`).
    pub max_output_primitives: u32,
}

impl MeshLimits {
    /// Those of `found`, which is all 0 unless the device was asked.
    pub(crate) fn from_properties(found: &vk::PhysicalDeviceMeshShaderPropertiesEXT<'_>) -> Self {
        Self {
            max_task_groups: found.max_task_work_group_count,
            max_task_groups_total: found.max_task_work_group_total_count,
            max_mesh_groups: found.max_mesh_work_group_count,
            max_mesh_groups_total: found.max_mesh_work_group_total_count,
            max_task_group_size: found.max_task_work_group_size,
            max_task_invocations: found.max_task_work_group_invocations,
            max_task_payload_bytes: found.max_task_payload_size,
            max_task_shared_bytes: found.max_task_shared_memory_size,
            max_task_payload_and_shared_bytes: found.max_task_payload_and_shared_memory_size,
            max_mesh_group_size: found.max_mesh_work_group_size,
            max_mesh_invocations: found.max_mesh_work_group_invocations,
            max_mesh_shared_bytes: found.max_mesh_shared_memory_size,
            max_mesh_payload_and_shared_bytes: found.max_mesh_payload_and_shared_memory_size,
            max_output_vertices: found.max_mesh_output_vertices,
            max_output_primitives: found.max_mesh_output_primitives,
        }
    }
}
