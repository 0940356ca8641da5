// Fits the bounds of packed wide nodes.
void main() {
    readJob(firstJob);
    if (isPacked()) fitWideFrom(invocation());
}
