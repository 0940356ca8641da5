// The picture of a frame: filtered light with the colours of its surfaces. `argument`: which of both planes the filter ended in.
#include "viewer/plane.glsl"

void compositePixel(uvec2 pixel) {
    uint place = pixelPlace(ivec2(pixel));
    vec3 base = frame.planes.at[planePlace(kPlaneBase, place)].rgb;
    vec3 matte = frame.planes.at[planePlace(kPlaneMatte + argument, place)].rgb;
    vec3 mirrored = frame.planes.at[planePlace(kPlaneMirrored + argument, place)].rgb;
    vec3 color = base + matte * frame.planes.at[planePlace(kPlaneMatteAlbedo, place)].rgb +
                 mirrored * frame.planes.at[planePlace(kPlaneMirroredShare, place)].rgb;
    frame.planes.at[planePlace(kPlaneFrame, place)] = vec4(color, 1.0);
}

#define PIXEL_FUNCTION compositePixel
#include "common/for_each_pixel.glsl"
