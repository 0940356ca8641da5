// A pixel of a g-buffer: depth in one texture, in the other two normals, colour, roughness and material.
#ifndef REFLECTIONS_GBUFFER
#define REFLECTIONS_GBUFFER

#include "reflections/surface.glsl"

uvec4 packSurface(vec3 normal, vec3 geometricNormal, vec3 albedo, float metalness, float roughness, uint material) {
    uint shading = packSnorm2x16(octahedralFromUnit(normal));
    uint geometric = packSnorm2x16(octahedralFromUnit(geometricNormal));
    uint color = packUnorm4x8(vec4(sqrt(albedo), metalness));
    return uvec4(shading, geometric, color, uint(roughness * 65535.0 + 0.5) | material << 16u);
}

float packedRoughness(uvec4 texel) {
    return float(texel.w & 0xffffu) / 65535.0;
}

vec3 packedNormal(uvec4 texel) {
    return unitFromOctahedral(unpackSnorm2x16(texel.x));
}

// Offset of rays from the surface: beyond the rounding of depth and normals.
float liftAt(float distance) {
    return 1.5e-3 + 2.5e-4 * distance;
}

// Reads the surface of the pixel from the g-buffer of `depthTexture` and `surfaceTexture`; false where there is none.
bool readSurface(uint depthTexture, uint surfaceTexture, uvec2 pixel, vec3 direction, out Surface surface, out float distance) {
    float depth = textureBindlessFetch2D(depthTexture, ivec2(pixel), 0).r;
    if (depth <= 0.0) {
        return false;
    }
    distance = depthDistance(depth, direction);
    uvec4 texel = textureBindlessFetchU2D(surfaceTexture, ivec2(pixel), 0);
    vec4 color = unpackUnorm4x8(texel.z);
    surface.position = frame.camera.eye + direction * distance;
    surface.normal = packedNormal(texel);
    surface.geometricNormal = unitFromOctahedral(unpackSnorm2x16(texel.y));
    surface.albedo = color.rgb * color.rgb;
    surface.metalness = color.a;
    surface.roughness = packedRoughness(texel);
    Material material = frame.materials.at[texel.w >> 16u];
    surface.emission = material.emission;
    surface.opacity = material.opacity;
    return true;
}

#endif
