// A shadow ray that reached the light.
layout(location = 1) rayPayloadInEXT uint occluded;

void main() {
    occluded = 0u;
}
