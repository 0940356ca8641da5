// The push constants of ../ray_records.glsl. Rays and hit records are read and written in halves of 16 bytes: some
// versions of DXC write no offsets for structs behind addresses.
#include <lvk.hlsli>

struct Push {
    uint64_t rays;
    uint64_t hits;
    uint tlas;
    uint count;
    uint mask;
    uint flags;
};
[[vk::push_constant]] Push push;
