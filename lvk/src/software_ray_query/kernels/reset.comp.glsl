// Resets the build state.
void main() {
    readJob(firstJob);
    uint i = invocation();
    if (i < kStateWords) state().word[i] = 0u;
}
