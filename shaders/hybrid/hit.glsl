// The hit of a ray: the integrator calls traceClosest() and traceOccluded(), which trace_pipeline.glsl and
// trace_query.glsl answer.
#ifndef HYBRID_HIT
#define HYBRID_HIT

const uint kNoTriangle = 0xffffffffu;

// Instance mask bits. Light passes through refractive triangles, so shadow rays do not look for them.
const uint kMaskOpaque = 0x01u, kMaskAll = 0x03u;

struct Hit {
    uint triangle; // or kNoTriangle
    vec2 barycentrics; // weights of the triangle's second and third vertex
};

#endif
