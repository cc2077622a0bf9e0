"""File > Import > Inventor / VRML.

A scene is read by the package `ivcam`: each of its nodes that draws becomes an object with a mesh, and
its materials, textures, cameras and lights become Blender's. Blender's z points up, Inventor's y, so
positions (x, y, z) become (x, −z, y). A meter is one unit.
"""

import math
import os

import bpy
import numpy as np
from bpy.props import BoolProperty, CollectionProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ImportHelper
from mathutils import Matrix, Quaternion

import ivcam

#: Inventor's axes in Blender's.
UPRIGHT = Matrix(((1, 0, 0), (0, 0, -1), (0, 1, 0)))
#: The radiant power in watts of a point light that lights a white wall at 1 m as intensity 1 does.
WATTS = 4 * math.pi * math.pi


def import_scene(path, collection, *, tolerance=0.005, cameras=True, lights=True):
    """Imports a file into a collection.

    Returns:
        the meshes' objects, and the problems of the file as `ivcam` states them.

    Raises:
        ivcam.IvcamError: the file cannot be read.
    """
    document = ivcam.open(path)
    mesh = document.triangles(tolerance=tolerance)
    images = [
        _image(f"{os.path.basename(path)} {i}", pixels) for i, pixels in enumerate(mesh.images)
    ]
    clear = set(mesh.material[(mesh.colors[mesh.faces, 3] < 1).any(axis=1)].tolist())
    materials = [
        _material(i, record, images, i in clear) for i, record in enumerate(mesh.materials)
    ]
    objects, problems = [], document.problems
    order = np.argsort(mesh.node, kind="stable")
    numbers, starts = np.unique(mesh.node[order], return_index=True)
    for number, faces in zip(numbers, np.split(order, starts[1:])):
        made = _object(mesh, mesh.paths[number], faces, materials)
        collection.objects.link(made)
        repeated = len(faces) - len(made.data.polygons)
        if repeated:
            text = f"{made.name}: {repeated} triangles that are there twice are left out"
            problems.append({"message": text, "line": None, "byte": None})
        objects.append(made)
    if cameras:
        for record in document.cameras:
            collection.objects.link(_camera(record, mesh.offset))
    if lights:
        for record in document.lights:
            collection.objects.link(_light(record, mesh.offset))
    return objects, problems


def _object(scene, path, faces, materials):
    """Makes an object of some triangles of a scene."""
    used, corners = np.unique(scene.faces[faces], return_inverse=True)
    corners = corners.reshape(-1)
    name = path.rsplit("/", 1)[-1] or "Shape"
    data = bpy.data.meshes.new(name)
    data.vertices.add(len(used))
    data.loops.add(len(corners))
    data.polygons.add(len(faces))
    points = scene.positions[used] @ np.array(UPRIGHT.transposed(), np.float32)
    data.vertices.foreach_set("co", points.ravel())
    data.loops.foreach_set("vertex_index", corners.astype(np.int32))
    data.polygons.foreach_set("loop_start", np.arange(0, len(corners), 3, dtype=np.int32))
    slots, slot = np.unique(scene.material[faces], return_inverse=True)
    for number in slots:
        data.materials.append(materials[number])
    data.polygons.foreach_set("material_index", slot.astype(np.int32))
    uv = data.uv_layers.new(name="UVMap")
    uv.uv.foreach_set("vector", scene.uv[used][corners].ravel())
    color = data.color_attributes.new("Color", "FLOAT_COLOR", "CORNER")
    color.data.foreach_set("color", _linear(scene.colors[used][corners]).ravel())
    data.update(calc_edges=True)
    data.validate()  # Blender's own rule: no two faces have the same vertices.
    normals = scene.normals[used] @ np.array(UPRIGHT.transposed(), np.float32)
    if np.any(normals):
        data.normals_split_custom_set_from_vertices(normals.tolist())
    made = bpy.data.objects.new(name, data)
    made["ivcam_path"] = path
    return made


def _linear(colors):
    """Returns colors that a screen shows, and their opacity, as linear ones."""
    linear = np.array(colors, np.float32)
    shown = linear[:, :3]
    linear[:, :3] = np.where(shown > 0.04045, ((shown + 0.055) / 1.055) ** 2.4, shown / 12.92)
    return linear


def _image(name, pixels):
    height, width, _ = pixels.shape
    image = bpy.data.images.new(name, width, height, alpha=True)
    image.pixels.foreach_set((pixels[::-1].astype(np.float32) / 255).ravel())
    image.pack()
    return image


def _material(number, record, images, is_clear):
    """Makes a material: its colors are those of the corners, times its texture or replaced by it. If
    it is clear, so is its opacity."""
    material = bpy.data.materials.new(f"ivcam {number}")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True  # From 5.0 on every material has nodes.
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    colors = nodes.new("ShaderNodeVertexColor")
    colors.layer_name = "Color"
    shown, opacity = colors.outputs["Color"], colors.outputs["Alpha"] if is_clear else None
    if record["image"] is not None:
        texture = nodes.new("ShaderNodeTexImage")
        texture.image = images[record["image"]]
        texture.extension = "REPEAT" if all(np.atleast_1d(record["repeat"])) else "EXTEND"
        tree, color, alpha = material.node_tree, texture.outputs["Color"], texture.outputs["Alpha"]
        shown = color if record["image_replaces_color"] else _color_product(tree, color, shown)
        kept = None if record["image_replaces_opacity"] else opacity
        opacity = alpha if kept is None else _product(tree, alpha, kept)
    if opacity is not None:
        links.new(opacity, shader.inputs["Alpha"])
    links.new(shown, shader.inputs["Emission Color" if record["unlit"] else "Base Color"])
    # Phong's exponent 128 s has about the lobe of a roughness (2 / (128 s + 2))^¼.
    shader.inputs["Roughness"].default_value = (2 / (128 * record["shininess"] + 2)) ** 0.25
    shader.inputs["Specular IOR Level"].default_value = min(1.0, max(record["specular"]))
    if record["unlit"]:
        shader.inputs["Base Color"].default_value = (0, 0, 0, 1)
        shader.inputs["Emission Strength"].default_value = 1.0
    elif any(record["emissive"]):
        (emissive,) = _linear([(*record["emissive"], 1)])
        shader.inputs["Emission Color"].default_value = emissive
        shader.inputs["Emission Strength"].default_value = 1.0
    material.use_backface_culling = not record["double_sided"]
    return material


