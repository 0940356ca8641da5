// Where the frame before saw the surface that a pixel shows.
#ifndef VIEWER_HISTORY
#define VIEWER_HISTORY

#include "viewer/plane.glsl"

// Of the weight of the nearest four pixels.
const float kLeastShare = 0.05;
// Of the angle between normals of one surface.
const float kLeastCosine = 0.8;

// True if a pixel of the frame before saw the same surface, which was at `point`. `seen`: as unpackedSeen() has it.
bool sawSame(ivec2 pixel, Seen seen, vec3 point) {
    bool isInside = all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, ivec2(frame.camera.width, frame.camera.height)));
    if (!isInside) {
        return false;
    }
    Seen before = unpackedSeen(frame.planes.at[previousPlane(kPlaneSurface, pixelPlace(pixel))]);
    if (isSky(before) || before.instance != seen.instance || dot(before.normal, seen.normal) < kLeastCosine) {
        return false;
    }
    vec3 way = seenPoint(frame.seenBefore, pixel, before.distance) - point;
    return abs(dot(way, seen.normal)) < 0.01 * seen.distance;
}

// The nearest four pixels around a place, and their weights.
struct Taps {
    ivec2 low;
    vec2 part;
};

Taps tapsAt(vec2 place) {
    vec2 low = floor(place - 0.5);
    vec2 part = place - 0.5 - low;
    return Taps(ivec2(low), mix(part, round(part), lessThan(abs(part - round(part)), vec2(0.01))));
}

ivec2 tapPixel(Taps taps, int number) {
    return taps.low + ivec2(number & 1, number >> 1);
}

float tapWeight(Taps taps, int number) {
    vec2 share = mix(1.0 - taps.part, taps.part, vec2(number & 1, number >> 1));
    return share.x * share.y;
}

// True if the nearest four pixels have enough of a history of a surface, which was at `point`.
bool hasHistory(vec2 place, Seen seen, vec3 point) {
    Taps taps = tapsAt(place);
    float total = 0.0;
    for (int number = 0; number < 4; ++number) {
        float weight = tapWeight(taps, number);
        total += weight > 0.0 && sawSame(tapPixel(taps, number), seen, point) ? weight : 0.0;
    }
    return total > kLeastShare;
}

#endif
