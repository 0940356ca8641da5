// The material at a point of a surface: factors times textures.
#ifndef VIEWER_MATERIAL
#define VIEWER_MATERIAL

#include "viewer/hit.glsl"

// The texel that slot `slot` of the material has there, or white.
vec4 texelOf(uint material, uint slot, Texcoords texcoords, float footprint) {
    uint number = frame.materials.at[material].slots[slot];
    if (number == kNoTexture) {
        return vec4(1.0);
    }
    vec2 texcoord = texcoords.sets[frame.slots.at[number].set];
    vec4 columns = frame.slots.at[number].columns;
    vec2 place = columns.xy * texcoord.x + columns.zw * texcoord.y + frame.slots.at[number].offset;
    uint tex = frame.slots.at[number].tex;
    uint smp = frame.slots.at[number].smp;
    if (footprint <= 0.0) {
        return textureBindless2DLod(tex, smp, place, 0.0);
    }
    vec2 texels = vec2(textureBindlessSize2D(tex));
    float stretch = sqrt(abs(columns.x * columns.w - columns.y * columns.z) * texels.x * texels.y);
    return textureBindless2DLod(tex, smp, place, log2(max(footprint * stretch, 1e-6)));
}

vec4 baseColorOf(uint material, AttributesArray all, uvec3 corners, vec3 weights, Texcoords texcoords, float footprint) {
    return frame.materials.at[material].baseColor * vertexColor(all, corners, weights) *
           texelOf(material, kSlotBaseColor, texcoords, footprint);
}

#endif
