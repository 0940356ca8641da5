// The pixels that a triangle may cover.
#ifndef HYBRID_FOOTPRINT
#define HYBRID_FOOTPRINT

#include "hybrid/frame.glsl"

// A triangle's corners, as seen from the eye.
struct Corners {
    vec3 a;
    vec3 b;
    vec3 c;
};

// Pixels from `first` to `last`, both included; none where `last` is smaller.
struct Footprint {
    ivec2 first;
    ivec2 last;
};

const Footprint kNoPixels = Footprint(ivec2(0), ivec2(-1));

// Rounding moves a projected corner by less than this share of a pixel, and one at the near plane by less than this
// share of half the picture.
const float kPixelMargin = 1.0 / 32.0;
const float kNearMargin = 0.01;

Corners cornersFromEye(uint triangle) {
    uvec3 corner = frame.scene.triangles.at[triangle];
    vec3 eye = frame.camera.eye;
    return Corners(frame.scene.positions.at[corner.x] - eye, frame.scene.positions.at[corner.y] - eye,
                   frame.scene.positions.at[corner.z] - eye);
}

// x and y over z is the place in the picture, from -1 to 1; z is the depth.
vec3 homogeneous(vec3 fromEye) {
    float depth = dot(fromEye, frame.camera.forward);
    vec2 place = vec2(dot(fromEye, frame.camera.clipRight), dot(fromEye, frame.camera.clipDown));
    return vec3(place - depth * frame.camera.shift, depth);
}

bool isOutside(vec3 x, vec3 z) {
    return all(greaterThan(x, z)) || all(lessThan(x, -z));
}

// Grows `box` (smallest x, y, largest x, y) by what is before the near plane of the edge from p to q, without q.
void includeEdge(inout vec4 box, vec3 p, vec3 q) {
    float near = frame.camera.nearPlane;
    if (p.z >= near) {
        vec2 place = p.xy / p.z;
        box = vec4(min(box.xy, place), max(box.zw, place));
    }
    if ((p.z >= near) != (q.z >= near)) {
        vec2 place = mix(p.xy, q.xy, (near - p.z) / (q.z - p.z)) / near;
        box = vec4(min(box.xy, place), max(box.zw, place));
    }
}

// The smallest rectangle with all pixels whose centres the triangle covers, `margin` pixels added on each side.
Footprint footprintOf(Corners corners, float margin) {
    vec3 a = homogeneous(corners.a);
    vec3 b = homogeneous(corners.b);
    vec3 c = homogeneous(corners.c);
    vec3 z = vec3(a.z, b.z, c.z);
    float near = frame.camera.nearPlane;
    if (all(lessThan(z, vec3(near))) || isOutside(vec3(a.x, b.x, c.x), z) || isOutside(vec3(a.y, b.y, c.y), z)) {
        return kNoPixels;
    }
    vec4 box = vec4(2.0, 2.0, -2.0, -2.0);
    includeEdge(box, a, b);
    includeEdge(box, b, c);
    includeEdge(box, c, a);
    box += vec4(-1, -1, 1, 1) * (any(lessThan(z, vec3(near))) ? kNearMargin : 0.0);
    box = clamp(box, -2.0, 2.0) * 0.5 + 0.5;
    vec2 size = vec2(frame.camera.width, frame.camera.height);
    ivec2 first = ivec2(ceil(box.xy * size - (0.5 + margin)));
    ivec2 last = ivec2(floor(box.zw * size - (0.5 - margin)));
    return Footprint(max(first, ivec2(0)), min(last, ivec2(size) - 1));
}

bool isEmpty(Footprint footprint) {
    return any(lessThan(footprint.last, footprint.first));
}

#endif
