// Ranks keys by four bits, stably: a counter for each digit and invocation, summed in the order digit, invocation.
// Every invocation has a run of consecutive keys. Nothing depends on the size of subgroups.
const uint kDigits = 16u;

shared uint counts[kDigits * 128];
shared uint sums[128];

struct Source { Words keys; uint digitWord; uint shift; };

// Returns the key word and the bits that a pass sorts by; the low words come first.
Source sourceOf(uint pass) {
    bool low = pass < lowPasses();
    return Source(keysBefore(pass), low ? 2 * job.count : 0u, (low ? pass : pass - lowPasses()) * 4u);
}

Words targetOf(uint pass) { return keysBefore(pass + 1u); }

uint digitOf(Source from, uint i) { return from.keys.word[from.digitWord + i] >> from.shift & (kDigits - 1); }

void moveKey(Source from, Words to, uint i, uint rank) {
    to.word[rank] = from.keys.word[i];
    to.word[job.count + rank] = from.keys.word[job.count + i];
    if (job.lowBits != 0u) to.word[2 * job.count + rank] = from.keys.word[2 * job.count + i];
}

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

// Fills `counts` with the rank, within the workgroup, of the first key of each digit and invocation.
void rankKeys(Source from, uint first, uint end) {
    uint t = gl_LocalInvocationIndex;
    [[dont_unroll]] for (uint digit = 0; digit < kDigits; ++digit) counts[digit * kGroup + t] = 0;
    [[dont_unroll]] for (uint i = first; i < end; ++i) counts[digitOf(from, i) * kGroup + t] += 1;
    barrier();
    uint own = 0;
    [[dont_unroll]] for (uint k = 0; k < kDigits; ++k) own += counts[t * kDigits + k];
    uint sum = before(own);
    [[dont_unroll]] for (uint k = 0; k < kDigits; ++k) {
        uint count = counts[t * kDigits + k];
        counts[t * kDigits + k] = sum;
        sum += count;
    }
    barrier();
}
