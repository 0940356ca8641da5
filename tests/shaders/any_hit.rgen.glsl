// Counts the candidates of the any-hit shader, and reports the committed hit: weights are the count and the sum of tags.
#include "any_hit_payload.glsl"

layout(location = 0) rayPayloadEXT Seen seen;

void main() {
    START_RAY_GEN;
    seen = Seen(kNoHit, 0, 0);
    traceRayEXT(kTLAS[tlas], flags, mask, 0, 0, 0, ray.origin, ray.tMin, ray.direction, ray.tMax, 0);
    seen.record.barycentrics = vec2(seen.count, seen.sum);
    hits.at[index] = seen.record;
}
