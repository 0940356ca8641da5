// Five levels of a depth pyramid from the level before them, the first five from the depth itself. A work group makes the texels above
// 32 times 32 texels of the source. Depth is reversed, so the farthest is the smallest.
#include "viewer/pyramid.glsl"

const uint kSide = 16u;
layout(local_size_x = 16, local_size_y = 16) in;

const float kNearest = 1.0; // of what lies beside the picture: it hides no farther depth

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer DepthArray { float at[]; };

layout(push_constant, scalar) uniform PushConstants {
    DepthArray pyramid;
    uvec2 pixels;
    uint depthTexture;
    uint source; // the level that is read; 0 for the depth itself
};

shared float farthest[kSide][kSide];

float sourceDepth(uvec2 texel) {
    uvec2 size = levelSize(pixels, source);
    if (any(greaterThanEqual(texel, size))) {
        return kNearest;
    }
    return source == 0u ? texelFetch(kTextures2D[depthTexture], ivec2(texel), 0).r
                        : pyramid.at[levelPlace(pixels, source) + texel.y * size.x + texel.x];
}

void store(uint level, uvec2 texel, float depth) {
    uvec2 size = levelSize(pixels, level);
    if (level <= lastLevel(pixels) && all(lessThan(texel, size))) {
        pyramid.at[levelPlace(pixels, level) + texel.y * size.x + texel.x] = depth;
    }
}

void main() {
    uvec2 here = gl_LocalInvocationID.xy;
    uvec2 texel = gl_GlobalInvocationID.xy;
    float depth = min(min(sourceDepth(2u * texel), sourceDepth(2u * texel + uvec2(1u, 0u))),
                      min(sourceDepth(2u * texel + uvec2(0u, 1u)), sourceDepth(2u * texel + 1u)));
    farthest[here.y][here.x] = depth;
    store(source + 1u, texel, depth);
    uint level = source + 2u;
    for (uint step = 1u; step < kSide; step *= 2u) {
        barrier();
        if (all(equal(here & (2u * step - 1u), uvec2(0u)))) {
            float beside = min(farthest[here.y][here.x + step], farthest[here.y + step][here.x + step]);
            depth = min(min(depth, farthest[here.y + step][here.x]), beside);
            farthest[here.y][here.x] = depth;
            store(level, texel >> (level - source - 1u), depth);
        }
        ++level;
    }
}
