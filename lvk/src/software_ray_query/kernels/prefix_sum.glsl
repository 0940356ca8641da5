// Prefix sums over a workgroup. Nothing depends on the size of subgroups.
shared uint sums[kGroup];

// Returns the sum of `own` of all previous invocations.
uint before(uint own) {
    uint t = gl_LocalInvocationIndex;
    sums[t] = own;
    barrier();
    [[dont_unroll]] for (uint step_ = 1; step_ < kGroup; step_ *= 2) {
        uint left = t >= step_ ? sums[t - step_] : 0u;
        barrier();
        sums[t] += left;
        barrier();
    }
    return sums[t] - own;
}
