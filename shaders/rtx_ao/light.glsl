// Visibility of the sun from a surface, and ambient visibility, by some rays.
// The including file provides isBlocked().
#ifndef RTX_AO_LIGHT
#define RTX_AO_LIGHT

const float kTurn = 6.2831853;

// Two numbers that look random, of a pixel (after Jarzynski and Olano's pcg2d).
uvec2 hashed(uvec2 v) {
    v = v * 1664525u + 1013904223u;
    v += v.yx * 1664525u;
    v ^= v >> 16;
    v += v.yx * 1664525u;
    return v ^ v >> 16;
}

// Place `number` of a sequence that fills the unit square evenly, shifted for each pixel.
vec2 evenly(uvec2 pixel, uint number, uint salt) {
    uvec2 place = hashed(pixel + salt * 7919u) + number * uvec2(3242174889u, 2447445414u);
    return vec2(place >> 8) / 16777216.0;
}

mat3 basisAround(vec3 normal) {
    vec3 side = abs(normal.x) < 0.6 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
    vec3 across = normalize(cross(side, normal));
    return mat3(across, cross(normal, across), normal);
}

vec2 discPlace(vec2 noise) {
    return sqrt(noise.x) * vec2(cos(kTurn * noise.y), sin(kTurn * noise.y));
}

vec3 sunDirection(uvec2 pixel) {
    return normalize(basisAround(frame.toSun) * vec3(frame.sunSpread * discPlace(evenly(pixel, frame.pass, 1u)), 1.0));
}

// Denser towards the normal, as the cosine.
vec3 openDirection(vec3 normal, uvec2 pixel, uint ray) {
    vec2 disc = discPlace(evenly(pixel, frame.pass * frame.rays + ray, 2u));
    return basisAround(normal) * vec3(disc, sqrt(max(1.0 - dot(disc, disc), 0.0)));
}

// Sun times cosine, the share of rays that meet nothing within the radius, how far the surface looks up, and that there
// is one. One loop for all rays: where queries are walked in software, each place that traces has a walk of its own.
vec4 lightAt(vec3 position, vec3 normal, vec3 geometric, uvec2 pixel) {
    vec3 start = position + frame.lift * geometric;
    vec3 toSun = sunDirection(pixel);
    bool facesSun = dot(normal, toSun) > 0.0 && dot(geometric, toSun) > 0.0;
    float sun = 0.0;
    float open = 0.0;
    for (uint ray = facesSun ? 0u : 1u; ray <= frame.rays; ++ray) {
        vec3 direction = ray == 0u ? toSun : openDirection(normal, pixel, ray - 1u);
        bool isOpen = !isBlocked(start, direction, ray == 0u ? 1e30 : frame.radius);
        sun = ray == 0u && isOpen ? dot(normal, toSun) : sun;
        open += ray > 0u && isOpen ? 1.0 : 0.0;
    }
    return vec4(sun, open / float(frame.rays), 0.5 + 0.5 * normal.y, 1.0);
}

#endif