def _color_product(tree, color, other):
    """Returns the product of two colors of a shader."""
    product = tree.nodes.new("ShaderNodeMix")
    product.data_type, product.blend_type = "RGBA", "MULTIPLY"
    product.inputs["Factor"].default_value = 1.0
    tree.links.new(color, product.inputs["A"])
    tree.links.new(other, product.inputs["B"])
    return product.outputs["Result"]


def _product(tree, number, other):
    """Returns the product of two numbers of a shader."""
    product = tree.nodes.new("ShaderNodeMath")
    product.operation = "MULTIPLY"
    tree.links.new(number, product.inputs[0])
    tree.links.new(other, product.inputs[1])
    return product.outputs["Value"]


def _place(made, position, turn, offset):
    """Places an object that looks along −z as cameras and lights do."""
    shift = [p - o for p, o in zip(position, offset)]
    made.location = UPRIGHT @ Matrix.Translation(shift).translation
    made.rotation_mode = "QUATERNION"
    made.rotation_quaternion = UPRIGHT.to_quaternion() @ turn
    return made


def _camera(record, offset):
    data = bpy.data.cameras.new(record["name"] or record["class"])
    data.sensor_fit = "VERTICAL"
    if "height_angle" in record:
        data.angle_y = record["height_angle"]
    else:
        data.type = "ORTHO"
        data.ortho_scale = record["height"]
    if 0 < record["near"] < record["far"]:
        data.clip_start, data.clip_end = record["near"], record["far"]
    data.dof.focus_distance = record["focal_distance"]
    x, y, z, w = record["orientation"]
    made = bpy.data.objects.new(data.name, data)
    return _place(made, record["position"], Quaternion((w, x, y, z)), offset)


def _light(record, offset):
    kind = "SUN" if "position" not in record else "SPOT" if "outer_angle" in record else "POINT"
    data = bpy.data.lights.new(record["name"] or record["class"], kind)
    data.color = _linear([record["color"]])[0]
    data.energy = record["intensity"] * (math.pi if kind == "SUN" else WATTS)
    if kind == "SPOT":
        data.spot_size = min(2 * record["outer_angle"], math.pi)
        inner = (
            min(record["inner_angle"] / record["outer_angle"], 1) if record["outer_angle"] else 1
        )
        data.spot_blend = 1 - inner
    turn = Quaternion()
    if "direction" in record:
        down = Matrix.Translation(record["direction"]).translation
        turn = down.to_track_quat("-Z", "Y")
    made = bpy.data.objects.new(data.name, data)
    return _place(made, record.get("position", offset), turn, offset)


def _where(problem):
    """Returns the place of a problem, which is a byte in a binary file."""
    for unit in ("line", "byte"):
        if problem[unit] is not None:
            return f"{unit} {problem[unit]}: "
    return ""


class IVCAM_OT_import(bpy.types.Operator, ImportHelper):
    """Imports an Inventor, VRML 1.0 or VRML97 scene"""

    bl_idname = "import_scene.ivcam"
    bl_label = "Import Inventor / VRML"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".iv"
    filter_glob: StringProperty(
        default="*.iv;*.wrl;*.vrml;*.iv.gz;*.wrl.gz;*.wrz", options={"HIDDEN"}
    )
    files: CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )
    directory: StringProperty(subtype="DIR_PATH")
    tolerance: FloatProperty(
        name="Tolerance",
        description="The largest distance of a triangle from a round surface, over its radius",
        default=0.005,
        min=0.0001,
        max=0.1,
        precision=4,
    )
    cameras: BoolProperty(name="Cameras", default=True)
    lights: BoolProperty(name="Lights", default=True)

    def execute(self, context):
        names = [os.path.join(self.directory, file.name) for file in self.files if file.name]
        failed = 0
        for path in names or [self.filepath]:
            collection = bpy.data.collections.new(os.path.basename(path))
            try:
                _, problems = import_scene(
                    path,
                    collection,
                    tolerance=self.tolerance,
                    cameras=self.cameras,
                    lights=self.lights,
                )
            except ivcam.IvcamError as error:
                bpy.data.collections.remove(collection)
                self.report({"ERROR"}, str(error))
                failed += 1
                continue
            context.scene.collection.children.link(collection)
            for problem in problems[:5]:
                self.report({"WARNING"}, f"{_where(problem)}{problem['message']}")
        return {"CANCELLED"} if failed == len(names or [self.filepath]) else {"FINISHED"}


def _menu(self, _context):
    self.layout.operator(IVCAM_OT_import.bl_idname, text="Inventor / VRML (.iv, .wrl)")


def register():
    bpy.utils.register_class(IVCAM_OT_import)
    bpy.types.TOPBAR_MT_file_import.append(_menu)


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(_menu)
    bpy.utils.unregister_class(IVCAM_OT_import)
