// A shadow ray in the box of a sphere.
#include "hybrid_oit/sphere.glsl"

hitAttributeEXT Crossing crossing;

void main() {
    Sphere sphere = frame.spheres.at[gl_InstanceCustomIndexEXT + lvkPrimitiveIndex(frame.tlas)];
    if (crossSphere(sphere.center, sphere.radius, gl_WorldRayOriginEXT, gl_WorldRayDirectionEXT, crossing)) {
        // A ray that starts inside meets the sphere at its exit.
        reportIntersectionEXT(crossing.entry >= gl_RayTminEXT ? crossing.entry : crossing.exit, 0u);
    }
}
