// A shadow ray through a sphere of glass: goes on, weakened.
#include "hybrid_oit/payload.glsl"
#include "hybrid_oit/sphere.glsl"

layout(location = 0) rayPayloadInEXT Sunlight payload;
hitAttributeEXT Crossing crossing;

void main() {
    Sphere sphere = frame.spheres.at[gl_InstanceCustomIndexEXT + lvkPrimitiveIndex(frame.tlas)];
    payload.opticalDepth += glassOpticalDepth(crossing, sphere.color, gl_RayTminEXT);
    ignoreIntersectionEXT;
}
