#include "bench/view.glsl"

layout(location = 0) rayPayloadInEXT Hit hit;

void main() { hit.t = kNoHit; }
