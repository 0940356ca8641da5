"""Renders a scene by Cycles, the path tracer of Blender: blender --background --python cycles.py -- SCENE OUT SAMPLES SEED...

SCENE is a file of JSON that `cycles_description.rs` writes; y points up in it, as in glTF. For each seed a picture is written to
OUT.SEED: red, green, blue and alpha of each pixel, 32-bit floats in the byte order of the machine, rows from the top, radiance.
"""

import array
import json
import math
import sys

import bpy
from mathutils import Matrix, Vector


# Cycles finds no attribute of the name "color".
COLORS = "paint"


class Graph:
    """Nodes of a shader, added from the inputs to the output."""

    def __init__(self, owner):
        owner.use_nodes = True
        self.tree = owner.node_tree
        self.tree.nodes.clear()

    def add(self, kind, inputs=None, **settings):
        """Adds a node; an input, by its number or its name, is a socket of another node or a value."""
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for key, value in (inputs or {}).items():
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[key])
            else:
                node.inputs[key].default_value = value
        return node

    def math(self, operation, a, b=0.0, **settings):
        return self.add("ShaderNodeMath", {0: a, 1: b}, operation=operation, **settings).outputs[0]

    def mix_color(self, share, first, second):
        return self.add("ShaderNodeMixRGB", {0: share, 1: first, 2: second}).outputs[0]

    def mix_shader(self, share, first, second):
        return self.add("ShaderNodeMixShader", {0: share, 1: first, 2: second}).outputs[0]

    def schlick_weight(self):
        """The fifth power of 1 minus the cosine between the view and the normal."""
        seen = self.add("ShaderNodeNewGeometry").outputs
        dot = self.add("ShaderNodeVectorMath", {0: seen["Incoming"], 1: seen["Normal"]}, operation="DOT_PRODUCT")
        rest = self.math("SUBTRACT", 1.0, dot.outputs["Value"], use_clamp=True)
        return self.math("POWER", rest, 5.0)

    def mirror(self, color):
        return self.add("ShaderNodeBsdfGlossy", {"Color": color}, distribution="SHARP").outputs[0]

    def dielectric_share(self, f0):
        """The share of light that a smooth dielectric reflects by Schlick's formula."""
        return self.math("ADD", self.math("MULTIPLY", self.schlick_weight(), 1.0 - f0), f0)


def opaque(color):
    return [*color, 1.0]


def srgb_to_linear(byte):
    share = byte / 255.0
    return share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4


