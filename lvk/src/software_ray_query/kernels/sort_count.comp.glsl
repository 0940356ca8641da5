// Counts each digit in each block of keys.
shared uint found[kDigits];

void main() {
    readJob(firstJob);
    uint blocks = (job.count + kBlock - 1) / kBlock;
    uint block = groupNumber();
    uint t = gl_LocalInvocationIndex;
    if (t < kDigits) found[t] = 0;
    barrier();
    Source from = sourceOf(passOrJobs);
    [[dont_unroll]] for (uint k = 0; k < kItems; ++k) {
        uint i = block * kBlock + k * kGroup + t;
        if (i < job.count) atomicAdd(found[digitOf(from, i)], 1u);
    }
    barrier();
    if (t < kDigits && block < blocks) Words(work(job.digits)).word[t * blocks + block] = found[t];
}
