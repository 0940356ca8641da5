// Writes the key of every primitive.
void main() {
    readJob(firstJob);
    uint i = invocation();
    if (i < job.count) writeKey(i);
}
