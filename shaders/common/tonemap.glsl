// From linear light to what a PNG holds.
#ifndef COMMON_TONEMAP
#define COMMON_TONEMAP

// Exposure of a film: linear for dark colours, and bright ones never clip.
vec3 expose(vec3 radiance) {
    return 1.0 - exp(-max(radiance, 0.0));
}

// IEC 61966-2-1 encoding of values from 0 to 1.
vec3 encodeSrgb(vec3 linear) {
    vec3 low = linear * 12.92;
    vec3 high = 1.055 * pow(max(linear, 0.0), vec3(1.0 / 2.4)) - 0.055;
    return mix(high, low, lessThanEqual(linear, vec3(0.0031308)));
}

// The reverse.
vec3 decodeSrgb(vec3 encoded) {
    vec3 low = encoded / 12.92;
    vec3 high = pow((encoded + 0.055) / 1.055, vec3(2.4));
    return mix(high, low, lessThanEqual(encoded, vec3(0.04045)));
}

#endif
