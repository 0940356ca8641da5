// The boxes of wide nodes.
void main() {
    job = jobs.job[firstJob];
    fitWideFrom(invocation());
}
