// Ripples of water: the slope of a sum of sines.
#ifndef REFLECTIONS_WAVES
#define REFLECTIONS_WAVES

// `phase`: of the animation's round, in which every wave passes a whole number of times.
vec3 waterNormal(vec2 place, float phase) {
    // Direction, radians for each unit of length, and how often it passes in a round.
    const vec4 waves[5] = vec4[](vec4(0.80, 0.60, 5.1, 2.0), vec4(-0.55, 0.83, 8.3, 2.0), vec4(0.10, -1.0, 13.7, 3.0),
                                 vec4(0.96, -0.28, 22.0, 4.0), vec4(-0.87, -0.50, 31.0, 5.0));
    vec2 slope = vec2(0.0);
    for (int i = 0; i < 5; ++i) {
        float angle = dot(waves[i].xy, place) * waves[i].z + 6.2831853 * phase * waves[i].w + float(i);
        slope += waves[i].xy * cos(angle) * (0.022 / (1.0 + 0.35 * float(i)));
    }
    return normalize(vec3(-slope.x, 1.0, -slope.y));
}

#endif
