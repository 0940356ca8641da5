// What a task workgroup hands to its mesh workgroups.
const uint kMeshletsPerTask = 32u;

struct Chosen {
    uint meshlets[kMeshletsPerTask];
};
