layout(location = 0) rayPayloadInEXT uint reached;

void main() { reached = 1u; }
