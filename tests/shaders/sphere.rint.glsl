#include "ray_records.glsl"
#include "sphere_object.glsl"

layout(shaderRecordEXT, scalar) buffer Record {
    float radius;
    uint tag;
};

void main() {
    vec2 places;
    vec3 center = sphereCenter(gl_GeometryIndexEXT, lvkPrimitiveIndex(tlas));
    if (crossSphere(center, radius, gl_ObjectRayOriginEXT, gl_ObjectRayDirectionEXT, places)) {
        if (!reportIntersectionEXT(places.x, tag)) {
            reportIntersectionEXT(places.y, tag);
        }
    }
}
