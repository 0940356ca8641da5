// The second ray generation shader, which traces to the second miss shader: occluded unless that one ran.
#include "ray_records.glsl"

layout(location = 1) rayPayloadEXT uint occluded;

void main() {
    START_RAY_GEN;
    uint shadow = flags | LVK_RAY_FLAG_SKIP_CLOSEST_HIT_SHADER;
    occluded = 1;
    traceRayEXT(kTLAS[tlas], shadow, mask, 0, 0, 1, ray.origin, ray.tMin, ray.direction, ray.tMax, 1);
    HitRecord record = kNoHit;
    record.kind = occluded == 0 ? kMissed : kFront;
    hits.at[index] = record;
}
