// The payload from a task workgroup to its mesh workgroups.
const uint kMeshletsPerTask = 32u;

struct Chosen {
    uint meshlets[kMeshletsPerTask];
};
