// The places of a depth pyramid in its buffer. A texel of level L has the farthest depth of the pixels whose numbers, shifted right by
// L, are its own: sizes are rounded up, so that each pixel is in a texel of each level. Level 1 comes first; the last has one texel.
#ifndef VIEWER_PYRAMID
#define VIEWER_PYRAMID

// Texels of a level of a picture with this many pixels.
uvec2 levelSize(uvec2 pixels, uint level) {
    return ((pixels - 1u) >> level) + 1u;
}

uint lastLevel(uvec2 pixels) {
    uint level = 1u;
    while (any(greaterThan(levelSize(pixels, level), uvec2(1u)))) {
        ++level;
    }
    return level;
}

// Place of the first texel of a level.
uint levelPlace(uvec2 pixels, uint level) {
    uint place = 0u;
    for (uint before = 1u; before < level; ++before) {
        uvec2 size = levelSize(pixels, before);
        place += size.x * size.y;
    }
    return place;
}

#endif
