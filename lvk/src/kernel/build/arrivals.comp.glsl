// Nobody has arrived anywhere.
void main() {
    job = jobs.job[firstJob];
    uint i = invocation();
    if (i < min(header().word[8], job.nodeCapacity)) resetArrivals(i);
}
