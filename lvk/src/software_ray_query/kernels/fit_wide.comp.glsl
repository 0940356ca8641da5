// Fits the bounds of wide nodes.
void main() {
    readJob(firstJob);
    fitWideFrom(invocation());
}
