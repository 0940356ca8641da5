// The payload of any-hit shaders.
#include "ray_records.glsl"

struct Seen {
    HitRecord record;
    uint count;
    uint sum;
};

// Tells hits apart, roughly: sums of tags differ where sets of hits do.
uint tagOf(int instance, int geometry, int primitive) {
    return 1 + uint(instance) * 131 + uint(geometry) * 37 + uint(primitive);
}
