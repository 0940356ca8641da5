// The leaves of a structure, its vertices, geometries and header; and its nodes where they had no room as they were.
void main() {
    readJob(firstJob);
    placePart(invocation());
}
