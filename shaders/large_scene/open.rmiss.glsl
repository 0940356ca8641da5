// A shadow ray with nothing in its way.
layout(location = 1) rayPayloadInEXT uint occluded;

void main() {
    occluded = 0u;
}
