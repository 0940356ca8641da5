// Normals, colour, roughness and material of an opaque or alpha-masked surface.
#include "reflections/fragment.glsl"

layout(location = 0) out uvec4 outSurface;

void main() {
    Geometry geometry = frame.geometries.at[passArguments[0]];
    Material material = frame.materials.at[geometry.material];
    vec3 direction = normalize(inPosition - frame.camera.eye);
    vec3 geometric = facing(normalize(cross(dFdx(inPosition), dFdy(inPosition))), direction);
    vec3 normal = normalize(inNormal);
    normal = dot(normal, geometric) < 0.0 ? -normal : normal;
    vec3 albedo = material.albedo;
    float roughness = material.roughness;
    if (material.albedoTexture != kNoTexture) {
        vec4 texel = textureBindless2D(material.albedoTexture, frame.surfaceSampler, inTexcoord);
        albedo *= texel.rgb;
        roughness *= geometry.kind == kKindLeaf ? 1.0 : texel.a;
    }
    if (geometry.kind == kKindLeaf) {
        if (textureBindless2DLod(material.albedoTexture, frame.surfaceSampler, inTexcoord, 0.0).a < 0.5) {
            discard;
        }
        albedo *= leafTint(inQuad);
        normal = geometric;
    }
    outSurface = packSurface(normal, geometric, albedo, material.metalness, roughness, geometry.material);
}
