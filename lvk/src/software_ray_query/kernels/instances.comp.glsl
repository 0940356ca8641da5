// Stores every instance and its bounds in the world, and reduces the bounds of all.
void main() {
    readJob(firstJob);
    uint i = invocation();
    uint actives = 0;
    Box centres = emptyBox();
    if (i < job.count) centres = keepBox(i, keepInstance(i), actives);
    extendBounds(centres, actives);
}
