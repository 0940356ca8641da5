// The rays of the sample, and what they carry.
#ifndef RTX_PIPELINE_RADIANCE
#define RTX_PIPELINE_RADIANCE

// Instance mask bits. Light passes through glass, so shadow rays do not look for it.
const uint kMaskSolid = 0x01u, kMaskAll = 0x03u;

// Places of hit groups and of miss shaders in the pipeline; queries tell surfaces apart by the former.
const uint kSolid = 0u, kGlass = 1u;
const uint kSky = 0u, kLight = 1u;

// Payload of a ray that asks for light.
struct Radiance {
    vec3 light; // the answer
    float cone; // the question: footprint where the ray starts,
    uint depth; // and how often it has been mirrored or bent
};

#endif
