// The nearest surface of a pixel: its colour, and its light by ray queries or what a later ray pass needs for that.
#ifndef RTX_AO_TARGETS
#define LVK_OPAQUE_TRIANGLES_ONLY
#include <lvk/ray_query.glsl>
#include "common/occlusion_query.glsl"
#endif
#include "rtx_ao/frame.glsl"

layout(location = 0) in vec3 inPosition;
layout(location = 1) in vec3 inNormal;
layout(location = 2) in vec2 inTexcoord;
layout(location = 3) flat in vec3 inGeometric;
layout(location = 4) flat in uint inTriangle;
layout(location = 5) in vec3 inColor;

layout(location = 0) out vec4 outAlbedo;
#ifdef RTX_AO_TARGETS
layout(location = 1) out vec4 outPosition;
layout(location = 2) out vec4 outNormal;
layout(location = 3) out vec4 outGeometric;
#else
layout(location = 1) out vec4 outLight;

bool isBlocked(vec3 origin, vec3 direction, float range) {
    return occludedByQuery(frame.tlas, 0xffu, origin, 0.0, direction, range);
}

#include "rtx_ao/light.glsl"
#endif

vec3 albedoHere() {
    Paint paint = PaintArray(frame.bodies.at[body].paints).at[inTriangle];
    // Derivatives are taken before any branch.
    vec2 right = dFdx(inTexcoord);
    vec2 down = dFdy(inTexcoord);
    if (paint.tex == kNoTexture) {
        return paint.albedo * inColor;
    }
    return paint.albedo * inColor * textureBindless2DGrad(paint.tex, frame.smp, inTexcoord, right, down).rgb;
}

void main() {
    vec3 geometric = dot(inGeometric, inPosition - frame.camera.eye) > 0.0 ? -inGeometric : inGeometric;
    vec3 normal = normalize(inNormal);
    normal = dot(normal, geometric) < 0.0 ? -normal : normal;
    outAlbedo = vec4(albedoHere(), 1.0);
#ifdef RTX_AO_TARGETS
    outPosition = vec4(inPosition, 1.0);
    outNormal = vec4(normal, 1.0);
    outGeometric = vec4(geometric, 1.0);
#else
    // Invocations beside a triangle, which only help with derivatives, need no light.
    outLight = gl_HelperInvocation ? vec4(0.0) : lightAt(inPosition, normal, geometric, uvec2(gl_FragCoord.xy));
#endif
}
