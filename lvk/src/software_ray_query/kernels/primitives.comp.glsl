// Computes the bounds of every triangle or AABB of the inputs, and reduces the bounds of all.
void main() {
    readJob(firstJob);
    uint actives = 0;
    Box centres = emptyBox();
    uint first = groupNumber() * kBlock, end = min(first + kBlock, job.count);
    [[dont_unroll]] for (uint i = first + gl_LocalInvocationIndex; i < end; i += kGroup) {
        centres = join(centres, keepBox(i, inputBox(i), actives));
    }
    extendBounds(centres, actives);
}
