// Nobody has arrived anywhere.
void main() {
    readJob(firstJob);
    uint i = invocation();
    if (i < min(header().word[8], job.nodeCapacity)) resetArrivals(i);
}
