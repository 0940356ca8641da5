// The key of every primitive.
void main() {
    job = jobs.job[firstJob];
    uint i = invocation();
    if (i < job.count) writeKey(i);
}
