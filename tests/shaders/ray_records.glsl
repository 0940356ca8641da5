// Push constants of all tests: rays in, hit records out.
#ifndef RAY_RECORDS
#define RAY_RECORDS

const uint kMissed = 0;
const uint kFront = 0xfe;
const uint kBack = 0xff;

struct Ray {
    vec3 origin;
    float tMin;
    vec3 direction;
    float tMax;
};

struct HitRecord {
    float t;
    vec2 barycentrics;
    uint kind; // kMissed, kFront, kBack, or what an intersection shader reported
    uint instance;
    uint customIndex;
    uint geometry;
    uint primitive;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Rays {
    Ray at[];
};

layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer HitRecords {
    HitRecord at[];
};

layout(push_constant, scalar) uniform Push {
    Rays rays;
    HitRecords hits;
    uint tlas;
    uint count;
    uint mask;
    uint flags;
};

// Declares the index of a launched ray generation shader and its ray, and returns beyond the last ray.
#define START_RAY_GEN                                                      \
    uint index = gl_LaunchIDEXT.y * gl_LaunchSizeEXT.x + gl_LaunchIDEXT.x; \
    if (index >= count) {                                                  \
        return;                                                            \
    }                                                                      \
    Ray ray = rays.at[index]

const HitRecord kNoHit = HitRecord(0.0, vec2(0.0), kMissed, 0u, 0u, 0u, 0u);

#endif
