// Miss shader kLight: a shadow ray that reached its light.
layout(location = 0) rayPayloadInEXT uint occluded;

void main() {
    occluded = 0u;
}
