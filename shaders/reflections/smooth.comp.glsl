// Smooths what single rays said about lights and openness: shadows as wide as their penumbra, which follows from how
// far away the blocker is, so that they stay sharp where things touch. Two passes with different turns of the spiral.
#include "reflections/neighbour.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const int kTaps = 16;
const float kMostPixels = 12.0; // of a penumbra, at 720 rows
const float kOpenPixels = 11.0; // around which openness is averaged, at 720 rows
const float kSharpness = 6.0; // of edges: flutes of columns are not among them

// Half the width of each light's penumbra around the pixel, in pixels; 0 where no blocker's penumbra gets here.
vec3 penumbraAround(ivec2 pixel, float turn, float most) {
    vec3 sum = vec3(0.0);
    vec3 count = vec3(0.0);
    for (int i = 0; i < kTaps + 9; ++i) {
        bool isNext = i < 9;
        float reach = isNext ? 1.0 : most * spiralSpoke(i - 9, kTaps);
        ivec2 at = pixel + (isNext ? ivec2(i % 3 - 1, i / 3 - 1) : spiralStep(i, turn, reach));
        if (isInPicture(at)) {
            vec3 width = textureBindlessFetch2D(frame.penumbra, at, 0).rgb;
            vec3 reaches = vec3(greaterThan(width, vec3(0.0))) * vec3(greaterThanEqual(width + 1.5, vec3(reach)));
            sum += reaches * width;
            count += reaches;
        }
    }
    return min(sum / max(count, vec3(1.0)), vec3(most));
}

// One channel, averaged over the neighbours on the same surface within `radius` pixels.
float averaged(uint source, ivec2 pixel, Centre centre, int channel, float radius, float turn) {
    float sum = textureBindlessFetch2D(source, pixel, 0)[channel];
    float total = 1.0;
    for (int i = 0; i < kTaps; ++i) {
        float spoke = spiralSpoke(i, kTaps);
        ivec2 at = pixel + spiralStep(i, turn, radius * spoke);
        Centre other;
        if (isInPicture(at) && readCentre(at, other)) {
            float weight = onOneSurface(centre, other, kSharpness) * exp(-1.5 * spoke * spoke);
            sum += weight * textureBindlessFetch2D(source, at, 0)[channel];
            total += weight;
        }
    }
    return sum / total;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (!isInPicture(pixel)) {
        return;
    }
    uint source = passArguments[0];
    vec4 result = textureBindlessFetch2D(source, pixel, 0);
    Centre centre;
    if (readCentre(pixel, centre)) {
        float turn = spiralTurn(pixel, 10u + passArguments[2]);
        float scale = float(frame.camera.height) / 720.0;
        vec4 radius = vec4(penumbraAround(pixel, turn, kMostPixels * scale), kOpenPixels * scale);
        radius *= passArguments[2] == 0u ? 1.0 : 0.5;
        for (int channel = 0; channel < 4; ++channel) {
            if (radius[channel] > 0.7) {
                result[channel] = averaged(source, pixel, centre, channel, radius[channel], turn);
            }
        }
    }
    imageStore(kImages2D[passArguments[1]], pixel, result);
}
