// The frame constants of the sample, and what they lead to: the arrays of the scene.
#ifndef VIEWER_FRAME
#define VIEWER_FRAME

#include "common/camera.glsl"
#include "common/no_texture.glsl"

const float kPi = 3.14159265358979;

// Bits of Geometry.flags.
const uint kQuantised = 1u; // positions are four signed normalised numbers of 16 bits each
const uint kSingleSided = 2u; // the eye does not see its back
const uint kMixedSides = 4u; // the mesh has single- and double-sided surfaces, so that rays cull none of its backs

// Bits of Material.flags.
const uint kAlphaMask = 1u; // holes where alpha is below the cutoff
const uint kAlphaBlend = 2u; // alpha is the share of light that meets the surface
const uint kUnlit = 8u;
const uint kTangents = 32u; // the surface has a direction: a normal map or anisotropy
const uint kThin = 16u; // light that passes keeps its direction: there is no volume behind the surface
const uint kExtensions = 64u; // more than base colour, metalness, roughness, emission, normals and anisotropy

// What a texture multiplies (places in Material.slots).
const uint kSlotBaseColor = 0u;
const uint kSlotMetalRough = 1u;
const uint kSlotNormal = 2u;
const uint kSlotEmission = 3u;
const uint kSlotTransmission = 4u;
const uint kSlotSpecular = 5u;
const uint kSlotSpecularColor = 6u;
const uint kSlotCoat = 7u;
const uint kSlotCoatRoughness = 8u;
const uint kSlotSheenColor = 9u;
const uint kSlotSheenRoughness = 10u;
const uint kSlotCoatNormal = 11u;
const uint kSlotAnisotropy = 12u;
const uint kSlotFilm = 13u;
const uint kSlotFilmThickness = 14u;
const uint kSlotCount = 15u;

// Kinds of lights.
const uint kLightDisc = 0u; // infinitely far away, a disc in the sky
const uint kLightPoint = 1u;
const uint kLightSpot = 2u;

const uint kAllInstances = 0xffffffffu;

struct Instance {
    vec4 rows[3]; // to the world
    vec3 normalColumns[3]; // of normals to the world
    uint firstGeometry;
};

// Addresses are numbers: SwiftShader miscompiles copies of structs that hold buffer references.
struct Geometry {
    uvec2 positions;
    uvec2 positionsBefore; // in the frame before; where nothing moves the same
    uvec2 attributes;
    uvec2 indices;
    uint material;
    uint flags;
    float emissionWeight; // of its triangles among all that shadow rays look for; 0 if they do not
    uint padding;
};

// A mesh and its instances, which culling looks at.
struct MeshRun {
    vec3 middle; // of the box around the mesh
    uint firstInstance;
    vec3 extent; // half of its edges; negative where its vertices move, so that it is always drawn
    uint instanceCount;
    uint firstDraw;
    uint drawCount; // of geometries
};

// A triangle that shadow rays look for.
struct Emitter {
    uint instance;
    uint geometry; // of the instance
    uint primitive;
    float chance; // that this one or one before it is chosen
};

struct Attributes {
    uint normal; // octahedral, two signed normalised numbers
    uint tangent; // likewise; the lowest bit is set where the bitangent is turned
    vec2 texcoords[2];
    uint color; // linear, four unsigned normalised numbers
};

// A texture as a material uses it: texture coordinates are columns * texcoord + offset.
struct TextureSlot {
    uint tex;
    uint smp;
    uint set; // 0 or 1: which texture coordinates
    uint image; // whose levels are resident from firstMip on
    uint firstMip;
    uvec2 extent; // texels of the largest level of the image
    vec4 columns;
    vec2 offset;
};

struct Material {
    vec4 baseColor;
    vec3 emission;
    float metalness;
    vec3 extinction; // of the volume behind the surface, per unit of length
    float roughness;
    vec3 specularColor;
    float specular;
    vec3 sheenColor;
    float sheenRoughness;
    float transmission;
    float ior;
    float alphaCutoff;
    float normalScale;
    float coat;
    float coatRoughness;
    float coatNormalScale;
    float anisotropy;
    vec2 anisotropyDirection; // in the plane of the tangent
    float film; // share of the surface that a thin film covers
    float filmIor;
    vec2 filmThickness; // in nanometres, where the texture is 0 and where it is 1
    uint flags;
    uint slots[kSlotCount]; // indices into the texture slots, or kNoTexture
};

struct Light {
    vec3 position; // for a disc: towards it
    uint kind;
    vec3 color; // irradiance of a disc, else radiant intensity
    float probability; // of being chosen, among all lights, emitters and the sky
    vec3 direction; // along which a spot shines
    float cone; // of a disc, 1 - cosine of its radius; of a spot, cosine of the outer cone
    float cosInner; // of a spot's inner cone
    float range; // of a point or spot light; 0 for no end
};

// A path under way, and the light that it has found so far.
struct Path {
    vec3 origin;
    vec3 direction;
    float density; // of the direction; below 0 where nothing else looks for light along it
    vec3 from; // the surface that the direction was drawn at
    vec3 extinction; // of the volume that the path is in
    float squeezed; // product of eta^2 of the boundaries that the path has passed, whose inverse is in its throughput
    float spread; // of the cone that the path stands for, over its length; 0: textures are read unfiltered
    float width; // of the cone at the origin
    uint bounce; // number of the next surface, from 0
    uint rayCount; // traced so far, shadow rays too
    vec3 throughput;
    vec3 radiance;
};

