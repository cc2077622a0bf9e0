#!/usr/bin/env python3
"""Compares lenses that do not come with ivcam with other programs, and prints a table.

    python crates/measure/fresh_lenses.py IVCAM FILE... > table.md

The files are those of other programs and must have spheres alone. The reference is that of
`optics_reference.py`, with spots and relative illumination by rays of optiland; beside it stands what
`ivcam lens FILE --json --curves` says. Both have the prescription as ivcam reads it, with the indices
of the d line, at f/8 with the film at the paraxial focus.
"""

import json
import math
import os
import subprocess
import sys
import tempfile

from optics_reference import F_NUMBER, NM, prescription, reference

FREQUENCIES = "10,20,40"


def without_color(program, name, folder):
    """The lens as a file of ivcam, with one index for each medium."""
    surfaces = []
    for s in prescription(program, name):
        if s.get("mirror"):
            raise ValueError("it has mirrors")
        row = {"kind": "stop" if s["stop"] and not s["radius"] else "sphere", "R": s["radius"]}
        row |= {"t": s["thickness"], "n_d": s["n_d"], "stop": s["stop"]}
        if s["semi_diameter"] and math.isfinite(s["semi_diameter"]):
            row["semi_diameter"] = s["semi_diameter"]
        surfaces.append(row)
    path = os.path.join(folder, "lens.json")
    with open(path, "w") as file:
        json.dump({"schema": "ivlens-1", "name": "lens", "surfaces": surfaces}, file)
    return path


def ivcam(program, path, height):
    options = ["--aperture", str(F_NUMBER), "--focus", "inf", "--fields", f"0,{height!r}"]
    options += ["--film", repr(4 * height), "--frequencies", FREQUENCIES, "--wavelength", str(NM)]
    run = subprocess.run([program, "lens", path, *options, "--json", "--curves"], capture_output=True, text=True)
    if run.returncode:
        raise ValueError(run.stderr.splitlines()[0])
    return json.loads(run.stdout)


def differences(known, found):
    """The largest differences: ray fans, Seidel coefficients, spots, modulation by rays, Strehl ratio and
    illumination."""
    fans = spots = modulation = strehl = light = 0.0
    aberrations, curves = found["aberrations"], found["curves"]
    for point, ours, sheet in zip(known["points"], aberrations["points"], curves["points"]):
        fan = next(f for f in ours["fans"] if abs(f["wavelength_nm"] - NM) < 1e-3)
        for axis in ("tangential", "sagittal"):
            rays = {round(ray["pupil"], 6): ray for ray in fan[axis]}
            for pupil, x, y, _ in point[axis]:
                ray = rays[round(pupil, 6)]
                fans = max(fans, abs(ray["x"] - x), abs(ray["y"] - y))
            pairs = zip(sheet["geometric"][axis], point["by_rays"][axis])
            modulation = max([modulation, *(abs(a - b) for a, b in pairs)])
        spots = max(spots, abs(sheet["rms"] / point["rms"] - 1.0))
        strehl = max(strehl, abs(ours["strehl"] - point["strehl"]))
        field = min(curves["fields"], key=lambda f: abs(f["height"] - point["height"]))
        assert abs(field["height"] - point["height"]) < 1e-9
        relative = point["light"] / known["points"][0]["light"]
        light = max(light, abs(field["relative_illumination"] - relative))
    seidel = 0.0
    rows, ours = known["seidel"]["surfaces"], aberrations["seidel"]["surfaces"]
    for k in range(5):
        largest = max(abs(row[k]) for row in rows)
        off = max(abs(own[f"s{k + 1}"] - row[k]) for own, row in zip(ours, rows))
        seidel = max(seidel, off / largest)
    return fans, seidel, spots, modulation, strehl, light


def main():
    program, *names = sys.argv[1:]
    print("| lens | f mm | ray fan mm | Seidel | spot | modulation | Strehl | illumination |\n|---|---|---|---|---|---|---|---|")
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            try:
                path = without_color(program, name, folder)
                known = reference(program, path, more=True)
                found = ivcam(program, path, known["points"][1]["height"])
                fans, seidel, spots, modulation, strehl, light = differences(known, found)
            except Exception as error:
                print(f"{name}: {error!r}", file=sys.stderr, flush=True)
                continue
        label = os.path.basename(name).rsplit(".", 1)[0]
        figures = f"{fans:.1e} | {seidel:.1e} | {spots:.1e} | {modulation:.4f} | {strehl:.4f} | {light:.1e}"
        print(f"| {label} | {found['efl']:.2f} | {figures} |", flush=True)


main()
