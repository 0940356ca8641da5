// Nothing is known yet of any primitive.
void main() {
    readJob(firstJob);
    uint i = invocation();
    if (i < kStateWords) state().word[i] = 0u;
}
