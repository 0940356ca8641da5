// Leaves what the any-hit shader counted.
void main() {}
