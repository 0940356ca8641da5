#ifndef LVK_SOFTWARE_TRIANGLE_GLSL
#define LVK_SOFTWARE_TRIANGLE_GLSL

#include <lvk/software_layout.glsl>

// Ray-triangle intersection, watertight at shared edges and vertices (Woop, Benthin and Wald, "Watertight Ray/Triangle
// Intersection", 2013). Triangles with a shared edge compute its area from the same numbers by the same operations, so
// that the ray cannot miss both of them. An area of 0 counts as inside on both sides.

// Values of a ray that all triangles share: the shear that aligns the ray with its longest axis.
struct LvkSoftShear {
    vec2 lean;   // of the other two axes, for each unit of the longest
    float scale; // one over the longest
    bool alongX; // the longest axis is x
    bool alongZ; // the longest axis is z; else y
};

struct LvkSoftPassage {
    float t;
    vec2 barycentrics;
    bool front;
};

// Returns the other two axes, and the longest. For y they are swapped, which mirrors triangles.
vec3 lvkSoftTurn(LvkSoftShear shear, vec3 v) {
    return vec3(shear.alongX ? v.y : v.x, shear.alongZ ? v.y : v.z, shear.alongX ? v.x : shear.alongZ ? v.z : v.y);
}

LvkSoftShear lvkSoftShearOf(vec3 direction) {
    vec3 size = abs(direction);
    LvkSoftShear shear;
    shear.alongX = size.x >= size.y && size.x >= size.z;
    shear.alongZ = !shear.alongX && size.z > size.y;
    vec3 turned = lvkSoftTurn(shear, direction);
    precise float scale = 1.0 / turned.z; // same rounding everywhere, as in lvkSoftTransform
    precise vec2 lean = turned.xy * scale;
    shear.scale = scale;
    shear.lean = lean;
    return shear;
}

// Returns twice the areas between the ray's line and the edges, seen along it; `lengths` of the vertices along the
// longest axis.
vec3 lvkSoftAreas(LvkSoftShear ray, vec3 origin, vec3 vertices[3], out vec3 lengths) {
    precise vec3 p = lvkSoftTurn(ray, vertices[0] - origin);
    precise vec3 q = lvkSoftTurn(ray, vertices[1] - origin);
    precise vec3 r = lvkSoftTurn(ray, vertices[2] - origin);
    precise vec2 pf = fma(-ray.lean, p.zz, p.xy);
    precise vec2 qf = fma(-ray.lean, q.zz, q.xy);
    precise vec2 rf = fma(-ray.lean, r.zz, r.xy);
    precise vec3 areas =
        vec3(qf.x * rf.y - qf.y * rf.x, rf.x * pf.y - rf.y * pf.x, pf.x * qf.y - pf.y * qf.x);
    lengths = vec3(p.z, q.z, r.z);
    return areas;
}

// Returns each area as a share of the whole. This must come first: areas times lengths would exceed the range of
// floats.
vec3 lvkSoftShares(vec3 areas, float whole) {
    return areas * (1.0 / whole);
}

float lvkSoftDistance(LvkSoftShear ray, vec3 shares, vec3 lengths) {
    return (shares.x * lengths.x + shares.y * lengths.y + shares.z * lengths.z) * ray.scale;
}

// Returns true if the ray hits the front of a triangle with areas of sum `whole`.
bool lvkSoftIsFront(LvkSoftShear ray, float whole) {
    bool mirrors = !ray.alongX && !ray.alongZ;
    return ((whole < 0.0) == (ray.scale > 0.0)) != mirrors;
}

// Returns true if the ray's line passes through the triangle, and the position.
bool lvkSoftPasses(LvkSoftShear ray, vec3 origin, vec3 vertices[3], out LvkSoftPassage passage) {
    vec3 lengths;
    vec3 areas = lvkSoftAreas(ray, origin, vertices, lengths);
    float whole = areas.x + areas.y + areas.z;
    float least = min(min(areas.x, areas.y), areas.z);
    float most = max(max(areas.x, areas.y), areas.z);
    bool passes = (least >= 0.0 || most <= 0.0) && whole != 0.0;
    if (!kLvkSoftIsCpu && !passes) { // on a CPU, a mispredicted branch costs more than the rest
        return false;
    }
    vec3 shares = lvkSoftShares(areas, whole);
    passage.t = lvkSoftDistance(ray, shares, lengths);
    passage.barycentrics = shares.yz;
    passage.front = lvkSoftIsFront(ray, whole);
    return passes;
}

#endif
