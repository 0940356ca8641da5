// Rewrites the primitives of leaves from the caller's current buffers.
void main() {
    readJob(firstJob);
    refitFrom(invocation());
}
