#include "ray_records.glsl"

layout(shaderRecordEXT, scalar) buffer Record {
    float radius;
    uint tag;
};

layout(location = 0) rayPayloadInEXT HitRecord record;

void main() {
    record = HitRecord(gl_HitTEXT, vec2(radius, float(tag)), gl_HitKindEXT, lvkInstanceId(tlas), gl_InstanceCustomIndexEXT,
                       gl_GeometryIndexEXT, lvkPrimitiveIndex(tlas));
}
