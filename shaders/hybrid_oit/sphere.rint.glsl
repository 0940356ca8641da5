// A shadow ray in the box of a sphere.
#include "hybrid_oit/sphere.glsl"

hitAttributeEXT Crossing attribute;

void main() {
    Sphere sphere = frame.spheres.at[gl_InstanceCustomIndexEXT + lvkPrimitiveIndex(frame.tlas)];
    if (crossSphere(sphere.center, sphere.radius, gl_WorldRayOriginEXT, gl_WorldRayDirectionEXT, attribute)) {
        // Where the ray starts inside, it meets the sphere where it leaves it.
        reportIntersectionEXT(attribute.entry >= gl_RayTminEXT ? attribute.entry : attribute.exit, 0u);
    }
}
