// Which pixels find light in a frame: all, or one of each 2 x 2, by turns.
#ifndef VIEWER_LIGHT_TURN
#define VIEWER_LIGHT_TURN

#include "viewer/frame.glsl"
#include "viewer/random.glsl"

// Turns, each of one pixel of 2 x 2.
const uint kTurns = 4u;
// Set in the number of a sample that a pixel has out of turn.
const uint kOutOfTurn = 0x80000000u;

bool takesTurns() {
    return frame.lightTurns == kTurns;
}

// True if it is a pixel's turn. Each has one in every four frames, in another order each time: places within pixels repeat too.
bool isTurn(uvec2 pixel) {
    uint corner = ((pixel.x ^ pixel.y) & 1u) << 1 | (pixel.y & 1u);
    uint order = hashWord(frame.frameNumber / kTurns);
    return !takesTurns() || (corner ^ order ^ frame.frameNumber) % kTurns == 0u;
}

// The number of the first sample of a pixel in this frame. Samples in turn have numbers that follow each other, so that they are spread
// evenly.
uint firstSample(uvec2 pixel) {
    if (!takesTurns()) {
        return frame.sampleNumber;
    }
    return isTurn(pixel) ? frame.frameNumber / kTurns : kOutOfTurn | frame.frameNumber;
}

// Of `count` pixels in a row, number `at` if the even ones come first.
uint evenFirst(uint at, uint count) {
    uint evens = (count + 1u) / 2u;
    return at < evens ? 2u * at : 2u * (at - evens) + 1u;
}

// The pixel of an invocation. Where pixels take turns, those with the same turn are side by side, so that whole groups of invocations
// have light to find or none.
uvec2 pixelOfInvocation(uvec2 at) {
    return takesTurns() ? uvec2(evenFirst(at.x, frame.camera.width), evenFirst(at.y, frame.camera.height)) : at;
}

#endif
