// Reports both crossings of a ray with a sphere, the far one first, and one beyond the end of the ray. The kind of the near
// side is 127 after an accepted far side, and 126 otherwise.
#include "ray_records.glsl"
#include "sphere_object.glsl"

hitAttributeEXT vec2 ids;

void main() {
    vec2 places;
    int primitive = lvkPrimitiveIndex(tlas);
    vec3 center = sphereCenter(lvkGeometryIndex(), primitive);
    if (crossSphere(center, RADIUS, gl_ObjectRayOriginEXT, gl_ObjectRayDirectionEXT, places)) {
        // Only what may be accepted: lavapipe 25.0 keeps one set of attributes for all that a ray meets.
        bvec2 inRange = bvec2(places.x >= gl_RayTminEXT && places.x <= gl_RayTmaxEXT,
                              places.y >= gl_RayTminEXT && places.y <= gl_RayTmaxEXT);
        if (any(inRange)) {
            ids = vec2(primitive, lvkInstanceId(tlas));
        }
        bool beyond = reportIntersectionEXT(gl_RayTmaxEXT * 2.0 + 1.0, 99u);
        bool far = reportIntersectionEXT(places.y, 2u);
        reportIntersectionEXT(places.x, beyond ? 98u : far ? 127u : 126u);
    }
}
