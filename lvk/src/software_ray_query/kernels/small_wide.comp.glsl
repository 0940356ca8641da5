// Completes a small build with one workgroup for each job: the wide nodes and all other parts of the BLAS.
uint parts() { return max(max(job.count, job.inputCount), max(job.vertexCount, 1u)); }

void main() {
    if (groupNumber() >= passOrJobs) return;
    readJob(firstJob + groupNumber());
    uint t = gl_LocalInvocationIndex;
    [[dont_unroll]] for (uint level = 0; level < kLevels; ++level) {
        uvec2 nodes = nodesOfLevel(level);
        if (nodes.x >= nodes.y) break;
        [[dont_unroll]] for (uint i = nodes.x; i < nodes.y; i += kTeams) collapse(i, nodes.y, level);
        meet();
    }
    [[dont_unroll]] for (uint i = t; i < parts(); i += kGroup) placePart(i);
    if (!isPacked()) return;
    meet();
    [[dont_unroll]] for (uint i = t; i < job.nodeCapacity; i += kGroup) fitWideFrom(i);
}
