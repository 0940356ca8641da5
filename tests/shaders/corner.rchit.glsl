// Reports vertex CORNER of the hit triangle, in place of distance and weights.
#include "ray_records.glsl"

layout(location = 0) rayPayloadInEXT HitRecord record;

void main() {
    vec3 corner = gl_HitTriangleVertexPositionsEXT[CORNER];
    record = HitRecord(corner.x, corner.yz, gl_HitKindEXT, lvkInstanceId(tlas), gl_InstanceCustomIndexEXT,
                       lvkGeometryIndex(), lvkPrimitiveIndex(tlas));
}
