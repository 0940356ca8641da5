// A ray against a triangle, by the arithmetic of tracers (Woop, Benthin and Wald, "Watertight Ray/Triangle
// Intersection", 2013).
#ifndef COMMON_RAY_TRIANGLE
#define COMMON_RAY_TRIANGLE

// The intersection of a ray with a triangle.
struct RayPassage {
    // Twice the signed areas that the ray spans with the edges across from each corner, looking along the ray: all of
    // one sign where it passes through. Their shares in the sum are the barycentrics.
    vec3 volumes;
    vec3 distances; // of the corners, along the ray's longest axis, in units of the ray's direction
};

// `a`, `b` and `c` are relative to the ray's origin.
RayPassage passageOf(vec3 direction, vec3 a, vec3 b, vec3 c) {
    vec3 size = abs(direction);
    // Turn the axis along which the ray is longest into z.
    if (size.x >= size.y && size.x >= size.z) {
        direction = direction.yzx;
        a = a.yzx;
        b = b.yzx;
        c = c.yzx;
    } else if (size.y >= size.z) {
        direction = direction.zxy;
        a = a.zxy;
        b = b.zxy;
        c = c.zxy;
    }
    precise float scale = 1.0 / direction.z;
    precise vec2 shear = direction.xy * scale;
    precise vec2 p = a.xy - shear * a.z;
    precise vec2 q = b.xy - shear * b.z;
    precise vec2 r = c.xy - shear * c.z;
    precise vec3 volumes = vec3(r.x * q.y - r.y * q.x, p.x * r.y - p.y * r.x, q.x * p.y - q.y * p.x);
    precise vec3 distances = vec3(a.z, b.z, c.z) * scale;
    return RayPassage(volumes, distances);
}

// The distance at which a ray that passes through the triangle meets it.
float distanceAlong(RayPassage passage) {
    vec3 v = passage.volumes;
    vec3 d = passage.distances;
    precise float distance = (v.x * d.x + v.y * d.y + v.z * d.z) / (v.x + v.y + v.z);
    return distance;
}

#endif
