// The decision about a candidate: IGNORE, TERMINATE or ACCEPT.
#include "any_hit_payload.glsl"

layout(location = 0) rayPayloadInEXT Seen seen;

void main() {
    seen.count += 1;
    seen.sum += tagOf(lvkInstanceId(tlas), lvkGeometryIndex(), lvkPrimitiveIndex(tlas));
#if defined(IGNORE)
    ignoreIntersectionEXT;
#elif defined(TERMINATE)
    terminateRayEXT;
#endif
}
