// From radiance to what a display shows.
#ifndef VIEWER_TONE
#define VIEWER_TONE

#include "common/tonemap.glsl"

const uint kToneNeutral = 0u;
const uint kToneLinear = 1u;

// Khronos PBR Neutral: base colours below 0.8 stay as they are, highlights are compressed and lose their colour.
vec3 toneNeutral(vec3 color) {
    const float kStart = 0.8 - 0.04;
    const float kDesaturation = 0.15;
    float low = min(color.r, min(color.g, color.b));
    float offset = low < 0.08 ? low - 6.25 * low * low : 0.04;
    color -= offset;
    float peak = max(color.r, max(color.g, color.b));
    if (peak < kStart) {
        return color;
    }
    float room = 1.0 - kStart;
    float compressed = 1.0 - room * room / (peak + room - kStart);
    color *= compressed / peak;
    float share = 1.0 - 1.0 / (kDesaturation * (peak - compressed) + 1.0);
    return mix(color, vec3(compressed), share);
}

vec3 displayed(vec3 radiance, float exposure, uint mapping) {
    vec3 color = max(exposure * radiance, 0.0);
    return encodeSrgb(clamp(mapping == kToneNeutral ? toneNeutral(color) : color, 0.0, 1.0));
}

#endif