// A path between two launches.
struct StoredPath {
    Path path;
    uint pair; // random numbers drawn so far, in pairs
};

const uint kMostUpdates = 4u;

// What the radiance cache knows of a cell.
struct CacheCell {
    vec3 mean; // light over reflectance
    float samples; // in the mean
    uint idle; // frames since the last sample
};

// A surface of a path that updates the radiance cache.
struct CacheUpdate {
    uint entry;
    vec3 light; // of the path before what the surface scatters
    vec3 factor; // of the light of the cell in that of the path
};

// A path that updates the radiance cache.
struct UpdatingPath {
    uint count;
    CacheUpdate updates[kMostUpdates];
};

// What a pass over the visible surfaces draws to.
struct VisibleTargets {
    uint triangles; // an index into kTexturesU2D: instance, geometry and primitive of each pixel
    uint depth; // an index into kTextures2D, reversed
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer InstanceArray { Instance at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer RowsArray { vec4 at[][3]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer GeometryArray { Geometry at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer AttributesArray { Attributes at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer PositionArray { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer QuantisedArray { uvec2 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer CornerArray { uvec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer MaterialArray { Material at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer SlotArray { TextureSlot at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightArray { Light at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer EmitterArray { Emitter at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer FloatArray { float at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) coherent buffer LevelArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer SumArray { vec4 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer StoredPathArray { StoredPath at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer CellArray { CacheCell at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer UpdatingPathArray { UpdatingPath at[]; };

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer MeshRunArray { MeshRun at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer NumberArray { uint at[]; };
// Vertices, instances, first vertex and first instance of an indirect draw.
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer ArgumentArray { uvec4 at[]; };

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
    Camera camera;
    InstanceArray instances;
    RowsArray rowsBefore; // of the instances in the frame before
    GeometryArray geometries;
    MaterialArray materials;
    SlotArray slots;
    LightArray lights;
    EmitterArray emitters;
    FloatArray skyRows; // cumulative distribution of the rows of the sky's map
    FloatArray skyColumns; // of each row, one after another
    PositionArray sky; // radiance of the texels of its map, row by row
    PositionArray albedos; // of a rough reflector: the table of albedo.glsl
    MeshRunArray runs;
    NumberArray visible; // instances that culling leaves, from the first place of their mesh on
    ArgumentArray drawArguments; // of the geometries of all meshes
    NumberArray drawnCounts; // of each mesh: instances that culling leaves, and those in the frustum
    NumberArray wasVisible; // of each instance: not 0 if the last frame that looked for hidden ones found it visible
    SumArray sums; // radiance of all samples so far and their rays, for each pixel; of the real-time method the picture
    uint lightCount;
    uint discCount; // lights that are discs, which come first
    float skyProbability; // likewise
    uvec2 skySize; // texels of the map of the sky: columns around y, rows from the zenith down
    uint tlas;
    uint image;
    uint sampleNumber; // of the first sample of this pass
    uint pixelCount; // of the picture
    uint maxBounces;
    float exposure;
    float offsetExtent; // the unit of length of rounding errors near the origin
    uint toneMapping;
    // Of the real-time method:
    uint frameNumber; // since the camera was chosen; 0: there is no frame before
    Camera seen; // the camera without the shift within a pixel
    Camera seenBefore; // of the frame before, likewise
    VisibleTargets visible1; // kNoTexture where rays find what pixels show
    VisibleTargets visible2; // of what occlusion culling draws in its second pass; kNoTexture without it
    FloatArray pyramid; // of pyramid.glsl, with the depth of the first pass
    SumArray planes; // of plane.glsl
    NumberArray pathLists; // of path_launch.glsl
    StoredPathArray paths; // of each pixel
    NumberArray cacheKeys; // checksums of the cells of the radiance cache; 0 where an entry is free
    NumberArray cacheSums; // of the samples of this frame
    CellArray cacheCells;
    UpdatingPathArray updatingPaths; // one for each block of pixels
    uvec2 wantedMips; // of each image the finest level that was read; 0 if all levels are resident
    NumberArray ambientSums; // of ambient_term.glsl
    uint stillCount; // frames since the camera moved
    uint view; // what the picture shows: kViewLight or another of plane.glsl
    uint sceneMoves; // not 0: something is elsewhere than in the frame before
    uint emitterCount;
    float emitterProbability; // of being chosen, among all lights, emitters and the sky
    float emitterPower; // sum of areas of emitters times their weights
    uint cacheBuckets; // of the radiance cache; 0 without one
    float cellShare; // side of its cells over their distance from the eye
    vec3 lampIrradiance; // that lamps and emitters give to surfaces, in the mean
    vec3 unoccludedIrradiance; // likewise the sky and discs, to surfaces that nothing hides
    vec3 boxMin; // around the scene
    vec3 boxMax;
    float occlusionDistance; // of surfaces that take no ambient light from each other
    uint lightTurns; // frames from one turn of a pixel to find light to the next: 1 or kTurns of light_turn.glsl
};

layout(push_constant, scalar) uniform PushConstants {
    Frame frame;
    uint argument; // of the pass
    uint firstVisible; // of a draw: where its instances begin among those that culling leaves; kAllInstances without culling
};

// The pixel whose number is `place`, in rows from the top.
uvec2 pixelOf(uint place) {
    return uvec2(place % frame.camera.width, place / frame.camera.width);
}

#endif
