// Whether the ray through a pixel's centre meets a triangle, and how deep: the test that a tracer makes, for all
// pixels of a triangle. There is no grid that corners snap to, and no side is culled.
#ifndef HYBRID_COVERAGE
#define HYBRID_COVERAGE

#include "common/ray_triangle.glsl"
#include "hybrid/footprint.glsl"

// The volume between a ray and an edge is linear in the place in the picture: x + y * right + z * down. Each is named
// after the corner across.
struct Edges {
    vec3 a;
    vec3 b;
    vec3 c;
    vec3 depth; // of the corners
};

// The sum and the difference make the edge of a neighbour, which goes the other way, exactly the negative: no ray
// passes between the two.
vec3 edgeVolume(vec3 p, vec3 q) {
    precise vec3 normal = cross(p + q, q - p);
    precise vec3 volume = vec3(dot(normal, frame.camera.forward), dot(normal, frame.camera.right),
                               dot(normal, frame.camera.down));
    return volume;
}

Edges edgesOf(Corners corners) {
    return Edges(edgeVolume(corners.b, corners.c), edgeVolume(corners.c, corners.a),
                 edgeVolume(corners.a, corners.b),
                 vec3(dot(corners.a, frame.camera.forward), dot(corners.b, frame.camera.forward),
                      dot(corners.c, frame.camera.forward)));
}

// The depth at which the ray of `pixel` meets the triangle; negative where it does not or is before the near plane.
float depthAt(Edges edges, Corners corners, ivec2 pixel) {
    vec2 size = vec2(frame.camera.width, frame.camera.height);
    precise vec3 place = vec3(1.0, (vec2(pixel) + 0.5) / size * 2.0 - 1.0);
    precise vec3 volumes = vec3(dot(edges.a, place), dot(edges.b, place), dot(edges.c, place));
    precise float sum = volumes.x + volumes.y + volumes.z;
    bool isMissed = any(lessThan(volumes, vec3(0.0))) && any(greaterThan(volumes, vec3(0.0)));
    if (isMissed || sum == 0.0) {
        return -1.0;
    }
    vec3 direction = cameraDirection(frame.camera, uvec2(pixel));
    float depth = distanceAlong(passageOf(direction, corners.a, corners.b, corners.c));
    return depth >= cameraNearDistance(frame.camera, direction) ? depth : -1.0;
}

#endif
