// The surface that a ray of the pipeline has hit, with the texture that the instance names.
#include "rtx_textures/surface.glsl"

layout(location = 0) rayPayloadInEXT Found payload;
hitAttributeEXT vec2 barycentrics;

Found hitSurface() {
    uint primitive = uint(lvkPrimitiveIndex(frame.tlas));
    return surfaceOf(uint(gl_InstanceCustomIndexEXT), primitive, barycentrics, mat3(gl_ObjectToWorldEXT),
                     gl_WorldRayDirectionEXT, gl_HitTEXT, payload.distance);
}
