// Keeps every instance, its box in the world, and the bounds of all.
void main() {
    readJob(firstJob);
    uint i = invocation();
    uint actives = 0;
    Box centres = emptyBox();
    if (i < job.count) centres = keepBox(i, keepInstance(i), actives);
    extendBounds(centres, actives);
}
