// Adds the light of a frame to that of the frames before, where they saw the same surface (Schied et al., "Spatiotemporal
// Variance-Guided Filtering", 2017).
#include "viewer/history.glsl"

// Samples in the mean of matte layers while the camera moves.
const float kMostSamples = 48.0;
// Of other layers, whose picture moves otherwise than their surface: those in which a highlight moves by its width, but these at least: of fewer
// the picture of a moving eye is further from the reference.
const float kLeastMirrorSamples = 2.0;
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
const float kFewestNearby = 4.0; // samples there that say enough
// While it stands.
const float kMostStillSamples = 65536.0;
// Samples before the variance over time says enough.
const float kFirstSamples = 4.0;

// The number of samples that a pixel has in so many frames, by turns.
float samplesIn(float frames) {
    return max(frames / float(frame.lightTurns), 1.0);
}

struct History {
    vec4 matte;
    vec4 mirrored;
    vec4 moments;
};

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
            vec4 matte = frame.planes.at[planePlace(kPlaneMatte, pixelPlace(now))];
            if (!isSample(matte)) {
                continue;
            }
            vec2 light = vec2(brightness(matte.rgb), brightness(frame.planes.at[planePlace(kPlaneMirrored, pixelPlace(now))].rgb));
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
    bool saysEnough = nearby.count >= kFewestNearby;
    bvec2 differs = greaterThan(abs(mean - before), max(kMostErrors * error, kLeastChange * max(mean, before)));
    return bvec2(saysEnough && differs.x, saysEnough && differs.y);
}

const History kNoHistory = History(vec4(0.0), vec4(0.0), vec4(0.0));

// Adds the history of a pixel that saw the same surface, which was at `point`. Returns its weight, or 0.
float addHistory(inout History sum, ivec2 pixel, float weight, Seen seen, vec3 point) {
    if (weight <= 0.0 || !sawSame(pixel, seen, point)) {
        return 0.0;
    }
    uint from = pixelPlace(pixel);
    sum.matte += weight * frame.planes.at[previousPlane(kPlaneMatteHistory, from)];
    sum.mirrored += weight * frame.planes.at[previousPlane(kPlaneMirroredHistory, from)];
    sum.moments += weight * frame.planes.at[previousPlane(kPlaneMoments, from)];
    return weight;
}

// The mean of the frames before around a place in pixels, of the pixels that saw the same surface; its matte.a is 0 without any. If
// hardly any of the nearest four did, of the nearest nine: what is covered by chance shows a pixel one surface now and another one then.
History historyAt(vec2 place, Seen seen, vec3 point) {
    History sum = kNoHistory;
    Taps taps = tapsAt(place);
    float total = 0.0;
    for (int number = 0; number < 4; ++number) {
        total += addHistory(sum, tapPixel(taps, number), tapWeight(taps, number), seen, point);
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
    vec4 matte = frame.planes.at[planePlace(kPlaneMatte, place)];
    vec3 mirrored = frame.planes.at[planePlace(kPlaneMirrored, place)].rgb;
    History history = kNoHistory;
    vec3 point = seenPoint(frame.camera, pixel, seen.distance);
    vec4 beforeAndTurn = frame.planes.at[planePlace(kPlaneBefore, place)];
    vec3 before = beforeAndTurn.xyz;
    float mostMatte = frame.sceneMoves != 0u ? samplesIn(kMostMovingFrames) : kMostSamples;
    float mostMirrored = min(max(samplesIn(framesOfHighlight(seen, point, before)), kLeastMirrorSamples), mostMatte);
    if (frame.frameNumber > 0u && !isSky(seen)) {
        vec2 from = vec2(pixel) + 0.5 - motionOf(point, before);
        history = historyAt(from, seen, before);
        if (frame.sceneMoves != 0u && history.matte.a > 0.0) {
            float ofRotation = samplesIn(max(kMostTurn / max(beforeAndTurn.w, 1e-6), kLeastTurnFrames));
            float ofChange = min(ofRotation, samplesIn(kMostChangedFrames));
            bvec2 changed = hasChanged(nearbyLight(pixel, ivec2(floor(from)), seen));
            mostMatte = min(mostMatte, changed.x ? ofChange : ofRotation);
            mostMirrored = min(mostMirrored, changed.y ? ofChange : ofRotation);
        }
    }
    bool isStill = frame.stillCount > 0u;
    if (isSample(matte)) {
        history.matte = extended(history.matte, matte.rgb, isStill ? kMostStillSamples : mostMatte);
        history.mirrored = extended(history.mirrored, mirrored, isStill ? kMostStillSamples : mostMirrored);
        vec2 bright = vec2(brightness(matte.rgb), brightness(mirrored));
        history.moments = mix(history.moments, vec4(bright, bright * bright), 1.0 / vec2(history.matte.a, history.mirrored.a).xyxy);
    }
    vec2 counts = max(vec2(history.matte.a, history.mirrored.a), 1.0);
    // Of the mean. A few samples say little about how much their light varies.
    vec2 variance = max(history.moments.zw - history.moments.xy * history.moments.xy, 0.0);
    vec2 few = max(kFirstSamples / counts - 1.0, 0.0) * history.moments.xy * history.moments.xy;
    variance = variance / counts + few;
    frame.planes.at[currentPlane(kPlaneMatteHistory, place)] = history.matte;
    frame.planes.at[currentPlane(kPlaneMirroredHistory, place)] = history.mirrored;
    frame.planes.at[currentPlane(kPlaneMoments, place)] = history.moments;
    frame.planes.at[planePlace(kPlaneMatte + 1u, place)] = vec4(history.matte.rgb, variance.x);
    frame.planes.at[planePlace(kPlaneMirrored + 1u, place)] = vec4(history.mirrored.rgb, variance.y);
}

#define PIXEL_FUNCTION temporalPixel
#include "common/for_each_pixel.glsl"
