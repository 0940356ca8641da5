// Lays a transparent surface over the lit opaque ones and over those farther away: the draws come farthest first. The one
// in front has its traced reflection; those behind it see the ambient light.
#include "reflections/ambient.glsl"
#include "reflections/fragment.glsl"
#include "reflections/reflectance.glsl"

layout(location = 0) out vec4 outColor; // premultiplied

float opacityOf(Material material, vec3 direction) {
    if (material.density <= 0.0) {
        return material.opacity;
    }
    float behind = textureBindlessFetch2D(frame.opaqueDepth, ivec2(gl_FragCoord.xy), 0).r;
    float depth = behind > 0.0 ? depthDistance(behind, direction) - depthDistance(gl_FragCoord.z, direction) : 100.0;
    return 1.0 - exp(-material.density * max(depth, 0.0));
}

void main() {
    if (isHidden()) {
        discard;
    }
    Material material = frame.materials.at[frame.geometries.at[passArguments[0]].material];
    vec3 direction = normalize(inPosition - frame.camera.eye);
    vec3 normal = transparentNormal(material, direction);
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    bool inFront = gl_FragCoord.z >= textureBindlessFetch2D(frame.glassDepth, pixel, 0).r;
    vec3 mirrored = inFront ? textureBindlessFetch2D(frame.glassReflection, pixel, 0).rgb
                            : ambientRadiance(reflect(direction, normal));
    float normalIncidence = material.density > 0.0 ? 0.02 : 0.08;
    float fresnel = fresnelSchlick(vec3(normalIncidence), -dot(direction, normal)).x;
    float opacity = opacityOf(material, direction);
    vec3 tint = material.albedo * ambientIrradiance(vec3(0.0, 1.0, 0.0));
    outColor = vec4(fresnel * mirrored + (1.0 - fresnel) * opacity * tint, 1.0 - (1.0 - fresnel) * (1.0 - opacity));
}
