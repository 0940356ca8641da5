// A light itself: it shines, and nothing lights it.
layout(location = 0) in vec2 place;
layout(location = 1) flat in vec3 color;
layout(location = 0) out vec4 albedoAndRoughness;
layout(location = 1) out vec4 normalAndMetalness;
layout(location = 2) out vec4 lit;

void main() {
    float from = dot(place, place);
    if (from > 1.0) {
        discard;
    }
    albedoAndRoughness = vec4(0.0, 0.0, 0.0, 1.0);
    normalAndMetalness = vec4(0.0, 1.0, 0.0, 0.0);
    lit = vec4(color * 2.2 + 0.7 * (1.0 - from), 1.0);
}
