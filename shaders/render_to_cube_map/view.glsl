// The camera of a vertex: that of its face where one pass draws all faces, else that of the push constants.
#ifdef ALL_FACES
#extension GL_EXT_multiview : require
#endif
#include "render_to_cube_map/frame.glsl"

Camera viewCamera() {
#ifdef ALL_FACES
    return frame.cameras[gl_ViewIndex];
#else
    return frame.cameras[view];
#endif
}
