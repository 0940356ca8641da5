// The surface at a hit, textures included.
#ifndef RTX_TEXTURES_SURFACE
#define RTX_TEXTURES_SURFACE

#include "rtx_textures/frame.glsl"

struct Found {
    vec3 albedo; // linear
    float distance; // from the ray's origin; below 0 where it met nothing
    vec3 normal; // in the world, unit length
    float gloss; // of a coat that reflects, 0 to 1
};

// Texture coordinates per unit of length of each model.
const float kTexturing[3] = float[](0.5, 1.3, 1.6);

// `travelled`: from the eye to the surface, along all rays.
vec3 textured(uint customIndex, vec2 texcoord, float cosine, float travelled) {
    uint tex = customIndex & 0xffffu;
    float texels = float(textureBindlessSize2D(tex).x) * kTexturing[customIndex >> 16];
    float lod = log2(max(texels * travelled * frame.camera.pixelSpread / max(cosine, 0.15), 1.0));
    return textureBindless2DLod(tex, frame.smp, texcoord, lod).rgb;
}

// The corners' attributes between the corners, and the texture there.
Found surfaceOf(uint customIndex, uint primitive, vec2 b, mat3 toWorld, vec3 direction, float distance, float travelled) {
    uvec3 corner = frame.triangles.at[frame.firstTriangle[customIndex >> 16] + primitive];
    vec3 weights = vec3(1.0 - b.x - b.y, b);
    vec3 normal = weights.x * frame.vertices.at[corner.x].normal + weights.y * frame.vertices.at[corner.y].normal +
                  weights.z * frame.vertices.at[corner.z].normal;
    vec2 texcoord = weights.x * frame.vertices.at[corner.x].texcoord + weights.y * frame.vertices.at[corner.y].texcoord +
                    weights.z * frame.vertices.at[corner.z].texcoord;
    Found found;
    found.normal = normalize(toWorld * normal);
    found.distance = distance;
    found.albedo = textured(customIndex, texcoord, abs(dot(found.normal, direction)), travelled + distance);
    found.gloss = 0.0;
    return found;
}

// Of the hit groups: paint is dull, glaze deepens colours and reflects.
Found asPainted(Found found) {
    return found;
}

Found asGlazed(Found found) {
    found.albedo *= found.albedo;
    found.gloss = 1.0;
    return found;
}

#endif
