// Moves the keys of a block to their sorted positions.
shared uint start[kDigits];

void main() {
    readJob(firstJob);
    uint blocks = (job.count + kBlock - 1) / kBlock;
    uint block = groupNumber();
    uint t = gl_LocalInvocationIndex;
    uint first = block * kBlock + t * kItems;
    uint end = block < blocks ? min(first + kItems, job.count) : first;
    Source from = sourceOf(passOrJobs);
    Words to = targetOf(passOrJobs);
    rankKeys(from, first, end);
    if (t < kDigits && block < blocks) {
        start[t] = Words(work(job.digits)).word[t * blocks + block] - counts[t * kGroup];
    }
    barrier();
    [[dont_unroll]] for (uint i = first; i < end; ++i) {
        uint digit = digitOf(from, i);
        uint rank = counts[digit * kGroup + t]++;
        moveKey(from, to, i, start[digit] + rank);
    }
}
