"""Mitsuba 3 and Cycles for `path_speed.py`, each a process of its own that renders one scene.

    python path_peers.py NAME SCENE.glb SCENE.json CAMERA

NAME is a variant of Mitsuba or `cycles`, and CAMERA is `pinhole`, `lens` or a file with a camera in
OSL (Cycles). It prints a line when it is ready. Then, for each line of samples per pixel, a seed
and a file, it renders on one thread, writes linear radiance there (.npy, rows from the top) and
prints the processor seconds.
"""

import json
import math
import os
import sys
import tempfile
import time

import numpy as np

import path_scenes

FOCAL, F_NUMBER = 0.05, 2.02
FILM = 0.036, 0.024


def film_distance(focus):
    return FOCAL * focus / (focus - FOCAL)


def is_closed(part):
    """Whether each edge is that of two triangles, in both directions."""
    _, place = np.unique(np.round(part.points, 7), axis=0, return_inverse=True)
    faces = place.reshape(-1)[part.faces]
    edges = {tuple(edge) for pair in ((0, 1), (1, 2), (2, 0)) for edge in faces[:, pair]}
    return all((b, a) in edges for a, b in edges)


def one_sided(part, middle):
    """The part such that its fronts are all sides that shine. Mitsuba's emitters shine to the front
    only.

    A closed part has its fronts outside, a flat one has them toward the scene's middle. Any other
    surface becomes two, 10 µm from where it was.
    """
    corners = part.points[part.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    if is_closed(part):
        outward = np.sum(corners[:, 0] * normals) > 0
        return part.points, part.faces if outward else part.faces[:, ::-1]
    units = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    if np.all(np.abs(units @ units[0]) > 0.9999):
        front = np.sum((middle - corners[:, 0]) * normals, axis=1) > 0
        return part.points, np.where(front[:, None], part.faces, part.faces[:, ::-1])
    sides = [corners + 1e-5 * units[:, None], (corners - 1e-5 * units[:, None])[:, ::-1]]
    points = np.concatenate(sides).reshape(-1, 3)
    return points, np.arange(len(points)).reshape(-1, 3)


def mitsuba_mesh(mi, name, part, middle):
    surface = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(part.color)}}}
    properties = mi.Properties()
    properties["face_normals"] = True
    properties["bsdf"] = mi.load_dict(surface)
    points, faces = part.points, part.faces
    if max(part.emission) > 0:
        properties["emitter"] = mi.load_dict({"type": "area", "radiance": {"type": "rgb", "value": list(part.emission)}})
        points, faces = one_sided(part, middle)
    made = mi.Mesh(name, len(points), len(faces), props=properties)
    parameters = mi.traverse(made)
    parameters["vertex_positions"] = points.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    return made


def mitsuba_lights(mi, lights):
    made = {}
    for k, light in enumerate(lights):
        # Inventor's matte surface shows its color times the intensity, without the factor 1/pi.
        level = math.pi * light["intensity"] * path_scenes.decoded(light["color"])
        angle = math.degrees(light["cutOffAngle"])
        at, along = np.array(light["location"]), np.array(light["direction"])
        up = [1, 0, 0] if abs(along[1]) > 0.9 else [0, 1, 0]
        made[f"light{k}"] = {
            "type": "spot", "intensity": {"type": "rgb", "value": level.tolist()},
            "cutoff_angle": angle, "beam_width": 0.9999 * angle,
            "to_world": mi.ScalarTransform4f().look_at(origin=at.tolist(), target=(at + along).tolist(), up=up)}
    return made


def mitsuba(variant, glb, about, camera):
    import drjit as dr
    import mitsuba as mi
    mi.set_variant(variant)
    dr.set_thread_count(1)
    parts = path_scenes.read_glb(glb)
    middle = np.mean(np.concatenate([part.points for part in parts]), axis=0)
    view = about["camera"]
    if camera == "pinhole":
        sensor = {"type": "perspective", "fov": math.degrees(view["height_angle"])}
    else:
        angle = 2 * math.degrees(math.atan(FILM[1] / 2 / film_distance(view["focus"])))
        sensor = {"type": "thinlens", "fov": angle, "aperture_radius": FOCAL / F_NUMBER / 2, "focus_distance": view["focus"]}
    # A camera of Inventor looks along -z, and one of Mitsuba along +z with x to the left.
    place = mi.ScalarTransform4f().translate(view["position"]).rotate(view["axis"], math.degrees(view["angle"]))
    width, height = about["size"]
    scene = mi.load_dict({
        "type": "scene", "integrator": {"type": "path", "max_depth": about["depth"] + 1},
        "sensor": {
            **sensor, "fov_axis": "y", "near_clip": 0.01, "to_world": place.rotate([0, 1, 0], 180),
            "film": {"type": "hdrfilm", "width": width, "height": height, "pixel_format": "rgb",
                     "component_format": "float32", "rfilter": {"type": "box"}},
            "sampler": {"type": about["sampler"], "sample_count": 16}},
        **mitsuba_lights(mi, about["lights"]),
        **{f"part{k}": mitsuba_mesh(mi, f"part{k}", part, middle) for k, part in enumerate(parts)}})

    compiled = set()

    def render(samples, seed):
        # The kernels of LLVM are compiled once for each number of samples.
        if "llvm" in variant and samples not in compiled:
            compiled.add(samples)
            render(samples, seed)
        start = time.process_time()
        picture = np.array(mi.render(scene, spp=samples, seed=seed))
        return time.process_time() - start, picture

    return render


