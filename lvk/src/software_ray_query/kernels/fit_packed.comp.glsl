// The boxes of wide nodes that were made anew.
void main() {
    readJob(firstJob);
    if (isPacked()) fitWideFrom(invocation());
}
