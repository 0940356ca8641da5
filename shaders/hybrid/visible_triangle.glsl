// The result of the visibility pass, of either rasteriser.
#ifndef HYBRID_VISIBLE_TRIANGLE
#define HYBRID_VISIBLE_TRIANGLE

#include "hybrid/frame.glsl"
#include "hybrid/hit.glsl"

// The triangle that the pixel shows; kNoTriangle also where the ray must say, and then `isInDoubt`. What hardware found is
// taken at its word: hardware_visibility.glsl knows better.
uint visibleTriangle(uvec2 pixel, out bool isInDoubt) {
    isInDoubt = false;
    if (frame.visibility.image != kNoImage) {
        return textureBindlessFetchU2D(frame.visibility.image, ivec2(pixel), 0).x;
    }
    uvec2 word = frame.visibility.words.at[pixel.y * frame.camera.width + pixel.x];
    isInDoubt = word.x == kAskRay;
    return word.y == kNoTriangle || isInDoubt ? kNoTriangle : ~word.x;
}

#endif
