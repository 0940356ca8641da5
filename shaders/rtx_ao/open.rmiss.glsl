// A ray that nothing stopped.
layout(location = 0) rayPayloadInEXT uint blocked;

void main() {
    blocked = 0u;
}
