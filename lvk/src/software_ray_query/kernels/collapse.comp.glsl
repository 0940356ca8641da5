// Builds the wide nodes of a level.
void main() {
    readJob(firstJob);
    uvec2 nodes = nodesOfLevel(passOrJobs);
    uint first = nodes.x + groupNumber() * kTeams;
    if (first < nodes.y) collapse(first, nodes.y, passOrJobs);
}
