// The nearest triangle of a ray.
#include "large_scene/frame.glsl"
#include "large_scene/hit.glsl"

layout(location = 0) rayPayloadInEXT Hit nearest;
hitAttributeEXT vec2 barycentrics;

void main() {
    nearest.triangle = frame.firsts.at[gl_InstanceCustomIndexEXT] + uint(lvkPrimitiveIndex(frame.tlas));
    nearest.instance = uint(lvkInstanceId(frame.tlas));
    nearest.barycentrics = barycentrics;
}
