// Stores every instance and its bounds in the world, and reduces the bounds of all.
void main() {
    readJob(firstJob);
    uint actives = 0;
    Box centres = emptyBox();
    uint first = groupNumber() * kBlock, end = min(first + kBlock, job.count);
    [[dont_unroll]] for (uint i = first + gl_LocalInvocationIndex; i < end; i += kGroup) {
        centres = join(centres, keepBox(i, keepInstance(i), actives));
    }
    extendBounds(centres, actives);
}
