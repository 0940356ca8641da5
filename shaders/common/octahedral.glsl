// Unit vectors in 32 bits, by the octahedral map.
#ifndef COMMON_OCTAHEDRAL
#define COMMON_OCTAHEDRAL

vec2 octahedralSigns(vec2 v) {
    return vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0);
}

uint packUnitVector(vec3 v) {
    vec2 p = v.xy / (abs(v.x) + abs(v.y) + abs(v.z));
    if (v.z < 0.0) {
        p = (1.0 - abs(p.yx)) * octahedralSigns(p);
    }
    return packSnorm2x16(p);
}

vec3 unpackUnitVector(uint bits) {
    vec2 p = unpackSnorm2x16(bits);
    vec3 v = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (v.z < 0.0) {
        v.xy = (1.0 - abs(v.yx)) * octahedralSigns(v.xy);
    }
    return normalize(v);
}

#endif
