// Builds the wide nodes of a level.
void main() {
    readJob(firstJob);
    uvec2 nodes = nodesOfLevel(passOrJobs);
    uint i = nodes.x + invocation();
    if (nodes.x >= nodes.y) return;
    collapse(i, i < nodes.y, passOrJobs);
}
