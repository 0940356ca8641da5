// Antialiasing over time: each frame sees another place in every pixel, and the picture is their mean. Where the camera moves, a mean
// that is unlike the neighbourhood is pulled towards it, and bright light counts less, so that one bright sample does not outweigh all
// others (Karis, "High Quality Temporal Supersampling", 2014). The first 64 frames of a still count alike; from then on newer ones, which
// the filter has blurred less, count more. `argument`: which of both planes the filter ended in.
#include "viewer/plane.glsl"

const float kMostFrames = 12.0; // while the camera moves
const float kMostStillFrames = 64.0;

bool isStill() {
    return frame.stillCount > 0u;
}

vec3 compressed(vec3 color) {
    return isStill() ? color : color / (1.0 + frame.exposure * brightness(color));
}

vec3 expanded(vec3 color) {
    return isStill() ? color : color / max(1.0 - frame.exposure * brightness(color), 1e-4);
}

vec3 nearby(ivec2 pixel, vec3 before) {
    vec3 sum = vec3(0.0);
    vec3 squares = vec3(0.0);
    ivec2 last = ivec2(frame.camera.width, frame.camera.height) - 1;
    for (int tap = 0; tap < 9; ++tap) {
        ivec2 at = clamp(pixel + ivec2(tap % 3, tap / 3) - 1, ivec2(0), last);
        vec3 color = compressed(frame.planes.at[planePlace(kPlaneFrame, pixelPlace(at))].rgb);
        sum += color;
        squares += color * color;
    }
    vec3 middle = sum / 9.0;
    vec3 spread = 1.25 * sqrt(max(squares / 9.0 - middle * middle, 0.0));
    return clamp(before, middle - spread, middle + spread);
}

vec4 before(vec2 place) {
    vec2 low = floor(place - 0.5);
    vec2 part = place - 0.5 - low;
    vec4 sum = vec4(0.0);
    ivec2 last = ivec2(frame.camera.width, frame.camera.height) - 1;
    for (int corner = 0; corner < 4; ++corner) {
        ivec2 offset = ivec2(corner & 1, corner >> 1);
        vec2 share = mix(1.0 - part, part, vec2(offset));
        vec4 mean = frame.planes.at[previousPlane(kPlaneColor, pixelPlace(clamp(ivec2(low) + offset, ivec2(0), last)))];
        sum += share.x * share.y * vec4(compressed(mean.rgb), mean.a);
    }
    return sum;
}

vec2 motionAt(ivec2 pixel, Seen seen) {
    float distance = isSky(seen) ? kSkyDistance * frame.camera.nearPlane : seen.distance;
    vec3 point = seenPoint(frame.camera, pixel, distance);
    return motionOf(point, frame.planes.at[planePlace(kPlaneBefore, pixelPlace(pixel))].xyz);
}

vec3 dataOf(uint place, ivec2 pixel, Seen seen) {
    switch (frame.view) {
    case kViewNormals: return isSky(seen) ? vec3(0.0) : seen.normal * 0.5 + 0.5;
    case kViewRoughness: return vec3(isSky(seen) ? 0.0 : seen.roughness);
    case kViewMotion: return vec3(0.5 + 0.05 * motionAt(pixel, seen), 0.5);
    case kViewAlbedo: return frame.planes.at[planePlace(kPlaneMatteAlbedo, place)].rgb;
    case kViewMatte: return frame.exposure * frame.planes.at[planePlace(kPlaneMatte + argument, place)].rgb;
    case kViewMirrored: return frame.exposure * frame.planes.at[planePlace(kPlaneMirrored + argument, place)].rgb;
    default: return vec3(0.0);
    }
}

void antialiasPixel(uvec2 at) {
    ivec2 pixel = ivec2(at);
    uint place = pixelPlace(pixel);
    Seen seen = unpackedSeen(frame.planes.at[currentPlane(kPlaneSurface, place)]);
    vec3 color = compressed(frame.planes.at[planePlace(kPlaneFrame, place)].rgb);
    vec4 mean = vec4(0.0);
    if (frame.frameNumber > 0u) {
        vec2 from = vec2(pixel) + 0.5 - (isStill() ? vec2(0.0) : motionAt(pixel, seen));
        bool isInside = all(greaterThanEqual(from, vec2(0.0))) && all(lessThan(from, vec2(frame.camera.width, frame.camera.height)));
        if (isInside) {
            mean = before(from);
            mean.rgb = isStill() ? mean.rgb : nearby(pixel, mean.rgb);
        }
    }
    float count = min(mean.a + 1.0, isStill() ? kMostStillFrames : kMostFrames);
    mean = vec4(expanded(mix(mean.rgb, color, 1.0 / count)), count);
    frame.planes.at[currentPlane(kPlaneColor, place)] = mean;
    vec3 shown = frame.view == kViewLight ? mean.rgb : dataOf(place, pixel, seen);
    frame.planes.at[planePlace(kPlaneShown, place)] = vec4(shown, 1.0);
}

#define PIXEL_FUNCTION antialiasPixel
#include "common/for_each_pixel.glsl"
