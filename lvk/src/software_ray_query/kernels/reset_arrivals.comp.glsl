// Resets the arrival counters of all nodes.
void main() {
    readJob(firstJob);
    uint i = invocation();
    if (i < min(header().word[8], job.nodeCapacity)) resetArrivals(i);
}
