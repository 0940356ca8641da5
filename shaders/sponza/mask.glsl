// Holes that a texture's alpha cuts.
#ifndef SPONZA_MASK
#define SPONZA_MASK

#include "sponza/frame.glsl"

// The texture's colour and alpha; white for materials without one. Called by all four pixels of a quad.
vec4 texelOf(uint material, vec2 texcoord) {
    vec2 right = dFdx(texcoord);
    vec2 down = dFdy(texcoord);
    uint tex = frame.scene.materials.at[material].albedoTexture;
    if (tex == kNoTexture) {
        return vec4(1.0);
    }
    return textureBindless2DGrad(tex, frame.surfaceSampler, texcoord, right, down);
}

bool isHole(uint material, float alpha) {
    return frame.finishes.at[material].isMasked != 0u && alpha < 0.5;
}

#endif
