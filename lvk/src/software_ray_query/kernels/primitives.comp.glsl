// Computes the bounds of every triangle or AABB of the inputs, and reduces the bounds of all.
void main() {
    readJob(firstJob);
    uint i = invocation();
    uint actives = 0;
    Box centres = emptyBox();
    if (i < job.count) centres = keepBox(i, inputBox(i), actives);
    extendBounds(centres, actives);
}
