// Builds the wide nodes of a level. Each workgroup builds those of every so many teams, as levels hold few nodes or many.
void main() {
    readJob(firstJob);
    uvec2 nodes = nodesOfLevel(passOrJobs);
    uint step = gl_NumWorkGroups.x * gl_NumWorkGroups.y * kTeams;
    [[dont_unroll]] for (uint i = nodes.x + groupNumber() * kTeams; i < nodes.y; i += step) {
        collapse(i, nodes.y, passOrJobs);
    }
}
