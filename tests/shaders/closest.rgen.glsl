#include "ray_records.glsl"

layout(location = 0) rayPayloadEXT HitRecord record;

void main() {
    uint index = gl_LaunchIDEXT.y * gl_LaunchSizeEXT.x + gl_LaunchIDEXT.x;
    if (index >= count) {
        return;
    }
    Ray ray = rays.at[index];
    record = kNoHit;
    traceRayEXT(kTLAS[tlas], flags, mask, 0, 0, 0, ray.origin, ray.tMin, ray.direction, ray.tMax, 0);
    hits.at[index] = record;
}
