// Converts counts of digits to positions of their keys, with a workgroup for each digit.
void main() {
    readJob(firstJob);
    uint blocks = (job.count + kBlock - 1) / kBlock;
    uint digit = groupNumber();
    uint t = gl_LocalInvocationIndex;
    if (digit >= kDigits) return;
    Words table = Words(work(job.digits));
    uint lower = 0;
    [[dont_unroll]] for (uint i = t; i < digit; i += kGroup) lower += table.word[passOrJobs * kDigits + i];
    before(lower);
    uint carried = sums[kGroup - 1];
    barrier();
    uint row = kDigitTotals + digit * blocks;
    [[dont_unroll]] for (uint tile = 0; tile < blocks; tile += kGroup) {
        uint block = tile + t;
        uint own = block < blocks ? table.word[row + block] : 0u;
        uint sum = carried + before(own);
        if (block < blocks) table.word[row + block] = sum;
        carried += sums[kGroup - 1];
        barrier();
    }
}
