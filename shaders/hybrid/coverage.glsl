// True if the ray through a pixel's centre meets a triangle, and how far away: by planes through the eye and the
// triangle's edges for what is clearly outside, by the arithmetic of a tracer for the rest. So a pixel shows what its
// ray would have met. There is no grid that corners snap to, and no side is culled.
#ifndef HYBRID_COVERAGE
#define HYBRID_COVERAGE

#include "common/ray_triangle.glsl"
#include "hybrid/footprint.glsl"

// The volumes between a pixel's ray and the edges, named after the corner across: linear in the pixel, and positive
// inside where the triangle's side is known.
struct Edges {
    vec3 volumes; // of the pixel (0, 0), with the slack added
    vec3 along; // growth for each pixel along x
    vec3 down; // and along y
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

// The volumes that the camera's axes span with the edge from p to q.
vec3 edgeVolume(vec3 p, vec3 q) {
    vec3 normal = cross(p + q, q - p);
    return vec3(dot(normal, frame.camera.forward), dot(normal, frame.camera.right), dot(normal, frame.camera.down));
}

// Error bound of a tracer's volumes, for a triangle whose vertices are `away` and whose edges are `size` long.
float doubtOf(float away, float size) {
    return kDoubt * away * size;
}

Edges edgesOf(Corners corners) {
    vec3 first = corners.b - corners.a;
    vec3 second = corners.c - corners.a;
    float volume = dot(corners.a, cross(first, second));
    float away = max(largest(corners.a), max(largest(corners.b), largest(corners.c)));
    float size = max(largest(first), largest(second));
    float view = 1.0 + largest(frame.camera.right) + largest(frame.camera.down);
    float slack = 12.0 * kVolumeSlack * away * size * view;
    // Rows: volumes along `forward`, `right` and `down`.
    mat3 planes = transpose(mat3(edgeVolume(corners.b, corners.c), edgeVolume(corners.c, corners.a),
                                 edgeVolume(corners.a, corners.b))) * (volume < 0.0 ? -1.0 : 1.0);
    vec2 pixel = 2.0 / vec2(frame.camera.width, frame.camera.height);
    vec2 origin = 0.5 * pixel - 1.0 + frame.camera.shift;
    vec3 volumes = planes[0] + planes[1] * origin.x + planes[2] * origin.y + slack;
    return Edges(volumes, planes[1] * pixel.x, planes[2] * pixel.y, slack, doubtOf(away, size),
                 abs(volume) > kSideSlack * away * size * size);
}

vec3 volumesAt(Edges edges, vec2 pixel) {
    return edges.volumes + edges.along * pixel.x + edges.down * pixel.y;
}

// True if no pixel from `first` to `last` is covered; may be false where that is so.
bool isRectangleOutside(Edges edges, ivec2 first, ivec2 last) {
    vec2 reach = 0.5 * vec2(last - first);
    vec3 most = volumesAt(edges, 0.5 * vec2(first + last)) + abs(edges.along) * reach.x + abs(edges.down) * reach.y;
    return edges.isSided && any(lessThan(most, vec3(0.0)));
}

// True if the ray of `pixel` may meet the triangle.
bool isNearby(Edges edges, ivec2 pixel) {
    vec3 volumes = volumesAt(edges, vec2(pixel));
    bool isInside = all(greaterThanEqual(volumes, vec3(0.0)));
    bool isInsideBackwards = all(lessThanEqual(volumes, vec3(2.0 * edges.slack)));
    return isInside || (!edges.isSided && isInsideBackwards);
}

// Intersection of a pixel's ray, which has this direction, with a triangle.
struct Crossing {
    float distance; // negative where it misses it, or meets it before the near plane
    bool isDoubtful; // whether it is so close to an edge that another tracer may decide otherwise
};

Crossing crossingAlong(vec3 direction, Corners corners, float doubt) {
    RayPassage passage = passageOf(direction, corners.a, corners.b, corners.c);
    vec3 volumes = passage.volumes;
    vec3 size = abs(volumes);
    bool isDoubtful = min(size.x, min(size.y, size.z)) <= doubt;
    bool isMissed = any(lessThan(volumes, vec3(0.0))) && any(greaterThan(volumes, vec3(0.0)));
    float distance = distanceAlong(passage);
    // Written so that a triangle without area, whose distance is no number, is missed.
    bool isBehindNearPlane = distance >= cameraNearDistance(frame.camera, direction);
    return Crossing(isBehindNearPlane && (isDoubtful || !isMissed) ? distance : -1.0, isDoubtful);
}

Crossing crossingAt(Edges edges, Corners corners, ivec2 pixel) {
    return crossingAlong(cameraDirection(frame.camera, uvec2(pixel)), corners, edges.doubt);
}

#endif
