#include "ray_records.glsl"

layout(location = 0) rayPayloadInEXT HitRecord record;
hitAttributeEXT vec2 ids;

void main() {
    record = HitRecord(gl_HitTEXT, ids, gl_HitKindEXT, lvkInstanceId(tlas), gl_InstanceCustomIndexEXT,
                       lvkGeometryIndex(), lvkPrimitiveIndex(tlas));
}