def cycles_materials(bpy):
    """Replaces what the importer made of the materials by matte and luminous ones of the same colors."""
    for material in bpy.data.materials:
        tree = material.node_tree
        found = next((node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"), None)
        if found is None:
            continue
        color = tuple(found.inputs["Base Color"].default_value)
        strength = found.inputs["Emission Strength"].default_value
        emission = [strength * value for value in tuple(found.inputs["Emission Color"].default_value)[:3]]
        tree.nodes.clear()
        surface = tree.nodes.new("ShaderNodeBsdfDiffuse")
        surface.inputs["Color"].default_value = color
        if max(emission) > 0:
            glow, matte, surface = tree.nodes.new("ShaderNodeEmission"), surface, tree.nodes.new("ShaderNodeAddShader")
            glow.inputs["Color"].default_value = (*emission, 1)
            tree.links.new(matte.outputs[0], surface.inputs[0])
            tree.links.new(glow.outputs[0], surface.inputs[1])
        tree.links.new(surface.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs[0])


def cycles_lights(bpy, lights):
    import mathutils
    for light in lights:
        made = bpy.data.lights.new("light", "SPOT")
        made.color = path_scenes.decoded(light["color"]).tolist()
        # A lamp of P watts has the radiant intensity P/4π, and Inventor's light that of π times its own.
        made.energy = 4 * math.pi * math.pi * light["intensity"]
        made.spot_size, made.spot_blend, made.shadow_soft_size = 2 * light["cutOffAngle"], 0, 0
        placed = bpy.data.objects.new("light", made)
        (x, y, z), (i, j, k) = light["location"], light["direction"]
        placed.location = (x, -z, y)
        placed.rotation_mode = "QUATERNION"
        placed.rotation_quaternion = mathutils.Vector((i, -k, j)).to_track_quat("-Z", "Y")
        bpy.context.scene.collection.objects.link(placed)


def cycles_camera(bpy, camera, view):
    data = bpy.context.scene.camera.data
    if camera == "pinhole":
        data.dof.use_dof = False
    elif camera == "lens":
        distance = film_distance(view["focus"])
        data.sensor_fit, data.sensor_width, data.lens = "HORIZONTAL", 1000 * FILM[0], 1000 * distance
        data.dof.use_dof, data.dof.focus_distance = True, view["focus"]
        data.dof.aperture_fstop = distance / (FOCAL / F_NUMBER)
    else:
        import importlib
        compiler = importlib.import_module("cycles.osl")
        bpy.context.scene.cycles.shading_system = True
        text = bpy.data.texts.new("lens")
        with open(camera, encoding="utf-8") as file:
            text.write(file.read())
        data.type, data.custom_mode, data.custom_shader = "CUSTOM", "INTERNAL", text
        made = compiler.update_internal_script(lambda *said: print(*said, file=sys.stderr), text)
        if not made[0]:
            sys.exit(f"Cycles cannot compile {camera}")
        # The package has no `oslquery`, which would take the code over.
        data.custom_bytecode, data.custom_bytecode_hash = made[2], made[3]


def cycles_settings(scene, about):
    scene.render.engine = "CYCLES"
    cycles, render = scene.cycles, scene.render
    cycles.device, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", False, False
    cycles.pixel_filter_type, cycles.light_sampling_threshold = "BOX", 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    # The bounces after the first surface.
    cycles.max_bounces = cycles.diffuse_bounces = about["depth"] - 1
    render.resolution_x, render.resolution_y = about["size"]
    render.resolution_percentage, render.threads_mode, render.threads = 100, "FIXED", 1
    render.use_persistent_data = True
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.view_settings.view_transform = "Raw"


def cycles(glb, about, camera):
    import bpy
    import mitsuba as mi
    mi.set_variant("scalar_rgb")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=glb, import_shading="FLAT")
    scene = bpy.context.scene
    scene.camera = next(made for made in scene.objects if made.type == "CAMERA")
    for made in [made for made in scene.objects if made.type == "LIGHT"]:
        bpy.data.objects.remove(made)
    cycles_settings(scene, about)
    cycles_materials(bpy)
    cycles_lights(bpy, about["lights"])
    cycles_camera(bpy, camera, about["camera"])
    output = os.path.join(tempfile.mkdtemp(), "picture.exr")

    def render(samples, seed):
        scene.cycles.samples, scene.cycles.seed = samples, seed
        scene.render.filepath = output
        start = time.process_time()
        bpy.ops.render.render(write_still=True)
        seconds = time.process_time() - start
        return seconds, np.array(mi.Bitmap(output))[..., :3]

    return render


def main():
    name, glb, about, camera = sys.argv[1:5]
    with open(about, encoding="utf-8") as file:
        about = json.load(file)
    answers = os.fdopen(os.dup(1), "w")
    # What the programs themselves print goes elsewhere.
    os.dup2(2, 1)
    render = cycles(glb, about, camera) if name == "cycles" else mitsuba(name, glb, about, camera)
    render(1, 0)
    print("ready", file=answers, flush=True)
    for line in sys.stdin:
        samples, seed, output = line.rstrip("\n").split("\t")
        seconds, picture = render(int(samples), int(seed))
        np.save(output, picture.astype(np.float32))
        print(f"{seconds:.6f}", file=answers, flush=True)


if __name__ == "__main__":
    main()
