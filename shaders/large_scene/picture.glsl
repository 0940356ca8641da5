// A pixel of the picture, by whatever traces. The including file provides traceNearest() and occludedBy().
#ifndef LARGE_SCENE_PICTURE
#define LARGE_SCENE_PICTURE

#include "common/tonemap.glsl"
#include "rtx_pipeline/radiance.glsl"

bool traceOccluded(vec3 origin, float tmin, vec3 direction, float tmax) {
    return occludedBy(kMaskSolid, origin, tmin, direction, tmax);
}

#include "rtx_pipeline/shade.glsl"

// The surface in the world's coordinates. Its arrays are in those of the instance, where the ray is taken to.
SurfacePoint pointOf(Hit hit, vec3 origin, vec3 direction, float cone) {
    vec4 x = frame.places.at[hit.instance].rows[0];
    vec4 y = frame.places.at[hit.instance].rows[1];
    vec4 z = frame.places.at[hit.instance].rows[2];
    float scale = length(x.xyz);
    mat3 turn = transpose(mat3(x.xyz, y.xyz, z.xyz)) / scale;
    vec3 foot = vec3(x.w, y.w, z.w);
    SurfacePoint point =
        pointOf(hit.triangle, hit.barycentrics, (origin - foot) * turn / scale, direction * turn, cone / scale);
    point.position = turn * (point.position * scale) + foot;
    point.distance *= scale;
    point.normal = turn * point.normal;
    point.geometricNormal = turn * point.geometricNormal;
    return point;
}

vec3 lightAlong(vec3 direction) {
    vec3 light = vec3(0.0);
    vec3 weight = vec3(1.0);
    Onward ray = Onward(vec3(1.0), frame.camera.eye, direction, 0.0);
    for (uint depth = 0u;; ++depth) {
        Hit hit = traceNearest(kMaskAll, ray.origin, ray.direction, kFar);
        if (hit.triangle == kNothing) {
            return light + weight * skyColor(ray.direction);
        }
        SurfacePoint point = pointOf(hit, ray.origin, ray.direction, ray.cone);
        Shaded shaded;
        if (materialOf(hit.triangle).transmission > 0.0) {
            shaded = shadeGlass(point, ray.direction, ray.cone);
        } else {
            shaded = shadeSolid(point, ray.direction, ray.cone);
        }
        light += weight * shaded.light;
        if (!isFollowed(shaded.onward, depth)) {
            return light;
        }
        ray = shaded.onward;
        weight *= ray.weight;
    }
}

// A colour that tells numbers apart.
vec3 colorOf(uint number) {
    uint mixed = number * 0x9e3779b1u;
    mixed = (mixed ^ (mixed >> 15)) * 0x85ebca77u;
    mixed ^= mixed >> 13;
    vec3 hue = vec3(0.0, 2.1, 4.2) + float(mixed & 0xffffu) * (6.2831853 / 65536.0);
    return (0.6 + 0.4 * cos(hue)) * (0.55 + 0.45 * float(mixed >> 24) / 255.0);
}

// Instances or triangles in colours of their own, lit by the eye.
vec3 numbersAlong(vec3 direction) {
    Hit hit = traceNearest(kMaskAll, frame.camera.eye, direction, kFar);
    if (hit.triangle == kNothing) {
        return skyColor(direction);
    }
    SurfacePoint point = pointOf(hit, frame.camera.eye, direction, 0.0);
    uint number = frame.show == kShowInstances ? hit.instance : hit.triangle;
    return 1.6 * colorOf(number) * (0.35 + 0.65 * abs(dot(point.normal, direction)));
}

// Places within a pixel by the steps of the R2 sequence; the first is its middle.
vec3 directionOf(uvec2 pixel, uint number) {
    Camera camera = frame.camera;
    vec2 shift = fract(0.5 + float(number) * vec2(0.7548777, 0.5698403)) - 0.5;
    camera.shift = 2.0 * shift / vec2(camera.width, camera.height);
    return cameraDirection(camera, pixel);
}

void storePixel(uvec2 pixel) {
    vec3 sum = vec3(0.0);
    for (uint number = 0u; number < frame.samples; ++number) {
        vec3 direction = directionOf(pixel, number);
        sum += expose(frame.show == kShowPicture ? lightAlong(direction) : numbersAlong(direction));
    }
    imageStore(kImages2D[frame.image], ivec2(pixel), vec4(encodeSrgb(sum / float(frame.samples)), 1.0));
}

#endif
