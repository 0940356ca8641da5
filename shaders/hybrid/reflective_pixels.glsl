// Pixels whose light goes on from their first surface, by mirror or glass. The launch over all pixels queues them, and
// another one, of just as many threads, follows their rays: so those of one pixel keep no neighbour waiting.
#ifndef HYBRID_BOUNCE_QUEUE
#define HYBRID_BOUNCE_QUEUE

// Threads of a workgroup that follows rays by query.
const uint kBounceGroup = 64u;

// Number of queued pixels, as arguments of their launch.
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer BounceHead {
    uvec3 rays; // of an indirect trace: x pixels
    uvec3 groups; // of an indirect dispatch
};

struct BouncePixel {
    uint place; // x in the low, y in the high half
    uint triangle; // the first surface
    vec2 barycentrics;
    vec3 color; // what it sends by itself
};

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer BouncePixels { BouncePixel at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer ColorArray { vec3 at[]; };

struct BounceQueue {
    BounceHead head;
    BouncePixels pixels; // room for all pixels of a band
};

#endif
