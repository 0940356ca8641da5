#include "ray_records.glsl"

layout(location = 0) rayPayloadInEXT HitRecord record;
hitAttributeEXT vec2 barycentrics;

void main() {
    record = HitRecord(gl_HitTEXT, barycentrics, gl_HitKindEXT, lvkInstanceId(tlas), gl_InstanceCustomIndexEXT,
                       gl_GeometryIndexEXT, lvkPrimitiveIndex(tlas));
}
