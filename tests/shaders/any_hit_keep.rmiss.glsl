// Keeps the counts of the any-hit shader.
void main() {}
