// Ranks by four bits, stably: a counter for each value and invocation, summed in the order value, invocation. Every
// invocation has a run of consecutive items.
const uint kNibbles = 16u;

shared uint counts[kNibbles * kGroup];

void resetCounts() {
    [[dont_unroll]] for (uint value = 0; value < kNibbles; ++value) counts[value * kGroup + gl_LocalInvocationIndex] = 0;
}

void countOne(uint value) { counts[value * kGroup + gl_LocalInvocationIndex] += 1; }

// Converts counts to the rank, within the workgroup, of the first item of each value and invocation.
void rankFirsts() {
    uint t = gl_LocalInvocationIndex;
    barrier();
    uint own = 0;
    [[dont_unroll]] for (uint k = 0; k < kNibbles; ++k) own += counts[t * kNibbles + k];
    uint sum = before(own);
    [[dont_unroll]] for (uint k = 0; k < kNibbles; ++k) {
        uint count = counts[t * kNibbles + k];
        counts[t * kNibbles + k] = sum;
        sum += count;
    }
    barrier();
}

// Returns the rank of the next item of a value.
uint nextRank(uint value) { return counts[value * kGroup + gl_LocalInvocationIndex]++; }
