// The boxes of binary nodes, and better places for some of them.
void main() {
    readJob(firstJob);
    fitFrom(invocation());
}
