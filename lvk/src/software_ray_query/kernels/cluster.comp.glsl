// Builds the binary trees of some jobs, with as many workgroups for each.
void main() {
    uint group = groupNumber();
    if (group >= passOrJobs * groupsOfJob) return;
    readJob(firstJob + group / groupsOfJob);
    clusterFrom(group % groupsOfJob * kGroup + gl_LocalInvocationIndex);
}
