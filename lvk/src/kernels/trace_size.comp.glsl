// Writes the size of a lowered trace to its launch block, and the workgroup counts of its dispatch. A size of height 1 and
// depth 1 has 64 rays in a workgroup, and more workgroups than fit along x continue along y. Another size has 8 x 8 rays in
// a workgroup.
layout(local_size_x = 1) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Arguments { uvec3 size; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Workgroups { uvec3 count; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Launch { uvec3 size; };

layout(push_constant, scalar) uniform Push {
    Arguments arguments;
    Workgroups workgroups;
    Launch launch;
    uint maxWorkgroups;  // along x
    uint unused;
};

uint divideUp(uint value, uint by) {
    return value / by + uint(value % by != 0u);
}

uvec3 workgroupCounts(uvec3 size) {
    if (any(equal(size, uvec3(0u)))) return uvec3(0u);
    if (size.y > 1u || size.z > 1u) return uvec3(divideUp(size.x, 8u), divideUp(size.y, 8u), size.z);
    uint count = divideUp(size.x, 64u);
    uint rows = divideUp(count, maxWorkgroups);
    return uvec3(divideUp(count, rows), rows, 1u);
}

void main() {
    uvec3 size = arguments.size;
    launch.size = size;
    workgroups.count = workgroupCounts(size);
}
