// A step of an edge-avoiding a-trous filter, guided by the variance of light over time (Schied et al., 2017). Light that no longer
// varies is not blurred. The taps of step n are 2^n pixels apart, 3 x 3 of them: with 5 x 5 a step takes twice as long, and pictures are no
// nearer to the reference. The last step makes the picture of the frame: filtered light with the colours of its surfaces. `argument`: number
// of the step (8 bits); whether it is the last one (1 bit).
#include "viewer/plane.glsl"

const uint kLastStep = 256u;

const float kBrightnessScale = 3.0; // in standard deviations
const float kSharpRoughness = 0.06; // mirrors below it are not blurred

// The 64th power, by squares.
float power64(float x) {
    for (int i = 0; i < 6; ++i) {
        x *= x;
    }
    return x;
}

float blurredVariance(uint plane, ivec2 pixel) {
    const float kernel[2] = float[](0.5, 0.25);
    float sum = 0.0;
    float total = 0.0;
    ivec2 last = ivec2(frame.camera.width, frame.camera.height) - 1;
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            float weight = kernel[abs(x)] * kernel[abs(y)];
            sum += weight * frame.planes.at[planePlace(plane, pixelPlace(clamp(pixel + ivec2(x, y), ivec2(0), last)))].a;
            total += weight;
        }
    }
    return sum / total;
}

struct Blur {
    vec4 sum; // light, and variance by the squares of weights
    float total;
    float scale; // of differences in brightness
    float bright;
};

Blur startBlur(uint plane, ivec2 pixel, vec4 own) {
    return Blur(own, 1.0, kBrightnessScale * sqrt(max(blurredVariance(plane, pixel), 0.0)) + 1e-5, brightness(own.rgb));
}

void addTap(inout Blur blur, vec4 tap, float weight) {
    weight *= exp(-abs(brightness(tap.rgb) - blur.bright) / blur.scale);
    blur.sum += vec4(tap.rgb * weight, tap.a * weight * weight);
    blur.total += weight;
}

vec4 blurred(Blur blur) {
    return vec4(blur.sum.rgb / blur.total, blur.sum.a / (blur.total * blur.total));
}

// The picture of a frame.
void composePixel(uint place, vec3 matte, vec3 mirrored) {
    vec3 base = frame.planes.at[planePlace(kPlaneBase, place)].rgb;
    vec3 color = base + matte * frame.planes.at[planePlace(kPlaneMatteAlbedo, place)].rgb +
                 mirrored * frame.planes.at[planePlace(kPlaneMirroredShare, place)].rgb;
    frame.planes.at[planePlace(kPlaneFrame, place)] = vec4(color, 1.0);
}

void filterPixel(uvec2 at) {
    ivec2 pixel = ivec2(at);
    uint place = pixelPlace(pixel);
    uint step = argument & 0xffu;
    uint to = step & 1u;
    uint from = 1u - to;
    Seen seen = unpackedSeen(frame.planes.at[currentPlane(kPlaneSurface, place)]);
    vec4 ownMatte = frame.planes.at[planePlace(kPlaneMatte + from, place)];
    vec4 ownMirrored = frame.planes.at[planePlace(kPlaneMirrored + from, place)];
    Blur matte = startBlur(kPlaneMatte + from, pixel, ownMatte);
    Blur mirrored = startBlur(kPlaneMirrored + from, pixel, ownMirrored);
    vec3 point = seenPoint(frame.camera, pixel, seen.distance);
    float otherTolerance = max(2.0 * frame.camera.pixelSpread * seen.distance, 1e-6);
    float ownTolerance = otherTolerance * float(1u << step);
    float sharpness = 1.0 / max(seen.roughness * seen.roughness, 1e-3);
    const float kernel[2] = float[](1.0, 0.5);
    for (int y = -1; y <= 1 && !isSky(seen); ++y) {
        for (int x = -1; x <= 1; ++x) {
            ivec2 tap = pixel + ivec2(x, y) * int(1u << step);
            bool isInside = all(greaterThanEqual(tap, ivec2(0))) && all(lessThan(tap, ivec2(frame.camera.width, frame.camera.height)));
            if ((x == 0 && y == 0) || !isInside) {
                continue;
            }
            uint tapPlace = pixelPlace(tap);
            Seen other = unpackedSeen(frame.planes.at[currentPlane(kPlaneSurface, tapPlace)]);
            if (isSky(other)) {
                continue;
            }
            vec3 way = seenPoint(frame.camera, tap, other.distance) - point;
            // What lies behind another instance has other light, as behind a veil.
            float tolerance = other.instance == seen.instance ? ownTolerance : otherTolerance;
            float weight = kernel[abs(x)] * kernel[abs(y)] * exp(-abs(dot(way, seen.normal)) / tolerance);
            // Light of a surface counts less, the more the normals differ.
            float cosine = max(dot(seen.normal, other.normal), 0.0);
            addTap(matte, frame.planes.at[planePlace(kPlaneMatte + from, tapPlace)], weight * power64(cosine));
            bool isAlike = abs(other.roughness - seen.roughness) < 0.1 && seen.roughness > kSharpRoughness;
            if (isAlike) {
                float power = clamp(16.0 * sharpness, 64.0, 4096.0);
                addTap(mirrored, frame.planes.at[planePlace(kPlaneMirrored + from, tapPlace)], weight * pow(cosine, power));
            }
        }
    }
    vec4 blurredMatte = blurred(matte);
    vec4 blurredMirrored = blurred(mirrored);
    bool isLast = (argument & kLastStep) != 0u;
    if (isLast) {
        composePixel(place, blurredMatte.rgb, blurredMirrored.rgb);
    }
    // After the last step only views of this light read it.
    if (!isLast || frame.view == kViewMatte || frame.view == kViewMirrored) {
        frame.planes.at[planePlace(kPlaneMatte + to, place)] = blurredMatte;
        frame.planes.at[planePlace(kPlaneMirrored + to, place)] = blurredMirrored;
    }
}

#define PIXEL_FUNCTION filterPixel
#include "common/for_each_pixel.glsl"
