// The light along a ray. The including file provides traceNearest() and reachesSky().
#ifndef RTX_TEXTURES_SHADE
#define RTX_TEXTURES_SHADE

#include "common/tonemap.glsl"
#include "rtx_textures/surface.glsl"

const vec3 kToSun = vec3(-0.48, 0.72, 0.5); // unit length
const vec3 kSunlight = vec3(2.6, 2.2, 1.7);
const uint kMostMirrors = 2u;
const uint kViews = 4u; // of a pixel

vec3 skyRadiance(vec3 direction) {
    float height = max(direction.y, 0.0);
    vec3 sky = mix(vec3(0.75, 0.82, 0.9), vec3(0.12, 0.3, 0.68), sqrt(height));
    return sky + kSunlight * pow(max(dot(direction, kToSun), 0.0), 400.0);
}

vec3 leaving(Found found, vec3 start) {
    vec3 ambient = mix(vec3(0.2, 0.18, 0.15), vec3(0.4, 0.47, 0.6), 0.5 + 0.5 * found.normal.y);
    float cosine = dot(found.normal, kToSun);
    bool isLit = cosine > 0.0 && reachesSky(start, kToSun);
    return found.albedo * (ambient + (isLit ? cosine * kSunlight : vec3(0.0)));
}

vec3 radianceAlong(vec3 origin, vec3 direction) {
    vec3 color = vec3(0.0);
    float weight = 1.0;
    float travelled = 0.0;
    for (uint mirrors = 0u; weight > 0.0; ++mirrors) {
        Found found = mirrors <= kMostMirrors ? traceNearest(origin, direction, travelled)
                                              : Found(vec3(0.0), -1.0, vec3(0.0), 0.0);
        if (found.distance < 0.0) {
            color += weight * skyRadiance(direction);
            break;
        }
        travelled += found.distance;
        found.normal = dot(found.normal, direction) > 0.0 ? -found.normal : found.normal;
        vec3 start = origin + found.distance * direction + 1e-3 * found.normal;
        float grazing = 1.0 + dot(found.normal, direction);
        float mirrored = found.gloss * (0.06 + 0.94 * pow(grazing, 5.0));
        color += weight * (1.0 - mirrored) * leaving(found, start);
        weight *= mirrored;
        origin = start;
        direction = reflect(direction, found.normal);
    }
    return color;
}

vec3 directionThrough(vec2 point) {
    vec2 ndc = point / vec2(frame.camera.width, frame.camera.height) * 2.0 - 1.0;
    return normalize(frame.camera.forward + ndc.x * frame.camera.right + ndc.y * frame.camera.down);
}

void renderPixel(uvec2 pixel) {
    vec3 sum = vec3(0.0);
    for (uint view = 0u; view < kViews; ++view) {
        vec2 within = fract(0.5 + float(view) * vec2(0.7548777, 0.5698403));
        sum += expose(radianceAlong(frame.camera.eye, directionThrough(vec2(pixel) + within)));
    }
    imageStore(kImages2D[frame.image], ivec2(pixel), vec4(encodeSrgb(sum / float(kViews)), 1.0));
}

#endif
