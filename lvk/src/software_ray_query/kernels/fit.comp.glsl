// The boxes of binary nodes.
void main() {
    readJob(firstJob);
    fitFrom(invocation());
}
