// The boxes of wide nodes.
void main() {
    readJob(firstJob);
    fitWideFrom(invocation());
}
