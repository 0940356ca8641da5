// Writes the leaves of a BLAS, its vertices, geometries and header; and packed nodes if the collapsed ones did not fit.
void main() {
    readJob(firstJob);
    placePart(invocation());
}
