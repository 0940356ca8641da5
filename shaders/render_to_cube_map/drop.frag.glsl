// The drop mirrors what the cube map shows.
#define PICTURE
#include "render_to_cube_map/light.glsl"
#include "render_to_cube_map/drop.glsl"
layout(location = 0) in vec3 direction;
layout(location = 0) out vec4 result;

void main() {
    vec3 outwards = normalize(direction);
    vec3 normal = dropNormal(outwards);
    vec3 seen = normalize(kDrop + dropRadius(outwards) * outwards - frame.cameras[view].eye);
    float facing = max(-dot(seen, normal), 0.0);
    vec3 mirror = mix(vec3(0.88, 0.90, 0.93), vec3(1.0), pow(1.0 - facing, 5.0));
    vec3 mirrored = reflect(seen, normal);
    float texels = 0.5 * length(fwidth(mirrored)) * textureBindlessSizeCube(frame.cubeMap).x; // that the pixel holds
    float lod = max(frame.lod, log2(max(texels, 1.0)));
    result = targetColor(mirror * textureBindlessCubeLod(frame.cubeMap, frame.smp, mirrored, lod).rgb);
}
