// Counts over the threads of a work group, in their order. The work group has kGroup threads.
#ifndef COMMON_COUNT_UP_TO_HERE
#define COMMON_COUNT_UP_TO_HERE

const uint kGroup = 256u;

shared uint sums[kGroup];

// Number of threads up to and including this one that have a 1. The last sum is that of all.
uint countUpToHere(uint one) {
    uint here = gl_LocalInvocationID.x;
    sums[here] = one;
    barrier();
    for (uint step = 1u; step < kGroup; step *= 2u) {
        uint before = here >= step ? sums[here - step] : 0u;
        barrier();
        sums[here] += before;
        barrier();
    }
    return sums[here];
}

#endif
