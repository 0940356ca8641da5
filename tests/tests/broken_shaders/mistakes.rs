//! The mistakes: texts of the samples' shaders, and what replaces them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;

use lvk_tests::mistakes;

const MAIN: &str = "void main() {";
const NOTHING: &str = "void main() {\n    return;";
const OIT_RAYS: &str = "#include \"hybrid_oit/shadow.glsl\"";
const NO_OIT_RAYS: &str =
    "#define traceSunlight(origin, direction) vec3(0.0)\n#include \"hybrid_oit/shadow.glsl\"";
const HALL_RAYS: &str = "#include \"reflections/reflect.glsl\"";
const NO_HALL_RAYS: &str = "
#define traceClosest(origin, direction, range) Hit(kNothing, 0u, 0u, vec2(0.0), 0.0)
#include \"reflections/reflect.glsl\"";

// Passes with a mistake write all pixels all the same, as the image is to follow from the shaders and not from what
// memory held before.
mistakes! {
    TRIANGLE:
        "hello_triangle/triangle.vert.glsl": "turns the other way": "= radians(360.0)" => "= -radians(360.0)";
        "hello_triangle/triangle.vert.glsl": "as wide as the picture": " / aspect" => "";
        "hello_triangle/triangle.frag.glsl": "other colours": "vec4(color, 1.0)" => "vec4(color.bgr, 1.0)";

    CUBE_MAP:
        "render_to_cube_map/block.vert.glsl": "blocks askew": "turned * (place" => "(place";
        "render_to_cube_map/block.frag.glsl": "other squares": "wave.x * wave.y" => "wave.x";
        "render_to_cube_map/drop.frag.glsl": "glass in place of a mirror": "reflect(seen, normal)" => "seen";
        "render_to_cube_map/drop.frag.glsl": "sharp rim": "log2(max(texels, 1.0))" => "0.0";
        "render_to_cube_map/drop.glsl": "a ball": "1.0 + frame.waves *" => "1.0 + 0.0 *";
        "render_to_cube_map/sky.frag.glsl": "no sky": "targetColor(" => "0.0 * targetColor(";
        "render_to_cube_map/light.glsl": "no shadow": "sun = along > 0.0" => "sun = along > 1e9";
    CUBE_MAP_FACES:
        "render_to_cube_map/view.glsl": "one view six times": "cameras[gl_ViewIndex]" => "cameras[0]";
        "render_to_cube_map/sky.frag.glsl": "no sky": "targetColor(" => "0.0 * targetColor(";

    MESHLETS:
        "mesh_shaders/meshlet.task.glsl": "leaves out what looks here": "(meshlet.axis)) >=" => "(meshlet.axis)) <=";
        "mesh_shaders/meshlet.task.glsl": "a frustum too narrow": "radius * slope" => "-2.5 * slope";
        "mesh_shaders/meshlet.task.glsl": "one meshlet less a group": "EmitMeshTasksEXT(count" => "EmitMeshTasksEXT(max(count, 1u) - 1u";
        "mesh_shaders/meshlet.mesh.glsl": "triangles without area": "corners >> 8" => "corners >> 16";
        "mesh_shaders/frame.glsl": "all together": "frame.apart * wave" => "0.0 * wave";
        "mesh_shaders/meshlet.frag.glsl": "one colour": "meshletColor(meshletNumber" => "meshletColor(0u";

    BODIES:
        "triplanar/triplanar.glsl": "soft borders": "vec3(frame.sharpness)" => "vec3(0.5)";
        "triplanar/triplanar.glsl": "sides on top": "normal.y > 0.0 ? body.top : body.sides" => "body.sides";
        "triplanar/triplanar.glsl": "a plane askew": "position.xy)" => "position.xz)";
        "triplanar/triplanar.glsl": "upside down": "-0.5 * at.y" => "0.5 * at.y";
        "triplanar/body.vert.glsl": "at rest": "turned(body, position)" => "position";
        "triplanar/body.frag.glsl": "no shadows": "along > 0.0" => "along > 1e9";

    HALL:
        "deferred/ambient.frag.glsl": "no night sky": "vec4(sky(-surface.toEye.y)" => "vec4(vec3(0.0)";
        "deferred/ambient.frag.glsl": "mirrors nothing": "+ mirrored + moon" => "+ moon";
        "deferred/glow.frag.glsl": "no shine": "0.2 * shine" => "0.0 * shine";
        "deferred/light.frag.glsl": "no lights": "vec4(color * window" => "vec4(0.0 * color * window";
        "deferred/light.frag.glsl": "lights without end": "float window = " => "float window = 1.0; float unused = ";
        "deferred/light.vert.glsl": "bodies of lights too small": "kAround * light.reach" => "0.4 * light.reach";
        "deferred/orbs.frag.glsl": "dark orbs": "color * 2.2 + 0.7 * (1.0 - from)" => "color * 0.0";
        "deferred/orbs.vert.glsl": "orbs and shine elsewhere": "light.position + " => "light.position + 0.3 + ";
        "deferred/resolve.frag.glsl": "no mist": "exp(-0.016 *" => "exp(-0.0 *";
        "deferred/surfaces.frag.glsl": "slabs of one kind": "mix(1.0, 0.22, other)" => "1.0";
        "deferred/surfaces.vert.glsl": "normals inside out": "normal = vertex.normal" => "normal = -vertex.normal";
        "deferred/targets.glsl": "no highlights": "distribution * masking" => "0.0 * masking";
        "deferred/targets.glsl": "surfaces elsewhere": "frame.camera.eye + frame" => "0.3 + frame.camera.eye + frame";
        "deferred/frame.glsl": "lights at rest": "kTau * (frame.phase *" => "kTau * (0.0 *";
    HALL_SEVERAL:
        "deferred/targets.glsl": "the albedo for all": "kTextures2D[frame.name]" => "kTextures2D[frame.albedo]";
        "deferred/targets.glsl": "not at this pixel": "ivec2(gl_FragCoord.xy), 0)" => "ivec2(gl_FragCoord.yx), 0)";
    HALL_ONE:
        "deferred/resolve.frag.glsl": "the normal for the light": "LVK_INPUT(2, " => "LVK_INPUT(1, ";

    LAMP:
        "omni_shadows/caster.vert.glsl": "one face twice": "uint(gl_ViewIndex)" => "uint(gl_ViewIndex) & 6u";
        "omni_shadows/caster.vert.glsl": "a face turned": "vec3(d.x, -d.y, d.z)" => "vec3(-d.x, -d.y, d.z)";
        "omni_shadows/caster.vert.glsl": "the lamp elsewhere": "- frame.light)" => "- frame.light + 0.2)";
        "omni_shadows/shadow.glsl": "surfaces shade themselves": "way += 1.5 *" => "way -= 1.5 *";
        "omni_shadows/shadow.glsl": "hard edges": "return frame.bulb *" => "return 0.0 *";
        "omni_shadows/shadow.glsl": "no shadows": "part >= 1.0" => "part >= 0.0";
        "omni_shadows/haze.glsl": "no haze": "return frame.haze *" => "return 0.0 *";
        "omni_shadows/haze.glsl": "no beams": "sum += compareAlong(" => "sum += 0.5 + 0.0 * compareAlong(";
        "omni_shadows/material.glsl": "no tiles": "0.11), odd)" => "0.11), 0.5)";
        "omni_shadows/material.glsl": "plain walls": "surface.albedo = wall;" => ";";
        "omni_shadows/surface.frag.glsl": "no highlights": "mirrored * highlight *" => "0.0 * highlight *";
        "omni_shadows/surface.frag.glsl": "no dark corners": "exp(-2.5 *" => "0.0 * exp(-2.5 *";
        "omni_shadows/surface.vert.glsl": "all is one thing": "number = gl_InstanceIndex" => "number = 0u";
        "omni_shadows/cube_view.frag.glsl": "the cube all grey": "exp(-0.45 *" => "exp(-0.0 *";
        "omni_shadows/cube_view.vert.glsl": "all faces in one place": "kCells[side]" => "kCells[0]";
    LAMP_FACES:
        "omni_shadows/caster.vert.glsl": "one face six times": "uint side = face" => "uint side = 0u";
    LAMP_HARD:
        "omni_shadows/shadow.glsl": "no comparison": "return compareAlong(smp," => "return 1.0 + 0.0 * compareAlong(smp,";

    VIDEO:
        "yuv/picture.frag.glsl": "not decoded": "decodeSrgb(clamp(" => "(clamp(";
        "yuv/picture.frag.glsl": "upside down": "picture, place)" => "picture, vec2(place.x, 1.0 - place.y))";
        "yuv/picture.vert.glsl": "too large": "(2.0 * place - 1.0) * covered" => "(2.0 * place - 1.0)";
        "yuv/planes.frag.glsl": "one plane three times": "planes[which]" => "planes[0]";
        "yuv/planes.frag.glsl": "one channel": "channels[which]" => "channels[0]";
        "yuv/planes.vert.glsl": "a plane missing": "float(which) *" => "float(which & 1u) *";
        "yuv/planes.vert.glsl": "planes too small": "0.28 * covered" => "0.2 * covered";

    ATRIUM:
        "sponza/cull.comp.glsl": "nothing is seen": "bool seen = true;" => "bool seen = false;";
        "sponza/cull.comp.glsl": "the far corner counts": "mix(high, low," => "mix(low, high,";
        "sponza/cull.comp.glsl": "half of the draws": "[view] = left;" => "[view] = left / 2u;";
        "sponza/mask.glsl": "no textures": "tex == kNoTexture" => "true";
        "sponza/shadow.vert.glsl": "no shadows drawn": "gl_Position = " => "gl_Position = 0.0 * ";
        "sponza/sky.frag.glsl": "no sky": "expose(textureBindless" => "expose(0.0 * textureBindless";
        "sponza/sky.vert.glsl": "the sky nowhere": "gl_Position = " => "gl_Position = 0.0 * ";
        "sponza/surface.frag.glsl": "shadows sharp": "= int(frame.sun.pcf)" => "= 0";
        "sponza/surface.frag.glsl": "no shadows": "return lit / (side * side)" => "return 1.0";
        "sponza/surface.frag.glsl": "surfaces shade themselves": "position + normal * (" => "position - normal * (";
        "sponza/surface.frag.glsl": "even ambient light": "0.5 + 0.5 * normal.y" => "0.5";
        "sponza/surface.vert.glsl": "textures not laid out": "outTexcoord = " => "outTexcoord = 0.0 * ";
    ATRIUM_PADDED:
        "sponza/cull.comp.glsl": "nothing is left": "at[number] = draw;" => "at[number] = uvec4(0u);";
    /// Mistakes in a scene of a board with a hole.
    BOARD:
        "sponza/mask.glsl": "no holes": "alpha < 0.5" => "alpha < -1.0";
        "sponza/shadow.frag.glsl": "holes cast shadows": "if (isHole(" => "if (false && isHole(";
    /// Mistakes in a scene of tilted tiles.
    TILES:
        "sponza/normal_mapping.glsl": "no relief": "kNoTexture || frame.hasRelief == 0u" => "0u || true";
        "sponza/normal_mapping.glsl": "upside down": "found.y * upwards" => "-found.y * upwards";
        "sponza/normal_mapping.glsl": "turned by neighbours": "sign(dot(right, acrossDown))" => "-1.0 * sign(dot(right, acrossDown))";
    /// Mistakes in a scene of things with highlights and a mirror.
    STILL_LIFE:
        "sponza/surface.frag.glsl": "no highlights": "phong(albedo, material.specular," => "phong(albedo, vec3(0.0),";
        "sponza/surface.frag.glsl": "no mirror": "material.reflectivity)" => "0.0)";
    /// Mistakes in a scene without the sun.
    STILL_LIFE_BY_LAMP:
        "sponza/surface.frag.glsl": "no lamp": "albedo * lamplight" => "0.0 * lamplight";

    HELLO:
        "rtx_hello/view.glsl": "mirrored": "+ ndc.x * camera.right" => "- ndc.x * camera.right";
        "rtx_hello/view.glsl": "white triangles": "sqrt(corners)" => "vec3(1.0)";
        "rtx_hello/view.glsl": "flat light": "mix(0.25, 1.0," => "mix(1.0, 1.0,";
        "rtx_hello/view.glsl": "an even backdrop": "2.0 * direction.y" => "0.0 * direction.y";
        "rtx_hello/hello.rchit.glsl": "all face the eye": "gl_ObjectToWorldEXT[2]" => "vec3(0.0, 0.0, 1.0)";
        "rtx_hello/hello.rgen.glsl": "jagged edges": "sum += color" => "sum = 4.0 * color";
        "rtx_hello/hello.rmiss.glsl": "no backdrop": "= backdropColor(" => "= 0.0 * backdropColor(";
    HELLO_QUERY:
        "rtx_hello/hello.comp.glsl": "turned by a corner": "(query, LVK_COMMITTED)[2]" => "(query, LVK_COMMITTED)[0]";
        "rtx_hello/hello.comp.glsl": "nothing met": "== LVK_COMMITTED_NONE" => "!= 77u";
        "rtx_hello/hello.comp.glsl": "jagged edges": "sum += color" => "sum = 4.0 * color";

    TOWN:
        "rtx_ao/light.glsl": "no sun": "bool facesSun = " => "bool facesSun = false && ";
        "rtx_ao/light.glsl": "all is open": "ray > 0u && isOpen ?" => "ray > 0u ?";
        "rtx_ao/light.glsl": "surroundings without end": "1e30 : frame.radius" => "1e30 : 1e30";
        "rtx_ao/light.glsl": "rays into one corner": "vec3(disc, sqrt(" => "vec3(abs(disc), sqrt(";
        "rtx_ao/light.rgen.glsl": "no normals": "lightAt(position.xyz, normal," => "lightAt(position.xyz, geometric,";
        "rtx_ao/open.rmiss.glsl": "all is blocked": "blocked = 0u" => "blocked = 1u";
        "rtx_ao/surface.frag.glsl": "white houses": "vec4(albedoHere(), 1.0)" => "vec4(1.0)";
        "rtx_ao/surface.vert.glsl": "normals at rest": "outNormal = toWorld(" => "outNormal = vec3(";
        "rtx_ao/accumulate.comp.glsl": "the last pass alone": "sum += frame.sums" => "sum += 0.0 * frame.sums";
        "rtx_ao/accumulate.comp.glsl": "even ambient light": "light.z)" => "0.5)";
    /// Mistakes in views that show some sky.
    TOWN_SKY:
        "rtx_ao/accumulate.comp.glsl": "no sky": "vec4(skyRadiance(" => "vec4(0.0 * skyRadiance(";
    TOWN_QUERY:
        "rtx_ao/surface.frag.glsl": "all is blocked": "return occludedByQuery(" => "return true || occludedByQuery(";
        "rtx_ao/surface.frag.glsl": "rays too short": "direction, range);" => "direction, 0.1 * range);";
        "rtx_ao/surface.frag.glsl": "no normals": "lightAt(inPosition, normal," => "lightAt(inPosition, geometric,";

    RECURSION:
        "rtx_pipeline/glass.rchit.glsl": "glass is solid": "shadeGlass(" => "shadeSolid(";
        "rtx_pipeline/solid.rchit.glsl": "textures blurred": "payload.cone)" => "payload.cone + 0.5)";
        "rtx_pipeline/light.rmiss.glsl": "no light arrives": "occluded = 0u" => "occluded = 1u";
        "rtx_pipeline/sky.rmiss.glsl": "no sky": "payload.light = " => "payload.light = 0.0 * ";
        "rtx_pipeline/recursion.glsl": "one bounce": "payload.depth + 1u)" => "payload.depth + 9u)";
        "rtx_pipeline/recursion.glsl": "hits elsewhere": "pointOf(triangle, barycentrics," => "pointOf(triangle, barycentrics.yx,";
        "rtx_pipeline/recursion.glsl": "no shadows": "return occluded != 0u" => "return false";
        "rtx_pipeline/shade.glsl": "nothing is followed": "return depth < frame.depth" => "return false";
        "rtx_pipeline/shade.glsl": "no mirror": "= material.reflectivity * material.tint" => "= 0.0 * material.tint";
        "rtx_pipeline/shade.glsl": "light bent the wrong way": "1.0 / material.ior : material.ior" => "material.ior : 1.0 / material.ior";
        "rtx_pipeline/shade.glsl": "glass mirrors no sky": "if (facing.entering)" => "if (false)";
        "rtx_pipeline/picture.glsl": "not exposed": "expose(light)" => "light";
        "rtx_pipeline/picture.rgen.glsl": "no glass": "kMaskAll" => "kMaskSolid";
    LOOP:
        "rtx_pipeline/picture.comp.glsl": "glass is solid": "== kGlass;" => "== 77u;";
        "rtx_pipeline/picture.comp.glsl": "glass casts shadows": "frame.tlas, kMaskSolid" => "frame.tlas, kMaskAll";
        "rtx_pipeline/picture.comp.glsl": "mirrors lose nothing": "weight *= ray.weight;" => ";";
        "rtx_pipeline/picture.comp.glsl": "other triangles": "= firstTriangle + " => "= 0u * firstTriangle + ";
        "rtx_pipeline/picture.comp.glsl": "no light arrives": "return occludedByQuery(" => "return true || occludedByQuery(";

    WAVES:
        "rtx_textures/glazed.rchit.glsl": "nothing glazed": "asGlazed(" => "asPainted(";
        "rtx_textures/painted.rchit.glsl": "all glazed": "asPainted(" => "asGlazed(";
        "rtx_textures/instances.comp.glsl": "no waves": "0.3 * sin(wave)" => "0.0 * sin(wave)";
        "rtx_textures/instances.comp.glsl": "one texture": "(cell * 5u + cell / 7u) % 6u" => "0u";
        "rtx_textures/instances.comp.glsl": "one hit group": "? kGlazed : kPainted" => "? kPainted : kPainted";
        "rtx_textures/textures.rgen.glsl": "no shadows": "return payload.distance < 0.0" => "return true";
        "rtx_textures/shade.glsl": "no sky": "weight * skyRadiance(" => "0.0 * skyRadiance(";
        "rtx_textures/shade.glsl": "one view a pixel": "vec2 within = fract(0.5 +" => "vec2 within = 0.0 * fract(0.5 +";
        "rtx_textures/shade.glsl": "glaze without shine": "found.gloss *" => "0.0 * found.gloss *";
        "rtx_textures/surface.glsl": "normals not turned": "toWorld * normal" => "normal";
        "rtx_textures/surface.glsl": "textures blurred": "float lod = " => "float lod = 2.0 + ";
        "rtx_textures/surface.glsl": "dull glaze": "found.albedo *= found.albedo" => "found.albedo *= 1.0";
    WAVES_QUERY:
        "rtx_textures/textures.comp.glsl": "nothing glazed": "== kGlazed ?" => "== 77u ?";
        "rtx_textures/textures.comp.glsl": "no shadows": "return lvkRayQueryType(" => "return true || lvkRayQueryType(";
        "rtx_textures/textures.comp.glsl": "far textures sharp": "lvkRayQueryT(query, LVK_COMMITTED), travelled)" => "lvkRayQueryT(query, LVK_COMMITTED), 40.0)";

    VALLEY:
        "large_scene/nearest.rchit.glsl": "other triangles": "[gl_InstanceCustomIndexEXT] +" => "[0] +";
        "large_scene/nearest.rchit.glsl": "one instance": "uint(lvkInstanceId(frame.tlas))" => "0u";
        "large_scene/nearest.rchit.glsl": "hits elsewhere": "= barycentrics;" => "= barycentrics.yx;";
        "large_scene/nearest.rmiss.glsl": "no sky": "= kNothing;" => "= 0u;";
        "large_scene/open.rmiss.glsl": "no light arrives": "occluded = 0u" => "occluded = 1u";
        "large_scene/picture.rgen.glsl": "no shadows": "return occluded != 0u" => "return false";
        "large_scene/picture.glsl": "one place in a pixel": "= 2.0 * shift" => "= 0.0 * shift";
    /// Mistakes in a scene of large things, one of which is turned.
    STREET:
        "large_scene/picture.glsl": "normals not turned": "point.normal = turn *" => "point.normal =";
        "large_scene/picture.glsl": "places not turned": "turn * (point.position * scale)" => "(point.position * scale)";
    VALLEY_NUMBERS:
        "large_scene/picture.glsl": "one number": "? hit.instance :" => "? 0u :";
        "large_scene/picture.glsl": "one hue": "vec3(0.0, 2.1, 4.2)" => "vec3(0.0)";
        "large_scene/picture.glsl": "flat light": "0.65 * abs(" => "0.65 + 0.0 * abs(";
    VALLEY_QUERY:
        "large_scene/picture.comp.glsl": "other triangles": "hit.triangle = first +" => "hit.triangle = 0u * first +";
        "large_scene/picture.comp.glsl": "one instance": "hit.instance = " => "hit.instance = 0u * ";
        "large_scene/picture.comp.glsl": "hits elsewhere": "hit.barycentrics = " => "hit.barycentrics = 0.5 * ";
        "large_scene/picture.comp.glsl": "no light arrives": "return lvkRayQueryType(" => "return true || lvkRayQueryType(";

    HYBRID:
        "common/lighting.glsl": "no shadows": "if (!traceOccluded(" => "if (true || !traceOccluded(";
        "common/lighting.glsl": "no sun": "if (light.isDistant != 0.0) {" => "if (light.isDistant > 5.0) {";
        "common/lighting.glsl": "no lamp": "return light.color / (" => "return 0.0 * light.color / (";
        "common/lighting.glsl": "even ambient light": "0.5 + 0.5 * facing.normal.y" => "0.5";
        "hybrid/integrator.glsl": "light bent the wrong way": "facing.entering ? 1.0 / material.ior : material.ior" => "facing.entering ? material.ior : 1.0 / material.ior";
        "hybrid/integrator.glsl": "glass without mirror": "glass > 0.0 ?" => "glass > 9.0 ?";
        "hybrid/integrator.glsl": "one bounce less": "ray.depth < kMaxDepth" => "ray.depth + 1u < kMaxDepth";
        "hybrid/integrator.glsl": "no mirror": "weight * (material.reflectivity +" => "weight * (0.0 *";
        "common/phong.glsl": "no highlights": "+ specular *" => "+ 0.0 * specular *";
        "common/surface.glsl": "flat normals": "squaredLength > 1e-12 ?" => "squaredLength > 1e30 ?";
        "common/texture_lod.glsl": "blurred textures": "return lodConstant +" => "return 2.0 + lodConstant +";
        "common/tonemap.glsl": "no exposure": "1.0 - exp(-max(radiance, 0.0))" => "min(radiance, 1.0)";
        "hybrid/closest.rchit.glsl": "hits elsewhere": "= barycentrics;" => "= barycentrics.yx;";
        "hybrid/closest.rmiss.glsl": "no sky": "= kNoTriangle;" => "= 0u;\n    payload.barycentrics = vec2(0.2);";
        "hybrid/shadow.rmiss.glsl": "no light": "occluded = 0u" => "occluded = 1u";
        "hybrid/render.rgen.glsl": "no rays": MAIN => NOTHING;
        "hybrid/raster_small.comp.glsl": "no triangles": MAIN => NOTHING;
    HYBRID_LARGE:
        "hybrid/raster_tile.comp.glsl": "no tiles": MAIN => NOTHING;
        "hybrid/raster_medium.comp.glsl": "no medium triangles": "        rasterMedium(triangle, thread);" => "        ;";
        "hybrid/raster_medium.comp.glsl": "no large triangles": "        cutLarge(triangle, number, thread);" => "        ;";
    HYBRID_HARDWARE:
        "hybrid/cull.comp.glsl": "nothing survives": "bool isInside = " => "bool isInside = false && ";
        "hybrid/compact.comp.glsl": "nothing drawn": "= 3u * (before +" => "= 0u * (before +";
        "hybrid/visibility.frag.glsl": "no numbers": "outTriangle = " => "outTriangle = 0xffffffffu | ";
        "hybrid/geometry.vert.glsl": "no place": "gl_Position = " => "gl_Position = 0.0 * ";
    HYBRID_PAPER:
        "hybrid/geometry.frag.glsl": "white things": "vec4(point.albedo, 1.0)" => "vec4(1.0)";
        "hybrid/geometry.frag.glsl": "coarse normals": "point.normal)" => "point.geometricNormal)";
        "hybrid/geometry.frag.glsl": "moved things": "vec4(point.position," => "vec4(point.position + 0.05,";
    HYBRID_QUERY:
        "hybrid/render.comp.glsl": "no rays": "    uvec2 start = " => "    return;\n    uvec2 start = ";
        "hybrid/trace_query.glsl": "hits elsewhere": "lvkRayQueryBarycentrics(query, LVK_COMMITTED)" => "vec2(0.2)";
        "hybrid/trace_query.glsl": "other triangles": "hit.triangle = firstTriangle +" => "hit.triangle = 0u * firstTriangle +";
        "hybrid/trace_query.glsl": "glass casts shadows": "frame.tlas, kMaskOpaque" => "frame.tlas, kMaskAll";
    QUEUED_PIPELINE:
        "hybrid/bounces.rgen.glsl": "no bounces": MAIN => NOTHING;
    QUEUED_QUERY:
        "hybrid/bounces.comp.glsl": "no bounces": MAIN => NOTHING;
    /// One image, whatever the order of its pixels: these are asked for the very same one.
    ORDERED:
        "hybrid/order.comp.glsl": "a pixel left out": "= pixel.x | " => "= pixel.x + uint(pixel == uvec2(80u, 45u)) | ";
        // Not left unwritten: its words lead to pixels, and what memory held before may lie outside of the image.
        "hybrid/order.comp.glsl": "no order": "= pixel.x | pixel.y << 16;" => "= 0u;";
        "hybrid/pixel.glsl": "others left out": "isFirst ? before : firsts + " => "isFirst ? before : ";
    ORDERED_QUERY:
        "hybrid/render.comp.glsl": "no rays": "    uint group = " => "    return;\n    uint group = ";

    OIT:
        "hybrid_oit/list.glsl": "not sorted": "; index > 0u && isBefore(" => "; false && isBefore(";
        "hybrid_oit/list.glsl": "only the last node": "Node(next, distance" => "Node(kNoNode, distance";
        "hybrid_oit/glass.rahit.glsl": "no tint in shadows": "payload.opticalDepth += " => "uvec3 unused = ";
        "hybrid_oit/glass.rahit.glsl": "glass casts dark shadows": "ignoreIntersectionEXT;" => ";";
        "hybrid_oit/sphere.rint.glsl": "no spheres in shadows": MAIN => NOTHING;
        "hybrid_oit/shadow.rmiss.glsl": "no sunlight": "isBlocked = 0u" => "isBlocked = 1u";
        "hybrid_oit/shadow.rgen.glsl": "no shadow rays": OIT_RAYS => NO_OIT_RAYS;
        "hybrid_oit/glass.glsl": "no focus": "1.5 * focus" => "0.0 * focus";
        "hybrid_oit/glass.glsl": "no mirrored sky in glass": "1.6 * skyAlong(mirrored)" => "0.0 * mirrored";
        "hybrid_oit/occlusion.glsl": "spheres hide no sky": "1.0 - share * (" => "1.0 - 0.0 * share * (";
        "hybrid_oit/occlusion.glsl": "blocks hide no sky": "blocked += " => "blocked += 0.0 * ";
        "hybrid_oit/shadow.glsl": "hard shadows": "shadowRays == 1u ?" => "shadowRays >= 1u ?";
        "hybrid_oit/composite.comp.glsl": "no haze": "1.0 - exp(-kHaze" => "0.0 * exp(-kHaze";
        "hybrid_oit/animate.comp.glsl": "all at rest": "motion.anchor + offset" => "motion.anchor";
    OIT_RASTER:
        "hybrid_oit/solid.vert.glsl": "no solids": "gl_Position = " => "gl_Position = 0.0 * ";
        "hybrid_oit/solid.frag.glsl": "black solids": "face.albedo" => "vec3(0.0)";
        "hybrid_oit/sphere.vert.glsl": "no spheres": "gl_Position = " => "gl_Position = 0.0 * ";
        "hybrid_oit/ball.frag.glsl": "balls turned inside out": "position - sphere.center" => "sphere.center - position";
        "hybrid_oit/ball_depth.frag.glsl": "balls in front of all": "gl_FragDepth = " => "gl_FragDepth = 1.0 + 0.0 * ";
        "hybrid_oit/glass.frag.glsl": "no glass": MAIN => NOTHING;
        "hybrid_oit/glass.frag.glsl": "no backs of glass": "end == crossing.exit" => "false";
    OIT_QUERY:
        "hybrid_oit/shadow.comp.glsl": "no tint in shadows": "opticalDepth += " => "uvec3 unused = ";
        "hybrid_oit/shadow.comp.glsl": "balls cast none": "sphere.isGlass != 0u" => "true";
        "hybrid_oit/shadow.comp.glsl": "no shadow rays": OIT_RAYS => NO_OIT_RAYS;

    /// Seen from close to a dark ball, as the image of the whole room has few pixels of balls, most of them behind glass.
    VARNISH:
        "hybrid_oit/composite.comp.glsl": "no varnish": "surface.gloss * reflectance" => "0.0";
        "hybrid_oit/composite.comp.glsl": "no highlight on varnish": "30.0 * highlight" => "0.0 * highlight";

    REFLECTIONS:
        "reflections/ray_range.glsl": "mirrors short-sighted": "return kFar;" => "return 0.5;";
        "reflections/ray_range.glsl": "rough surfaces not traced": "kRoughestTraced = 0.7" => "kRoughestTraced = 0.09";
        "reflections/reflectance.glsl": "no glossy lobe": "float radius = sqrt(u.x);" => "float radius = 0.0;";
        "reflections/reflectance.glsl": "no fresnel": "(1.0 - normalIncidence) * pow(" => "0.0 * pow(";
        "reflections/reflect.glsl": "water mirrors nothing": "if (readSurface(frame.glassDepth," => "if (false && readSurface(frame.glassDepth,";
        "reflections/visibility.glsl": "all is open": "return vec4(lessThan(blockers, vec4(0.0)));" => "return vec4(lessThan(blockers.xyz, vec3(0.0)), 1.0);";
        "reflections/reflect.glsl": "reflections dark": "vec3 shaded = shadeReflected(" => "vec3 shaded = 0.5 * shadeReflected(";
        "reflections/lighting.glsl": "no light on reflected things": "surface.emission + lightDirectly(point, visibility)" => "surface.emission";
        "reflections/visibility.glsl": "no shadows": "return vec4(lessThan(blockers, vec4(0.0)));" => "return vec4(1.0);";
        "reflections/smooth.comp.glsl": "shadows sharp": "radius[channel] > 0.7" => "radius[channel] > 1e9";
        "reflections/visibility.glsl": "penumbras narrow": "penumbra[i] = max(" => "penumbra[i] = 0.01 * max(";
        "reflections/lighting.glsl": "no shadows in mirrors": "color += visibility[i] * leaving(" => "color += leaving(";
        "reflections/ambient.glsl": "no sky light": "return harmonicSum(normal," => "return 0.0 * harmonicSum(normal,";
        "reflections/waves.glsl": "water flat": "(0.022 /" => "(0.0 /";
        "reflections/skin.comp.glsl": "serpent at rest": "= dot(row, p);" => "= v.position[axis];";
        "reflections/skin.comp.glsl": "serpent's normals at rest": "= dot(row.xyz, v.normal);" => "= v.normal[axis];";
        "reflections/leaves.comp.glsl": "leaves elsewhere": "return place + " => "return place + 0.7 + ";
        "reflections/closest.rmiss.glsl": "all rays are blocked": "payload.instance = kNothing;" => "payload = Hit(0u, 0u, 0u, vec2(0.2), 1.0);";
        "reflections/opaque.rgen.glsl": "only the sky in mirrors": HALL_RAYS => NO_HALL_RAYS;
        "reflections/transparent.rgen.glsl": "only the sky in glass": HALL_RAYS => NO_HALL_RAYS;
        "reflections/closest.rchit.glsl": "hits elsewhere": "= barycentrics;" => "= barycentrics.yx;";
        "reflections/blend.frag.glsl": "no water": "outColor = " => "outColor = 0.0 * ";
        "reflections/filter.comp.glsl": "no blur": "radius > 0.75" => "radius > 1e9";
    REFLECTIONS_QUERY:
        "reflections/trace_query.glsl": "leaves are squares": "if (isSolid(instance, geometry, primitive, " => "if (true || isSolid(instance, geometry, primitive, ";
        "reflections/opaque.comp.glsl": "only the sky in mirrors": HALL_RAYS => NO_HALL_RAYS;
        "reflections/transparent.comp.glsl": "only the sky in glass": HALL_RAYS => NO_HALL_RAYS;

    REFLECTIONS_EVER:
        "reflections/ray_range.glsl": "mirrors short-sighted": "return kFar;" => "return 0.5;";
        "reflections/visibility.glsl": "no shadows": "return vec4(lessThan(blockers, vec4(0.0)));" => "return vec4(1.0);";
        "reflections/filter.comp.glsl": "no blur": "radius > 0.75" => "radius > 1e9";

    /// Seen from just above the floor, where leaves are mirrored and throw shadows.
    LEAVES:
        "reflections/surface.glsl": "leaves are squares": ".a >= 0.5;" => ".a >= -1.0;";
        "reflections/leaf.rahit.glsl": "leaves are squares to rays": "ignoreIntersectionEXT;" => ";";
}

#[test]
fn every_mistake_fits_its_file() {
    let shaders = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders");
    for mistake in ALL.iter().copied().flatten() {
        let text = std::fs::read_to_string(shaders.join(mistake.file)).unwrap();
        assert_eq!(text.matches(mistake.right).count(), 1, "{mistake:?}");
    }
}
