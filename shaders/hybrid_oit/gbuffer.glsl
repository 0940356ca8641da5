// The g-buffer of a pixel's opaque surface.
#ifndef HYBRID_OIT_GBUFFER
#define HYBRID_OIT_GBUFFER

#include "common/octahedral.glsl"
#include "hybrid_oit/frame.glsl"

struct Surface {
    vec3 position;
    float distance; // from the eye; 0 where the sky is seen
    vec3 normal; // unit length
    vec3 albedo;
    float gloss; // 0 for a matt surface, 1 for a varnished one
};

uvec4 packSurface(vec3 normal, vec3 albedo, float gloss) {
    uvec2 direction = floatBitsToUint(octahedralFromUnit(normal));
    return uvec4(direction, packHalf2x16(albedo.rg), packHalf2x16(vec2(albedo.b, gloss)));
}

Surface surfaceAt(uvec2 pixel) {
    vec4 position = textureBindlessFetch2D(frame.gbufferPosition, ivec2(pixel), 0);
    uvec4 words = textureBindlessFetchU2D(frame.gbufferSurface, ivec2(pixel), 0);
    vec2 rest = unpackHalf2x16(words.w);
    Surface surface;
    surface.position = position.xyz;
    surface.distance = position.w;
    surface.normal = unitFromOctahedral(uintBitsToFloat(words.xy));
    surface.albedo = vec3(unpackHalf2x16(words.z), rest.x);
    surface.gloss = rest.y;
    return surface;
}

#endif
