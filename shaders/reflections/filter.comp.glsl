// Blurs reflections as far as their roughness and the distance of what they show ask for, and not across edges of
// depth, normal or roughness. Two passes with different turns of the same spiral.
#include "reflections/neighbour.glsl"
#include "reflections/noise.glsl"
#include "reflections/ray_range.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const int kTaps = 16;
const float kMostPixels = 20.0; // at 720 rows

// 1 for neighbours on the same smooth surface, down to 0 across edges, those of roughness too.
float likeness(Centre a, Centre b) {
    float rough = abs(a.roughness - b.roughness) / (0.25 * a.roughness + 0.01);
    // The wider the lobe, the more a surface may be curved.
    float sharpness = mix(64.0, 16.0, smoothstep(0.1, 0.3, a.roughness));
    return onOneSurface(a, b, sharpness) * exp(-rough * rough);
}

// Mean hit distance of the nearest neighbours: a single ray says little about a lobe.
float meanHitDistance(ivec2 pixel, uint source, ivec2 last) {
    float sum = 0.0;
    for (int i = 0; i < 9; ++i) {
        ivec2 at = clamp(pixel + ivec2(i % 3 - 1, i / 3 - 1), ivec2(0), last);
        sum += textureBindlessFetch2D(source, at, 0).a;
    }
    return sum / 9.0;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 last = ivec2(frame.camera.width, frame.camera.height) - 1;
    if (any(greaterThan(pixel, last))) {
        return;
    }
    uint source = passArguments[0];
    vec4 middle = textureBindlessFetch2D(source, pixel, 0);
    Centre centre;
    vec4 sum = middle;
    if (readCentre(pixel, centre)) {
        float hit = meanHitDistance(pixel, source, last);
        float angle = lobeTangent(centre.roughness) * hit / (centre.distance + hit + 1e-4);
        float most = kMostPixels * float(frame.camera.height) / 720.0;
        float radius = min(angle / frame.camera.pixelSpread, most) * (passArguments[2] == 0u ? 1.0 : 0.5);
        float total = 1.0;
        float turn = spiralTurn(pixel, 8u + passArguments[2]);
        for (int i = 0; radius > 0.75 && i < kTaps; ++i) {
            float spoke = spiralSpoke(i, kTaps);
            ivec2 at = pixel + spiralStep(i, turn, radius * spoke);
            Centre other;
            if (any(lessThan(at, ivec2(0))) || any(greaterThan(at, last)) || !readCentre(at, other)) {
                continue;
            }
            vec4 tap = textureBindlessFetch2D(source, at, 0);
            // A sharp thing close by does not take the blur of one far away.
            float depths = abs(tap.a - hit) / (hit + 0.1);
            float weight = likeness(centre, other) * exp(-1.5 * spoke * spoke - 0.2 * depths * depths);
            // Few bright rays would otherwise leave specks.
            weight /= 1.0 + 0.25 * max(tap.r, max(tap.g, tap.b));
            sum += weight * tap;
            total += weight;
        }
        sum /= total;
    }
    imageStore(kImages2D[passArguments[1]], pixel, sum);
}
