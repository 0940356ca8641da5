#include "ray_records.glsl"

layout(location = 0) rayPayloadInEXT HitRecord record;

void main() {
    record = kNoHit;
}
