// The key of every primitive; and no node has been fitted yet.
void main() {
    job = jobs.job[firstJob];
    uint i = invocation();
    if (i < job.count) writeKey(i);
    if (i < job.nodeCapacity) Words(work(job.arrivals)).word[i] = 0u;
}
