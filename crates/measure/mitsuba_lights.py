#!/usr/bin/env python3
"""Renders the scene of `measure -- speed --only lights` with Mitsuba 3, for its option `--peer`:

    measure -- speed --only lights --peer 'python crates/measure/mitsuba_lights.py "$ROOM"'

It needs the Python package `mitsuba` and a library of LLVM. Each line of the output has a name, samples per
pixel, processor seconds and the relative RMSE against a reference of 4096 samples, separated by tabs. One
thread; the light of each sample is chosen by Mitsuba. The least time of three pictures, after one that
compiles the kernels.
"""

import math
import re
import sys

import drjit as dr
import mitsuba as mi
import numpy as np
from mitsuba_room import render


def scene(text):
    place = mi.ScalarTransform4f()
    matte = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.8}}
    camera = place.translate([0, 3, 9]).rotate([1, 0, 0], math.degrees(-0.32175))
    parts = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
        "sphere": {"type": "sphere", "radius": 1.0, "bsdf": matte},
        "floor": {
            "type": "cube", "bsdf": matte,
            "to_world": place.translate([0, -1, 0]).scale([4.5, 0.05, 4.5]),
        },
        # A camera of Inventor looks along -z, and one of Mitsuba along +z with x to the left.
        "sensor": {
            "type": "perspective", "fov_axis": "y", "fov": math.degrees(0.7),
            "to_world": camera.rotate([0, 1, 0], 180),
            "film": {
                "type": "hdrfilm", "width": 360, "height": 240, "pixel_format": "rgb",
                "component_format": "float32", "rfilter": {"type": "box"},
            },
            "sampler": {"type": "multijitter", "sample_count": 16},
        },
    }
    for k, found in enumerate(re.findall(r"location (\S+) (\S+) (\S+)", text)):
        # Inventor's diffuse reflection has no factor 1/pi.
        intensity = {"type": "rgb", "value": 0.02 * math.pi}
        position = [float(word) for word in found]
        parts[f"light{k}"] = {"type": "point", "position": position, "intensity": intensity}
    return mi.load_dict(parts)


def main():
    mi.set_variant("llvm_ad_rgb")
    dr.set_thread_count(1)
    with open(sys.argv[1], encoding="ascii") as file:
        lights = scene(file.read())
    reference = sum(render(lights, 1024, 1000 + k)[1] for k in range(4)) / 4
    for samples in (16, 64, 256, 1024):
        render(lights, samples, 0)
        made = [render(lights, samples, 1 + k) for k in range(3)]
        error = np.sqrt(np.mean((made[0][1] - reference) ** 2)) / reference.mean()
        name = f"Mitsuba {mi.__version__} llvm, direct"
        seconds = min(time for time, _ in made)
        print(name, samples, f"{seconds:.3f}", f"{error:.4f}", sep="\t", flush=True)
    if len(sys.argv) > 2:
        mi.util.write_bitmap(sys.argv[2], mi.TensorXf(reference.astype(np.float32)))


if __name__ == "__main__":
    main()
