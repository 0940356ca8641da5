#ifndef LVK_SOFTWARE_TRIANGLE_GLSL
#define LVK_SOFTWARE_TRIANGLE_GLSL

// A ray against a triangle without leaks at shared edges and corners (Woop, Benthin and Wald, "Watertight Ray/Triangle
// Intersection", 2013). Triangles that share an edge compute its area from the same numbers by the same operations, so
// that none of a ray's areas can be wrong on both sides; an area of 0 counts as inside on either.

// What of a ray all triangles share.
struct LvkSoftShear {
    vec3 origin;
    vec3 shear; // by how much x and y lean for each unit of z, and 1/z, with z the longest axis
    uint axis;  // which axis that is
};

struct LvkSoftPassage {
    float t;
    vec2 barycentrics;
    bool front;
};

vec3 lvkSoftTurn(vec3 v, uint axis) {
    return axis == 0u ? v.yzx : axis == 1u ? v.zxy : v;
}

LvkSoftShear lvkSoftShearOf(vec3 origin, vec3 direction) {
    vec3 size = abs(direction);
    uint axis = size.x >= size.y && size.x >= size.z ? 0u : size.y >= size.z ? 1u : 2u;
    vec3 turned = lvkSoftTurn(direction, axis);
    precise float scale = 1.0 / turned.z;
    precise vec2 lean = turned.xy * scale;
    return LvkSoftShear(origin, vec3(lean, scale), axis);
}

// Whether the ray's line passes the triangle, and where.
bool lvkSoftPasses(LvkSoftShear ray, vec3 a, vec3 b, vec3 c, out LvkSoftPassage passage) {
    precise vec3 p = lvkSoftTurn(a - ray.origin, ray.axis);
    precise vec3 q = lvkSoftTurn(b - ray.origin, ray.axis);
    precise vec3 r = lvkSoftTurn(c - ray.origin, ray.axis);
    precise vec2 pf = p.xy - ray.shear.xy * p.z;
    precise vec2 qf = q.xy - ray.shear.xy * q.z;
    precise vec2 rf = r.xy - ray.shear.xy * r.z;
    precise vec3 areas =
        vec3(qf.x * rf.y - qf.y * rf.x, rf.x * pf.y - rf.y * pf.x, pf.x * qf.y - pf.y * qf.x);
    float whole = areas.x + areas.y + areas.z;
    float least = min(min(areas.x, areas.y), areas.z);
    float most = max(max(areas.x, areas.y), areas.z);
    if ((least < 0.0 && most > 0.0) || whole == 0.0) {
        return false;
    }
    float share = 1.0 / whole;
    passage.t = (areas.x * p.z + areas.y * q.z + areas.z * r.z) * ray.shear.z * share;
    passage.barycentrics = areas.yz * share;
    passage.front = (whole < 0.0) == (ray.shear.z > 0.0);
    return true;
}

#endif
