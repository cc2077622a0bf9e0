#!/usr/bin/env python3
"""Renders the room of `measure -- speed --only room` with Mitsuba 3, for its option `--peer`:

    measure -- speed --only room --peer 'python tools/mitsuba_room.py "$ROOM"'

It needs the Python package `mitsuba` and a library of LLVM. Each line of the output has a name, samples per
pixel, processor seconds and the relative RMSE against a reference of 2048 samples, separated by tabs. One
thread renders through a thin lens of 50 mm at f/2, focused at 1.35 m. The least time of three counts, of one
at 256 samples, after a picture that compiles the kernels.
"""

import math
import os
import re
import sys

import drjit as dr
import mitsuba as mi
import numpy as np

FOCAL, F_NUMBER, DISTANCE = 0.05, 2.0, 1.35
HALF_FILM = 0.012


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


def scene(text):
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

    def with_sampler(kind):
        sensor = {
            "type": "thinlens", "fov_axis": "smaller",
            "fov": 2 * math.degrees(math.atan(HALF_FILM / film_distance)),
            "aperture_radius": FOCAL / F_NUMBER / 2, "focus_distance": DISTANCE,
            "to_world": place.rotate([0, 1, 0], 180),
            "film": film, "sampler": {"type": kind, "sample_count": 16},
        }
        return mi.load_dict({**all_parts, "sensor": sensor})

    return with_sampler


def render(of, samples, seed):
    """Returns processor seconds and the picture."""
    start = sum(os.times()[:2])
    picture = np.array(mi.render(of, spp=samples, seed=seed), dtype=np.float64)
    return sum(os.times()[:2]) - start, picture


def main():
    mi.set_variant("llvm_ad_rgb")
    dr.set_thread_count(1)
    with open(sys.argv[1], encoding="ascii") as file:
        with_sampler = scene(file.read())
    room = with_sampler("independent")
    reference = sum(render(room, 256, 1000 + k)[1] for k in range(8)) / 8
    for kind in ("multijitter", "ldsampler"):
        room = with_sampler(kind)
        for samples in (4, 16, 64, 256):
            render(room, samples, 0)
            rounds = 3 if samples < 256 else 1
            made = [render(room, samples, 1 + k) for k in range(rounds)]
            error = np.sqrt(np.mean((made[0][1] - reference) ** 2)) / reference.mean()
            seconds = min(time for time, _ in made)
            name = f"Mitsuba {mi.__version__} llvm, thin lens, {kind}"
            print(name, samples, f"{seconds:.3f}", f"{error:.4f}", sep="\t", flush=True)
    if len(sys.argv) > 2:
        mi.util.write_bitmap(sys.argv[2], mi.TensorXf(reference.astype(np.float32)))


if __name__ == "__main__":
    main()
