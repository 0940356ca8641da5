// A hit of a ray, and the triangle that it names.
#ifndef VIEWER_HIT
#define VIEWER_HIT

#include "common/octahedral.glsl"
#include "viewer/frame.glsl"

const uint kNothing = 0xffffffffu;

struct Hit {
    uint instance; // kNothing where the ray left the scene
    uint geometry; // of the instance
    uint primitive;
    vec2 barycentrics;
    float distance;
};

// What a traced ray carries.
struct Payload {
    Hit hit;
    vec3 transmittance; // of what lies on the way of a shadow ray
    uint seed; // of a ray that looks for the nearest surface, below kJudgesBacks; kShadow for a shadow ray
};

const uint kShadow = 0xffffffffu;
// Set in the seed of a ray that goes through unseen backs.
const uint kJudgesBacks = 0x80000000u;

// The seed of a ray that looks for the nearest surface, below kJudgesBacks, and not kShadow with it.
uint nearestSeed(uint random) {
    return random >> 2;
}

struct Triangle {
    uvec3 corners;
    uint geometry; // in the list of all
};

vec3 positionIn(uvec2 positions, uint flags, uint corner) {
    if ((flags & kQuantised) == 0u) {
        return PositionArray(positions).at[corner];
    }
    uvec2 words = QuantisedArray(positions).at[corner];
    return vec3(unpackSnorm2x16(words.x), unpackSnorm2x16(words.y).x);
}

vec3 positionOf(Geometry geometry, uint corner) {
    return positionIn(geometry.positions, geometry.flags, corner);
}

vec3 transformed(vec4 rows[3], vec3 point) {
    vec4 p = vec4(point, 1.0);
    return vec3(dot(rows[0], p), dot(rows[1], p), dot(rows[2], p));
}

vec3 toWorld(Instance instance, vec3 point) {
    return transformed(instance.rows, point);
}

vec3 vectorToWorld(Instance instance, vec3 v) {
    return toWorld(instance, v) - vec3(instance.rows[0].w, instance.rows[1].w, instance.rows[2].w);
}

vec3 normalToWorld(Instance instance, vec3 n) {
    return instance.normalColumns[0] * n.x + instance.normalColumns[1] * n.y + instance.normalColumns[2] * n.z;
}

// True for an instance that turns its triangles over.
bool flipsWinding(Instance instance) {
    return dot(cross(instance.rows[0].xyz, instance.rows[1].xyz), instance.rows[2].xyz) < 0.0;
}

// A normal of a triangle on its front, of any length. The front is where the triangle turns counter-clockwise, before instances mirror it.
vec3 outwards(Instance instance, Geometry geometry, uvec3 corners) {
    vec3 a = positionOf(geometry, corners.x);
    return normalToWorld(instance, cross(positionOf(geometry, corners.y) - a, positionOf(geometry, corners.z) - a));
}

// True for the back of a single-sided surface that rays do not cull, since the mesh has double-sided surfaces too.
bool isUnseenBack(Hit hit, vec3 direction) {
    if (hit.instance == kNothing) {
        return false;
    }
    Instance instance = frame.instances.at[hit.instance];
    Geometry geometry = frame.geometries.at[instance.firstGeometry + hit.geometry];
    const uint mixed = kSingleSided | kMixedSides;
    uvec3 corners = CornerArray(geometry.indices).at[hit.primitive];
    return (geometry.flags & mixed) == mixed && dot(outwards(instance, geometry, corners), direction) > 0.0;
}

vec3 weightsOf(vec2 barycentrics) {
    return vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
}

vec3 unpackedNormal(uint bits) {
    return unitFromOctahedral(unpackSnorm2x16(bits));
}

vec4 vertexColor(AttributesArray all, uvec3 corners, vec3 weights) {
    return weights.x * unpackUnorm4x8(all.at[corners.x].color) + weights.y * unpackUnorm4x8(all.at[corners.y].color) +
           weights.z * unpackUnorm4x8(all.at[corners.z].color);
}

// Both sets of texture coordinates.
struct Texcoords {
    vec2 sets[2];
};

Texcoords texcoordsOf(AttributesArray all, uvec3 corners, vec3 weights) {
    Texcoords between;
    for (uint set = 0u; set < 2u; ++set) {
        between.sets[set] = weights.x * all.at[corners.x].texcoords[set] + weights.y * all.at[corners.y].texcoords[set] +
                            weights.z * all.at[corners.z].texcoords[set];
    }
    return between;
}

#endif
