// Whether the ray through a pixel's centre meets a triangle, and how far away: by planes through the eye and the
// triangle's edges for what is clearly outside, by the arithmetic of a tracer for the rest. So a pixel shows what its
// ray would have met. There is no grid that corners snap to, and no side is culled.
#ifndef HYBRID_COVERAGE
#define HYBRID_COVERAGE

#include "common/ray_triangle.glsl"
#include "hybrid/footprint.glsl"

// The volume between a ray and an edge is linear in the place in the picture: x + y * right + z * down. Each is named
// after the corner across, and positive inside where the triangle's side is known.
struct Edges {
    vec3 a;
    vec3 b;
    vec3 c;
    float slack; // how far the volumes may be off
    float doubt; // how far those of a tracer may be off
    bool isSided; // whether the side is known: not for triangles seen edge-on
};

// Errors as shares of what a volume is made of; single precision has 24 bits.
const float kVolumeSlack = 1.0 / 524288.0;
const float kDoubt = 1.0 / 2097152.0;
const float kSideSlack = 1.0 / 65536.0;

float largest(vec3 v) {
    return max(abs(v.x), max(abs(v.y), abs(v.z)));
}

// x, y and z of the volume of the edge from p to q.
vec3 edgeVolume(vec3 p, vec3 q) {
    vec3 normal = cross(p + q, q - p);
    return vec3(dot(normal, frame.camera.forward), dot(normal, frame.camera.right), dot(normal, frame.camera.down));
}

Edges edgesOf(Corners corners) {
    vec3 along = corners.b - corners.a;
    vec3 across = corners.c - corners.a;
    float volume = dot(corners.a, cross(along, across));
    float side = volume < 0.0 ? -1.0 : 1.0;
    float away = max(largest(corners.a), max(largest(corners.b), largest(corners.c)));
    float size = max(largest(along), largest(across));
    float view = 1.0 + largest(frame.camera.right) + largest(frame.camera.down);
    return Edges(side * edgeVolume(corners.b, corners.c), side * edgeVolume(corners.c, corners.a),
                 side * edgeVolume(corners.a, corners.b), 12.0 * kVolumeSlack * away * size * view,
                 kDoubt * away * size,                 abs(volume) > kSideSlack * away * size * size);
}

vec2 placeOf(vec2 pixel) {
    return (pixel + 0.5) / vec2(frame.camera.width, frame.camera.height) * 2.0 - 1.0;
}

vec3 volumesAt(Edges edges, vec2 place) {
    vec3 p = vec3(1.0, place);
    return vec3(dot(edges.a, p), dot(edges.b, p), dot(edges.c, p)) + edges.slack;
}

// Whether no pixel from `first` to `last` is covered; may be false where that is so.
bool isRectangleOutside(Edges edges, ivec2 first, ivec2 last) {
    vec2 extent = vec2(last - first) / vec2(frame.camera.width, frame.camera.height);
    vec3 reach = vec3(dot(abs(edges.a.yz), extent), dot(abs(edges.b.yz), extent), dot(abs(edges.c.yz), extent));
    vec3 most = volumesAt(edges, placeOf(0.5 * vec2(first + last))) + reach;
    return edges.isSided && any(lessThan(most, vec3(0.0)));
}

// Whether the ray of `pixel` may meet the triangle.
bool isNearby(Edges edges, ivec2 pixel) {
    vec3 volumes = volumesAt(edges, placeOf(vec2(pixel)));
    bool isInside = all(greaterThanEqual(volumes, vec3(0.0)));
    bool isInsideBackwards = all(lessThanEqual(volumes, vec3(2.0 * edges.slack)));
    return isInside || (!edges.isSided && isInsideBackwards);
}

// Where a pixel's ray meets a triangle.
struct Crossing {
    float distance; // negative where it misses it, or meets it before the near plane
    bool isDoubtful; // whether it is so close to an edge that another tracer may decide otherwise
};

Crossing crossingAt(Edges edges, Corners corners, ivec2 pixel) {
    vec3 direction = cameraDirection(frame.camera, uvec2(pixel));
    RayPassage passage = passageOf(direction, corners.a, corners.b, corners.c);
    vec3 volumes = passage.volumes;
    vec3 size = abs(volumes);
    bool isDoubtful = min(size.x, min(size.y, size.z)) <= edges.doubt;
    bool isMissed = any(lessThan(volumes, vec3(0.0))) && any(greaterThan(volumes, vec3(0.0)));
    float distance = distanceAlong(passage);
    // Written so that a triangle without area, whose distance is no number, is missed.
    bool isBehindNearPlane = distance >= cameraNearDistance(frame.camera, direction);
    return Crossing(isBehindNearPlane && (isDoubtful || !isMissed) ? distance : -1.0, isDoubtful);
}

#endif
