// Writes instance records as Vulkan reads them, with the number of a BLAS instead of its address: a grid of
// instances that are rotated about the x axis. WIDTH is that of the grid.
layout(local_size_x = 64) in;

struct Record {
    float rows[12];
    uint customIndexAndMask;
    uint hitGroupAndFlags;
    uint structure;
    uint structureHigh;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Records { Record at[]; };

layout(push_constant, scalar) uniform Push {
    Records records;
    uint count;
    uint models; // the places 0 to models - 1 exist
    vec2 turn;   // cosine and sine of the angle, as devices' own are not exact
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) {
        return;
    }
    float c = turn.x, s = turn.y;
    vec3 to = vec3(i % WIDTH, i / WIDTH, i % 3) * 3.0;
    Record record;
    record.rows = float[](1, 0, 0, to.x, 0, c, -s, to.y, 0, s, c, to.z);
    record.customIndexAndMask = (0xffffffu - i) & 0xffffffu | (1u + i % 255u) << 24;
    record.hitGroupAndFlags = i % 5 == 2 ? 2u << 24 : 0u; // FLIP_FACING
    bool isThere = i % 7 != 3;
    record.structure = isThere ? i % models : models + i;
    record.structureHigh = i % 14 == 3 ? 1u : 0u; // neither does a place beyond 32 bits exist
    records.at[i] = record;
}
