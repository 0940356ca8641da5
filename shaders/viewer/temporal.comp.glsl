// Adds the light of a frame to that of the frames before, where they saw the same surface (Schied et al., "Spatiotemporal
// Variance-Guided Filtering", 2017).
#include "viewer/plane.glsl"

// Frames in the mean of matte layers while the camera moves.
const float kMostFrames = 48.0;
// Of other layers, whose picture moves otherwise than their surface: until a highlight has moved by its width, but these at least.
const float kLeastMirrorFrames = 2.0;
// While something else moves, whose light and shadow move with it.
const float kMostMovingFrames = 16.0;
// While a surface turns: until it has turned by so many radians, but these at least.
const float kMostTurn = 0.1;
const float kLeastTurnFrames = 2.0;
// Where light around a pixel has changed, as by a shadow that moves: by more than so many standard errors, in a square of pixels with this
// half side.
const float kMostChangedFrames = 3.0;
const float kMostErrors = 2.5;
const float kLeastChange = 0.03; // of the light
const int kNearbyPixels = 2;
// While it stands.
const float kMostStillFrames = 65536.0;
// Frames before the variance over time says enough.
const float kFirstFrames = 4.0;
// Of the weight of the nearest four pixels.
const float kLeastShare = 0.05;
// Of the angle between normals of one surface.
const float kLeastCosine = 0.8;

struct History {
    vec4 matte;
    vec4 mirrored;
    vec4 moments;
};

bool isSameSurface(Seen seen, vec3 point, Seen before, ivec2 pixel) {
    if (isSky(before) || before.instance != seen.instance || dot(before.normal, seen.normal) < kLeastCosine) {
        return false;
    }
    vec3 way = seenPoint(frame.seenBefore, pixel, before.distance) - point;
    return abs(dot(way, seen.normal)) < 0.01 * seen.distance;
}

// Brightnesses around a pixel: sums of this frame's, of their squares, and of the means of the frames before.
struct Nearby {
    vec2 sum;
    vec2 squares;
    vec2 before;
    float count;
};

// The light of this frame on the same surface around a pixel, and of the frames before around the pixel `before` of theirs.
Nearby nearbyLight(ivec2 pixel, ivec2 before, Seen seen) {
    Nearby nearby = Nearby(vec2(0.0), vec2(0.0), vec2(0.0), 0.0);
    ivec2 last = ivec2(frame.camera.width, frame.camera.height) - 1;
    for (int y = -kNearbyPixels; y <= kNearbyPixels; ++y) {
        for (int x = -kNearbyPixels; x <= kNearbyPixels; ++x) {
            ivec2 now = pixel + ivec2(x, y);
            ivec2 then = before + ivec2(x, y);
            if (any(lessThan(min(now, then), ivec2(0))) || any(greaterThan(max(now, then), last))) {
                continue;
            }
            Seen other = unpackedSeen(frame.planes.at[currentPlane(kPlaneSurface, pixelPlace(now))]);
            Seen old = unpackedSeen(frame.planes.at[previousPlane(kPlaneSurface, pixelPlace(then))]);
            if (isSky(other) || isSky(old) || other.instance != seen.instance || old.instance != seen.instance) {
                continue;
            }
            vec2 light = vec2(brightness(frame.planes.at[planePlace(kPlaneMatte, pixelPlace(now))].rgb),
                              brightness(frame.planes.at[planePlace(kPlaneMirrored, pixelPlace(now))].rgb));
            nearby.sum += light;
            nearby.squares += light * light;
            nearby.before += frame.planes.at[previousPlane(kPlaneMoments, pixelPlace(then))].xy;
            nearby.count += 1.0;
        }
    }
    return nearby;
}

// True for matte and mirrored light that has changed: the mean around a pixel differs by more than noise and rounding do.
bvec2 hasChanged(Nearby nearby) {
    float count = max(nearby.count, 1.0);
    vec2 mean = nearby.sum / count;
    vec2 before = nearby.before / count;
    vec2 error = sqrt(max(nearby.squares / count - mean * mean, 0.0) / count);
    return greaterThan(abs(mean - before), max(kMostErrors * error, kLeastChange * max(mean, before)));
}

const History kNoHistory = History(vec4(0.0), vec4(0.0), vec4(0.0));

// Adds the history of a pixel that saw the same surface, which was at `point`. Returns its weight, or 0.
float addHistory(inout History sum, ivec2 pixel, float weight, Seen seen, vec3 point) {
    bool isInside = all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, ivec2(frame.camera.width, frame.camera.height)));
    if (weight <= 0.0 || !isInside) {
        return 0.0;
    }
    uint from = pixelPlace(pixel);
    if (!isSameSurface(seen, point, unpackedSeen(frame.planes.at[previousPlane(kPlaneSurface, from)]), pixel)) {
        return 0.0;
    }
    sum.matte += weight * frame.planes.at[previousPlane(kPlaneMatteHistory, from)];
    sum.mirrored += weight * frame.planes.at[previousPlane(kPlaneMirroredHistory, from)];
    sum.moments += weight * frame.planes.at[previousPlane(kPlaneMoments, from)];
    return weight;
}

