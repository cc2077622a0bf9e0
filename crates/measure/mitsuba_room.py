#!/usr/bin/env python3
"""Renders the room of `measure -- speed --only room` with Mitsuba 3, for its option `--peer`:

    measure -- speed --only room --peer 'python crates/measure/mitsuba_room.py "$ROOM"'

It needs the Python package `mitsuba` and a library of LLVM. One thread renders through a thin lens of 50 mm at
f/2, focused at 1.35 m, or, with `--pinhole`, with the scene's own camera. It prints the names of its samplers;
then, for each line of a name, samples per pixel and a seed that it reads, it prints processor seconds and the
relative RMSE against a reference of 2048 samples. Words in a line are separated by tabs.
"""

import math
import re
import sys
import time

import drjit as dr
import mitsuba as mi
import numpy as np

FOCAL, F_NUMBER, DISTANCE = 0.05, 2.0, 1.35
HALF_FILM = 0.012
# The height angle of a camera of Inventor that gives none.
DEFAULT_ANGLE = 0.785398
SAMPLERS = ("multijitter", "ldsampler")


def numbers(text):
    return [float(word) for word in re.findall(r"-?[\d.]+(?:e-?\d+)?", text)]


def mesh(name, points, faces, color):
    """Returns a matte mesh whose triangles are flat and lit on both sides."""
    matte = {"type": "diffuse", "reflectance": {"type": "rgb", "value": color}}
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "twosided", "bsdf": matte})
    properties["face_normals"] = True
    made = mi.Mesh(name, len(points) // 3, len(faces) // 3, props=properties)
    parameters = mi.traverse(made)
    parameters["vertex_positions"] = np.array(points, dtype=np.float32)
    parameters["faces"] = np.array(faces, dtype=np.uint32)
    parameters.update()
    return made


def scene(text, pinhole):
    camera = re.search(r"position (\S+ \S+ \S+) orientation (\S+ \S+ \S+) (\S+)", text)
    axis, degrees = numbers(camera[2]), math.degrees(float(camera[3]))
    # A camera of Inventor looks along -z, and one of Mitsuba along +z with x to the left.
    place = mi.ScalarTransform4f().translate(numbers(camera[1])).rotate(axis, degrees)
    film_distance = FOCAL * DISTANCE / (DISTANCE - FOCAL)
    film = {
        "type": "hdrfilm", "width": 360, "height": 240, "pixel_format": "rgb",
        "component_format": "float32", "rfilter": {"type": "box"},
    }
    all_parts = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
        "light": {
            "type": "point",
            "position": numbers(re.search(r"location (\S+ \S+ \S+)", text)[1]),
            "intensity": {"type": "rgb", "value": 20.0},
        },
    }
    for k, part in enumerate(text.split("Separator {")[1:]):
        color = numbers(re.search(r"diffuseColor (\S+ \S+ \S+)", part)[1])
        points = numbers(re.search(r"point \[([^]]*)\]", part)[1])
        index = re.search(r"coordIndex \[([^]]*)\]", part)[1]
        faces = [int(word) for word in re.findall(r"-?\d+", index) if word != "-1"]
        all_parts[f"part{k}"] = mesh(f"part{k}", points, faces, color)

    thin_lens = {
        "type": "thinlens", "fov": 2 * math.degrees(math.atan(HALF_FILM / film_distance)),
        "aperture_radius": FOCAL / F_NUMBER / 2, "focus_distance": DISTANCE,
    }
    perspective = {"type": "perspective", "fov": math.degrees(DEFAULT_ANGLE)}

    def with_sampler(kind):
        sensor = {
            **(perspective if pinhole else thin_lens), "fov_axis": "smaller",
            "to_world": place.rotate([0, 1, 0], 180),
            "film": film, "sampler": {"type": kind, "sample_count": 16},
        }
        return mi.load_dict({**all_parts, "sensor": sensor})

    return with_sampler


def render(of, samples, seed):
    """Returns processor seconds and the picture."""
    start = time.process_time()
    picture = np.array(mi.render(of, spp=samples, seed=seed), dtype=np.float64)
    return time.process_time() - start, picture


def relative_error(picture, reference):
    return np.sqrt(np.mean((picture - reference) ** 2)) / reference.mean()


def answer(with_sampler, camera, reference):
    """Renders what the lines of the input ask for."""
    names = {f"Mitsuba {mi.__version__} llvm, {camera}, {kind}": kind for kind in SAMPLERS}
    rooms = {name: with_sampler(kind) for name, kind in names.items()}
    print(*names, sep="\t", flush=True)
    for line in sys.stdin:
        name, samples, seed = line.rstrip("\n").split("\t")
        seconds, picture = render(rooms[name], int(samples), int(seed))
        print(f"{seconds:.6f}", f"{relative_error(picture, reference):.6f}", sep="\t", flush=True)


def main():
    mi.set_variant("llvm_ad_rgb")
    dr.set_thread_count(1)
    pinhole = "--pinhole" in sys.argv
    path = next(word for word in sys.argv[1:] if word != "--pinhole")
    with open(path, encoding="ascii") as file:
        with_sampler = scene(file.read(), pinhole)
    room = with_sampler("independent")
    reference = sum(render(room, 256, 1000 + k)[1] for k in range(8)) / 8
    answer(with_sampler, "perspective" if pinhole else "thin lens", reference)


if __name__ == "__main__":
    main()
