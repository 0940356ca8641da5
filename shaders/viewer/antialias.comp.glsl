// Antialiasing over time: each frame sees another place in every pixel, and the picture is their mean. Where the camera moves, a mean
// that is unlike the neighbourhood is pulled towards it, and bright light counts less, so that one bright sample does not outweigh all
// others (Karis, "High Quality Temporal Supersampling", 2014). The mean is read by a spline, along the motion of what is in front. The first 64 frames of a still count alike; from then on newer ones, which
// the filter has blurred less, count more. `argument`: which of both planes the filter ended in.
#include "viewer/plane.glsl"

const float kMostFrames = 6.0; // while the camera moves
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
    vec3 spread = 0.75 * sqrt(max(squares / 9.0 - middle * middle, 0.0));
    return clamp(before, middle - spread, middle + spread);
}

// Weights of four neighbours by a Catmull-Rom spline, `part` of the way from the second to the third. It blurs less than a mean of two,
// which blurs the picture anew in each frame.
vec4 splineWeights(float part) {
    vec4 powers = vec4(1.0, part, part * part, part * part * part);
    return 0.5 * vec4(dot(powers, vec4(0.0, -1.0, 2.0, -1.0)), dot(powers, vec4(2.0, 0.0, -5.0, 3.0)),
                      dot(powers, vec4(0.0, 1.0, 4.0, -3.0)), dot(powers, vec4(0.0, 0.0, -1.0, 1.0)));
}

// The mean of the frames before at a place in pixels, and the number of frames in it.
vec4 before(vec2 place) {
    vec2 low = floor(place - 0.5);
    vec2 part = place - 0.5 - low;
    vec4 columns = splineWeights(part.x);
    vec4 rows = splineWeights(part.y);
    vec4 sum = vec4(0.0);
    ivec2 last = ivec2(frame.camera.width, frame.camera.height) - 1;
    for (int tap = 0; tap < 16; ++tap) {
        ivec2 offset = ivec2(tap & 3, tap >> 2);
        ivec2 from = clamp(ivec2(low) + offset - 1, ivec2(0), last);
        vec4 mean = frame.planes.at[previousPlane(kPlaneColor, pixelPlace(from))];
        sum += columns[offset.x] * rows[offset.y] * vec4(compressed(mean.rgb), mean.a);
    }
    return max(sum, 0.0);
}

vec2 motionAt(ivec2 pixel, Seen seen) {
    float distance = isSky(seen) ? kSkyDistance * frame.camera.nearPlane : seen.distance;
    vec3 point = seenPoint(frame.camera, pixel, distance);
    return motionOf(point, frame.planes.at[planePlace(kPlaneBefore, pixelPlace(pixel))].xyz);
}

// The motion of the nearest of the surfaces around a pixel, which shows `found`: an edge moves with what is in front.
vec2 motionAround(ivec2 pixel, Seen found) {
    ivec2 last = ivec2(frame.camera.width, frame.camera.height) - 1;
    ivec2 nearest = pixel;
    for (int tap = 0; tap < 9; ++tap) {
        ivec2 at = clamp(pixel + ivec2(tap % 3, tap / 3) - 1, ivec2(0), last);
        Seen seen = unpackedSeen(frame.planes.at[currentPlane(kPlaneSurface, pixelPlace(at))]);
        if (!isSky(seen) && (isSky(found) || seen.distance < found.distance)) {
            nearest = at;
            found = seen;
        }
    }
    return motionAt(nearest, found);
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
    if (isStill()) {
        mean = frame.planes.at[previousPlane(kPlaneColor, place)];
    } else if (frame.frameNumber > 0u) {
        vec2 from = vec2(pixel) + 0.5 - motionAround(pixel, seen);
        bool isInside = all(greaterThanEqual(from, vec2(0.0))) && all(lessThan(from, vec2(frame.camera.width, frame.camera.height)));
        if (isInside) {
            mean = before(from);
            mean.rgb = nearby(pixel, mean.rgb);
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
