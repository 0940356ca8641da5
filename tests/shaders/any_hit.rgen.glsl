// Counts what the any-hit shader sees, and reports what was committed: weights are the count and the sum of tags.
#include "any_hit_payload.glsl"

layout(location = 0) rayPayloadEXT Seen seen;

void main() {
    uint index = gl_LaunchIDEXT.y * gl_LaunchSizeEXT.x + gl_LaunchIDEXT.x;
    if (index >= count) {
        return;
    }
    Ray ray = rays.at[index];
    seen = Seen(kNoHit, 0, 0);
    traceRayEXT(kTLAS[tlas], flags, mask, 0, 0, 0, ray.origin, ray.tMin, ray.direction, ray.tMax, 0);
    seen.record.barycentrics = vec2(seen.count, seen.sum);
    hits.at[index] = seen.record;
}
