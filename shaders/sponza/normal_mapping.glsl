// Relief that a normal map gives to a surface.
#ifndef SPONZA_RELIEF
#define SPONZA_RELIEF

#include "sponza/frame.glsl"

// The normal of the map in place of `normal`, which has unit length and is on the eye's side. The map's directions are those in
// which texture coordinates grow, found from neighbouring pixels ("Normal Mapping Without Precomputed Tangents", Schueler).
// Called by all four pixels of a quad.
vec3 reliefNormal(uint material, vec3 normal, vec3 position, vec2 texcoord) {
    vec3 right = dFdx(position);
    vec3 down = dFdy(position);
    vec2 texRight = dFdx(texcoord);
    vec2 texDown = dFdy(texcoord);
    uint map = frame.finishes.at[material].normalMap;
    if (map == kNoTexture || frame.hasRelief == 0u) {
        return normal;
    }
    vec3 acrossDown = cross(down, normal);
    vec3 acrossRight = cross(normal, right);
    vec3 along = texRight.x * acrossDown + texDown.x * acrossRight;
    vec3 upwards = -(texRight.y * acrossDown + texDown.y * acrossRight); // rows of images run down
    float longest = max(dot(along, along), dot(upwards, upwards));
    if (longest == 0.0) {
        return normal;
    }
    // Both have the sign of the area that the pixel has as the normal sees it.
    float scale = sign(dot(right, acrossDown)) * inversesqrt(longest);
    vec3 found = 2.0 * textureBindless2DGrad(map, frame.surfaceSampler, texcoord, texRight, texDown).xyz - 1.0;
    return normalize(scale * (found.x * along + found.y * upwards) + found.z * normal);
}

#endif
