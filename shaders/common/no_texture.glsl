// The index of a texture that is not there.
#ifndef COMMON_NO_TEXTURE
#define COMMON_NO_TEXTURE

const uint kNoTexture = 0xffffffffu;

#endif
