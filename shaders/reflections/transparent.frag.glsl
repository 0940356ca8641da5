// The nearest transparent surface that no opaque one hides: normals and depth, which mask the second ray pass.
#include "reflections/fragment.glsl"

layout(location = 0) out uvec4 outSurface;

void main() {
    if (isHidden()) {
        discard;
    }
    uint number = frame.geometries.at[passArguments[0]].material;
    Material material = frame.materials.at[number];
    vec3 direction = normalize(inPosition - frame.camera.eye);
    vec3 normal = transparentNormal(material, direction);
    outSurface = packSurface(normal, facing(normalize(inNormal), direction), material.albedo, 0.0, material.roughness, number);
}
