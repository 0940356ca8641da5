// Ripples of water: the slope of a sum of sines.
#ifndef REFLECTIONS_WAVES
#define REFLECTIONS_WAVES

vec3 waterNormal(vec2 place, float time) {
    const vec4 waves[5] = vec4[](vec4(0.80, 0.60, 5.1, 1.3), vec4(-0.55, 0.83, 8.3, 1.9), vec4(0.10, -1.0, 13.7, 2.6),
                                 vec4(0.96, -0.28, 22.0, 3.1), vec4(-0.87, -0.50, 31.0, 4.2));
    vec2 slope = vec2(0.0);
    for (int i = 0; i < 5; ++i) {
        float phase = dot(waves[i].xy, place) * waves[i].z + time * waves[i].w + float(i);
        slope += waves[i].xy * cos(phase) * (0.022 / (1.0 + 0.35 * float(i)));
    }
    return normalize(vec3(-slope.x, 1.0, -slope.y));
}

#endif
