#!/usr/bin/env python3
"""Improves a lens with scipy, which asks `ivcam lens --batch` for the figures of merit.

    python examples/optimize_lens.py [LENS] [IVCAM]

The radii and the air gaps vary, the focal length is held. Every Jacobian is one call of the program:
one line for each variable.
"""

import json
import subprocess
import sys

import numpy as np
from scipy.optimize import least_squares

LENS = sys.argv[1] if len(sys.argv) > 1 else "tessar"
IVCAM = sys.argv[2] if len(sys.argv) > 2 else "ivcam"


def run(*words, text=None):
    done = subprocess.run([IVCAM, "lens", LENS, *words], input=text, capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    return done.stdout


lens = json.loads(run("--json"))
surfaces = lens["surfaces"]
names, start = [], []
for i, surface in enumerate(surfaces[:-1]):
    if surface["radius"]:
        names.append(("c", i))
        start.append(1.0 / surface["radius"])
    if surface["n_d"] == 1.0:
        names.append(("t", i))
        start.append(surface["thickness"])
start = np.array(start)
# A step of a curvature changes the lens about as much as one of a gap.
scale = np.array([1e-3 / lens["efl"] if name == "c" else 1e-2 * lens["efl"] for name, _ in names])


def figures(places):
    """The answers to a list of lenses, each a vector of variables."""
    lines = []
    for x in places:
        line = {"c": {}, "t": {}}
        for (name, i), value in zip(names, x):
            line[name][str(i)] = float(value)
        lines.append(json.dumps(line))
    text = run("--batch", "-", text="\n".join(lines))
    return [json.loads(line) for line in text.splitlines()]


def residuals(answer):
    """The spots in micrometers, and the focal length's error in tenths of a percent."""
    if "error" in answer or None in answer["points"]:
        return np.full(4, 1e3)
    spots = [1e3 * point["rms"] for point in answer["points"]]
    return np.array([*spots, 1e3 * (answer["efl"] / lens["efl"] - 1.0)])


def at(u):
    return residuals(figures([start + scale * u])[0])


def jacobian(u):
    step = 1e-2
    moved = [start + scale * (u + step * row) for row in np.eye(len(u))]
    base, *others = [residuals(answer) for answer in figures([start + scale * u, *moved])]
    return np.array([(other - base) / step for other in others]).T


before = at(np.zeros(len(start)))
found = least_squares(at, np.zeros(len(start)), jac=jacobian, max_nfev=30)
print("spots in µm before:", np.round(before[:-1], 2), "after:", np.round(found.fun[:-1], 2))
print(json.dumps({"c": {str(i): v for (n, i), v in zip(names, start + scale * found.x) if n == "c"},
                  "t": {str(i): v for (n, i), v in zip(names, start + scale * found.x) if n == "t"}}))
