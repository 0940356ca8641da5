#include "any_hit_payload.glsl"

layout(location = 0) rayPayloadInEXT Seen seen;

void main() {
    seen.record = HitRecord(gl_HitTEXT, vec2(0), gl_HitKindEXT, lvkInstanceId(tlas), gl_InstanceCustomIndexEXT,
                            lvkGeometryIndex(), lvkPrimitiveIndex(tlas));
}