// The mean of the frames before around a place in pixels, of the pixels that saw the same surface; its matte.a is 0 without any. If
// hardly any of the nearest four did, of the nearest nine: what is covered by chance shows a pixel one surface now and another one then.
History historyAt(vec2 place, Seen seen, vec3 point) {
    History sum = kNoHistory;
    vec2 low = floor(place - 0.5);
    vec2 part = place - 0.5 - low;
    part = mix(part, round(part), lessThan(abs(part - round(part)), vec2(0.01)));
    float total = 0.0;
    for (int corner = 0; corner < 4; ++corner) {
        ivec2 offset = ivec2(corner & 1, corner >> 1);
        vec2 share = mix(1.0 - part, part, vec2(offset));
        total += addHistory(sum, ivec2(low) + offset, share.x * share.y, seen, point);
    }
    if (total <= kLeastShare) {
        sum = kNoHistory;
        total = 0.0;
        for (int tap = 0; tap < 9; ++tap) {
            total += addHistory(sum, ivec2(floor(place)) + ivec2(tap % 3, tap / 3) - 1, 1.0, seen, point);
        }
    }
    float inverse = total > 0.0 ? 1.0 / total : 0.0;
    return History(sum.matte * inverse, sum.mirrored * inverse, sum.moments * inverse);
}

// A mean with one more number, of which it holds `most` at most; the last component counts them.
vec4 extended(vec4 mean, vec3 next, float most) {
    float count = min(mean.a + 1.0, most);
    return vec4(mix(mean.rgb, next, 1.0 / count), count);
}

// Frames in which the eye goes around a surface by the width of a highlight.
float framesOfHighlight(Seen seen, vec3 point, vec3 pointBefore) {
    vec3 turned = normalize(point - frame.camera.eye) - normalize(pointBefore - frame.seenBefore.eye);
    return seen.roughness * seen.roughness / max(length(turned), 1e-6);
}

void temporalPixel(uvec2 at) {
    ivec2 pixel = ivec2(at);
    uint place = pixelPlace(pixel);
    Seen seen = unpackedSeen(frame.planes.at[currentPlane(kPlaneSurface, place)]);
    vec3 matte = frame.planes.at[planePlace(kPlaneMatte, place)].rgb;
    vec3 mirrored = frame.planes.at[planePlace(kPlaneMirrored, place)].rgb;
    History history = kNoHistory;
    vec3 point = seenPoint(frame.camera, pixel, seen.distance);
    vec4 beforeAndTurn = frame.planes.at[planePlace(kPlaneBefore, place)];
    vec3 before = beforeAndTurn.xyz;
    float matteFrames = frame.sceneMoves != 0u ? kMostMovingFrames : kMostFrames;
    float mirrorFrames = clamp(framesOfHighlight(seen, point, before), kLeastMirrorFrames, matteFrames);
    if (frame.frameNumber > 0u && !isSky(seen)) {
        vec2 from = vec2(pixel) + 0.5 - motionOf(point, before);
        history = historyAt(from, seen, before);
        if (frame.sceneMoves != 0u && history.matte.a > 0.0) {
            float turnFrames = max(kMostTurn / max(beforeAndTurn.w, 1e-6), kLeastTurnFrames);
            bvec2 changed = hasChanged(nearbyLight(pixel, ivec2(floor(from)), seen));
            matteFrames = min(matteFrames, changed.x ? min(turnFrames, kMostChangedFrames) : turnFrames);
            mirrorFrames = min(mirrorFrames, changed.y ? min(turnFrames, kMostChangedFrames) : turnFrames);
        }
    }
    bool isStill = frame.stillCount > 0u;
    history.matte = extended(history.matte, matte, isStill ? kMostStillFrames : matteFrames);
    history.mirrored = extended(history.mirrored, mirrored, isStill ? kMostStillFrames : mirrorFrames);
    vec2 bright = vec2(brightness(matte), brightness(mirrored));
    vec4 counts = vec2(history.matte.a, history.mirrored.a).xyxy;
    history.moments = mix(history.moments, vec4(bright, bright * bright), 1.0 / counts);
    // Of the mean. A few frames say little about how much their light varies.
    vec2 variance = max(history.moments.zw - history.moments.xy * history.moments.xy, 0.0);
    vec2 few = max(kFirstFrames / counts.xy - 1.0, 0.0) * history.moments.xy * history.moments.xy;
    variance = variance / counts.xy + few;
    frame.planes.at[currentPlane(kPlaneMatteHistory, place)] = history.matte;
    frame.planes.at[currentPlane(kPlaneMirroredHistory, place)] = history.mirrored;
    frame.planes.at[currentPlane(kPlaneMoments, place)] = history.moments;
    frame.planes.at[planePlace(kPlaneMatte + 1u, place)] = vec4(history.matte.rgb, variance.x);
    frame.planes.at[planePlace(kPlaneMirrored + 1u, place)] = vec4(history.mirrored.rgb, variance.y);
}

#define PIXEL_FUNCTION temporalPixel
#include "common/for_each_pixel.glsl"
