"""Imports scenes into Blender without a window, counts their triangles, and renders one through a lens.

    python blender/check.py FOLDER [--count 20] [--picture out.png --scene FILE [--lens NAME]]

FOLDER is searched for scene files; `--count` of them that draw something, spread over the list, are
imported. Blender's triangles, materials and textures have to be as many as ivcam's. Needs `bpy` and
the package `ivcam`.
"""

import argparse
import importlib.util
import pathlib
import sys
import warnings

import bpy
import numpy as np

import ivcam

# The module `bpy` has Cycles' reader of shaders in Blender's own folder, where Python does not look.
_PYTHON = pathlib.Path(bpy.utils.resource_path("LOCAL")) / "python" / "lib"
sys.path.extend(map(str, _PYTHON.glob("python3*/site-packages")))

HERE = pathlib.Path(__file__).resolve().parent
ENDINGS = (".iv", ".wrl", ".vrml", ".iv.gz", ".wrl.gz")


def extension():
    """Returns the extension, registered as Blender registers it."""
    spec = importlib.util.spec_from_file_location(
        "ivcam_extension", HERE / "__init__.py", submodule_search_locations=[str(HERE)]
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    module.register()
    return module


def compare(path):
    """Imports a file, and returns ivcam's and Blender's triangles, materials and textures."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if bpy.ops.import_scene.ivcam(filepath=str(path)) != {"FINISHED"}:
        raise SystemExit(f"{path} is not imported")
    mesh = ivcam.open(path).triangles()
    objects = [one for one in bpy.data.objects if one.type == "MESH"]
    bpy.context.view_layer.update()
    triangles = sum(len(one.data.polygons) for one in objects)
    assert all(len(face.vertices) == 3 for one in objects for face in one.data.polygons)
    theirs = (triangles, len(bpy.data.materials), len(bpy.data.images))
    faces = np.unique(np.sort(mesh.faces, axis=1), axis=0)  # Blender has each face once.
    return (len(faces), len(mesh.materials), len(mesh.images)), theirs


def chosen(folder, count):
    """Returns files that draw triangles, spread over the sorted list of the folder."""
    files = [path for path in sorted(folder.rglob("*")) if path.name.endswith(ENDINGS)]
    drawing = []
    for path in files:
        try:
            if len(ivcam.open(path).triangles().faces):
                drawing.append(path)
        except ivcam.IvcamError:
            pass
    step = max(1, len(drawing) // count)
    return drawing[::step][:count]


def picture(extension, scene, lens, output):
    """Renders a scene through a lens with Cycles, from the first camera of the file, and returns
    where the picture lies on ivcam's own through the same lens."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.ivcam(filepath=str(scene))
    cameras = [one for one in bpy.data.objects if one.type == "CAMERA"]
    if not cameras:
        raise SystemExit(f"{scene} has no camera")
    blender = bpy.context.scene
    blender.camera = cameras[0]
    blender.render.resolution_x = 240
    focus = ivcam.open(scene).cameras[0]["focal_distance"]
    extension.lens_camera.use_lens(cameras[0].data, blender, name=lens, efl=50, focus=focus)
    blender.cycles.device, blender.cycles.samples = "CPU", 32
    blender.view_settings.view_transform = "Standard"
    blender.render.filepath = str(output)
    bpy.ops.render.render(write_still=True)
    size = (blender.render.resolution_x, blender.render.resolution_y)
    own = ivcam.render(scene, lens=lens, efl=50, focus=focus, size=size, samples=32)
    return ivcam.compare(own, output, registration="align")["alignment"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--picture", type=pathlib.Path)
    parser.add_argument("--scene", type=pathlib.Path)
    parser.add_argument("--lens", default="double-gauss")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    added = extension()
    print("| scene | triangles | materials | textures |\n|---|---|---|---|")
    wrong = 0
    for path in chosen(given.folder, given.count):
        ours, theirs = compare(path)
        wrong += ours != theirs
        cells = [f"{a} = {b}" if a == b else f"{a}, Blender {b}" for a, b in zip(ours, theirs)]
        print(f"| {path.relative_to(given.folder)} | " + " | ".join(cells) + " |", flush=True)
    print(f"{wrong} scenes differ")
    if given.picture and given.scene:
        place = picture(added, given.scene, given.lens, given.picture.resolve())
        print(
            f"{given.lens}: shift {place['shift'][0]:.2f} {place['shift'][1]:.2f} pixels "
            f"(± {place['shift_error']:.2f}), scale {place['scale']:.4f} (± {place['scale_error']:.4f}), "
            f"rotation {place['rotation']:.2f} degrees (± {place['rotation_error']:.2f})"
        )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
