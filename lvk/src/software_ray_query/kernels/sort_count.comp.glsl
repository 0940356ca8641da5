// Counts each digit in each block of keys, and in all.
shared uint found[kDigits];

void main() {
    readJob(firstJob);
    uint blocks = (job.count + kBlock - 1) / kBlock;
    uint block = groupNumber();
    uint t = gl_LocalInvocationIndex;
    if (block >= blocks) return;
    [[dont_unroll]] for (uint digit = t; digit < kDigits; digit += kGroup) found[digit] = 0;
    barrier();
    Source from = sourceOf(passOrJobs);
    [[dont_unroll]] for (uint i = block * kBlock + t; i < min((block + 1) * kBlock, job.count); i += kGroup) {
        atomicAdd(found[digitOf(from, i)], 1u);
    }
    barrier();
    Words table = Words(work(job.digits));
    [[dont_unroll]] for (uint digit = t; digit < kDigits; digit += kGroup) {
        uint count = found[digit];
        table.word[kDigitTotals + digit * blocks + block] = count;
        if (count > 0u) atomicAdd(table.word[passOrJobs * kDigits + digit], count);
    }
}
