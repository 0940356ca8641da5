// The primitives of leaves, as the caller's buffers hold them now.
void main() {
    readJob(firstJob);
    refitFrom(invocation());
}