def texture_image(texture):
    """A picture of floats, so that no colour management changes it; Blender's rows begin at the bottom."""
    width, height = texture["size"]
    image = bpy.data.images.new("texture", width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    rows = [texture["texels"][row * width:(row + 1) * width] for row in range(height)]
    linear = [[srgb_to_linear(byte) for byte in texel] + [1.0] for row in reversed(rows) for texel in row]
    image.pixels.foreach_set(array.array("f", [value for texel in linear for value in texel]))
    image.update()
    return image


def base_color(graph, material):
    """The colour: a factor, times a texture or the colours of vertices where there are any."""
    factor = opaque(material["color"])
    if material["texture"]:
        image = texture_image(material["texture"])
        shown = graph.add("ShaderNodeTexImage", image=image, interpolation="Closest", extension="REPEAT").outputs["Color"]
    elif material["vertex_colors"]:
        shown = graph.add("ShaderNodeAttribute", attribute_name=COLORS).outputs["Color"]
    else:
        return factor
    return graph.add("ShaderNodeMixRGB", {0: 1.0, 1: factor, 2: shown}, blend_type="MULTIPLY").outputs[0]


def surface_shader(graph, material):
    color, kind = base_color(graph, material), material["kind"]
    if kind == "matte":
        return graph.add("ShaderNodeBsdfDiffuse", {"Color": color, "Roughness": 0.0}).outputs[0]
    if kind == "plastic":
        matte = graph.add("ShaderNodeBsdfDiffuse", {"Color": color, "Roughness": 0.0}).outputs[0]
        return graph.mix_shader(graph.dielectric_share(material["f0"]), matte, graph.mirror(opaque([1.0] * 3)))
    if kind == "mirror":
        return graph.mirror(graph.mix_color(graph.schlick_weight(), color, opaque([1.0] * 3)))
    if kind == "white metal":
        glossy = {"Color": color, "Roughness": material["roughness"]}
        return graph.add("ShaderNodeBsdfGlossy", glossy, distribution="MULTI_GGX").outputs[0]
    if kind == "pane":
        through = graph.add("ShaderNodeBsdfTransparent", {"Color": color}).outputs[0]
        return graph.mix_shader(graph.dielectric_share(material["f0"]), through, graph.mirror(opaque([1.0] * 3)))
    if kind == "glass":
        return graph.add("ShaderNodeBsdfGlass", {"Color": color, "IOR": material["ior"]}, distribution="SHARP").outputs[0]
    if kind == "emitter":
        return graph.add("ShaderNodeEmission", {"Color": opaque(material["emission"]), "Strength": 1.0}).outputs[0]
    raise ValueError(f"no material of the kind {kind}")


def add_absorption(graph, output, extinction):
    """Cycles takes light by a density times 1 minus a colour."""
    density = max(extinction)
    if density > 0.0:
        left = opaque([1.0 - value / density for value in extinction])
        volume = graph.add("ShaderNodeVolumeAbsorption", {"Color": left, "Density": density}).outputs[0]
        graph.tree.links.new(volume, output.inputs["Volume"])


def make_material(material):
    made = bpy.data.materials.new(material["kind"])
    graph = Graph(made)
    output = graph.add("ShaderNodeOutputMaterial", {"Surface": surface_shader(graph, material)})
    add_absorption(graph, output, material["extinction"])
    return made


def add_object(name, data, matrix=Matrix.Identity(4)):
    made = bpy.data.objects.new(name, data)
    made.matrix_world = matrix
    bpy.context.scene.collection.objects.link(made)


def add_surface(surface):
    """Adds a mesh of triangles that share no vertices, so that each is flat."""
    mesh = bpy.data.meshes.new("surface")
    positions = surface["positions"]
    mesh.from_pydata(positions, [], [range(first, first + 3) for first in range(0, len(positions), 3)])
    places = mesh.uv_layers.new(name="places")
    for loop in mesh.loops:
        u, v = surface["tex_coords"][loop.vertex_index]
        places.data[loop.index].uv = (u, 1.0 - v)
    if surface["material"]["vertex_colors"]:
        colors = mesh.color_attributes.new(COLORS, "FLOAT_COLOR", "POINT")
        colors.data.foreach_set("color", [value for color in surface["colors"] for value in color])
    mesh.materials.append(make_material(surface["material"]))
    add_object("surface", mesh)


def basis(x, y, z, place):
    matrix = Matrix((x, y, z)).transposed().to_4x4()
    matrix.translation = place
    return matrix


def light_of(kind, strength):
    """A light; its strength is split into energy and colour, as Blender has it."""
    light = bpy.data.lights.new(kind, kind)
    light.energy = max(strength)
    light.color = [value / light.energy for value in strength]
    return light


def add_lights(scene):
    for lamp in scene["lamps"]:
        # Blender asks for the power that goes to all sides, glTF for the intensity in one direction.
        light = light_of("POINT", [4.0 * math.pi * value for value in lamp["intensity"]])
        light.shadow_soft_size = 0.0
        add_object("lamp", light, Matrix.Translation(lamp["place"]))
    for sun in scene["suns"]:
        light = light_of("SUN", sun["irradiance"])
        light.angle = 2.0 * sun["radius"]
        # A light shines along its negative z.
        add_object("sun", light, Vector(sun["direction"]).to_track_quat("Z", "Y").to_matrix().to_4x4())


def set_sky(sky):
    """A map of two rows: between the middles of the rows, at 45 degrees above and below the horizon, radiance is interpolated."""
    world = bpy.data.worlds.new("sky")
    graph = Graph(world)
    direction = graph.add("ShaderNodeTexCoord").outputs["Generated"]
    y = graph.add("ShaderNodeSeparateXYZ", {0: direction}).outputs[1]
    down = graph.math("DIVIDE", graph.math("ARCCOSINE", y), 0.5 * math.pi)
    share = graph.math("SUBTRACT", down, 0.5, use_clamp=True)
    light = graph.mix_color(share, opaque(sky["upper"]), opaque(sky["lower"]))
    background = graph.add("ShaderNodeBackground", {"Color": light, "Strength": 1.0})
    graph.add("ShaderNodeOutputWorld", {"Surface": background.outputs[0]})
    bpy.context.scene.world = world


def set_camera(view):
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.angle_y = view["vertical_fov"]
    camera.clip_start, camera.clip_end = 1e-3, 1e4
    right, up, forward = (Vector(axis) for axis in view["axes"])
    add_object("camera", camera, basis(right, up, -forward, Vector(view["eye"])))
    scene = bpy.context.scene
    scene.camera = bpy.data.objects["camera"]
    scene.render.resolution_x, scene.render.resolution_y = view["size"]
    scene.render.resolution_percentage = 100


def configure(samples, bounces):
    """Nothing that changes the expected radiance of a pixel: no clamps, no blur of caustics, no denoiser, a pixel as its filter."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.use_compositing = scene.render.use_sequencer = False
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = samples
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = cycles.blur_glossy = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    for limit in ("max", "diffuse", "glossy", "transmission", "transparent_max", "volume"):
        setattr(cycles, f"{limit}_bounces", bounces)
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"
    settings.exr_codec = "ZIP"


def render(seed, out):
    scene = bpy.context.scene
    scene.cycles.seed = seed
    scene.render.filepath = f"{out}.{seed}.exr"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    width, height = image.size
    pixels = array.array("f", [0.0]) * (width * height * 4)
    image.pixels.foreach_get(pixels)
    with open(f"{out}.{seed}", "wb") as file:
        for row in reversed(range(height)):
            pixels[row * width * 4:(row + 1) * width * 4].tofile(file)


def main(scene_file, out, samples, *seeds):
    with open(scene_file, encoding="utf-8") as file:
        scene = json.load(file)
    for made in list(bpy.data.objects):
        bpy.data.objects.remove(made)
    for surface in scene["surfaces"]:
        add_surface(surface)
    add_lights(scene)
    set_sky(scene["sky"])
    set_camera(scene["view"])
    configure(int(samples), scene["bounces"])
    print("version", bpy.app.version_string)
    for seed in seeds:
        render(int(seed), out)


main(*sys.argv[sys.argv.index("--") + 1:])
