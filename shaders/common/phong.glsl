// Phong's reflection model.
#ifndef COMMON_PHONG
#define COMMON_PHONG

// Light that leaves towards `view` for one unit of light from `light`, which stands above the surface. All vectors
// have unit length and point away from the surface.
vec3 phong(vec3 albedo, vec3 specular, float shininess, vec3 normal, vec3 view, vec3 light) {
    float highlight = max(dot(reflect(-light, normal), view), 0.0);
    return albedo * dot(normal, light) + specular * pow(highlight, shininess);
}

#endif
