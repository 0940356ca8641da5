// Converts counts of digits to positions of their keys: prefix sums of all counters. One workgroup.
void main() {
    readJob(firstJob);
    uint total = kDigits * ((job.count + kBlock - 1) / kBlock);
    Words table = Words(work(job.digits));
    uint carried = 0;
    [[dont_unroll]] for (uint tile = 0; tile < total; tile += kBlock) {
        uint first = tile + gl_LocalInvocationIndex * kItems;
        uint end = min(first + kItems, total);
        uint own = 0;
        [[dont_unroll]] for (uint i = first; i < end; ++i) own += table.word[i];
        uint sum = carried + before(own);
        [[dont_unroll]] for (uint i = first; i < end; ++i) {
            uint count = table.word[i];
            table.word[i] = sum;
            sum += count;
        }
        carried += sums[kGroup - 1];
        barrier();
    }
}
