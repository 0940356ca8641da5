// The material at a point of a surface: factors times textures.
#ifndef VIEWER_MATERIAL
#define VIEWER_MATERIAL

#include "viewer/hit.glsl"

// Reports that a mip level of an image is wanted, if levels come and go. The rasteriser only reads: its depth test is then before
// its shader, and rays report what it shows.
void wantMip(uint image, float mip) {
#ifndef VIEWER_RASTERISES
    if (frame.wantedMips != uvec2(0u)) {
        LevelArray levels = LevelArray(frame.wantedMips);
        uint level = uint(max(mip, 0.0));
        if (levels.at[image] > level) {
            atomicMin(levels.at[image], level);
        }
    }
#endif
}

// The texel that slot `slot` of the material has there, or white.
vec4 texelOf(uint material, uint slot, Texcoords texcoords, vec2 footprints) {
    uint number = frame.materials.at[material].slots[slot];
    if (number == kNoTexture) {
        return vec4(1.0);
    }
    vec2 texcoord = texcoords.sets[frame.slots.at[number].set];
    vec4 columns = frame.slots.at[number].columns;
    vec2 place = columns.xy * texcoord.x + columns.zw * texcoord.y + frame.slots.at[number].offset;
    float mip = 0.0;
    float footprint = footprints[frame.slots.at[number].set];
    if (footprint > 0.0) {
        vec2 texels = vec2(frame.slots.at[number].extent);
        float stretch = sqrt(abs(columns.x * columns.w - columns.y * columns.z) * texels.x * texels.y);
        mip = log2(max(footprint * stretch, 1e-6));
    }
    wantMip(frame.slots.at[number].image, mip);
    float residentMip = mip - float(frame.slots.at[number].firstMip);
    return textureBindless2DLod(frame.slots.at[number].tex, frame.slots.at[number].smp, place, residentMip);
}

vec4 baseColorOf(uint material, AttributesArray all, uvec3 corners, vec3 weights, Texcoords texcoords, vec2 footprints) {
    return frame.materials.at[material].baseColor * vertexColor(all, corners, weights) *
           texelOf(material, kSlotBaseColor, texcoords, footprints);
}

#endif
